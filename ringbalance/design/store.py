"""Results stored in a folder, each under a key derived from the content that determines it.

An entry begins with the digest of its payload and is written completely or not at all.  An entry that does
not match its digest, such as a corrupted file, a link or a folder, is removed and computed again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ringbalance.scene.platform.files import discard, read_kept, write_whole
from ringbalance.scene.platform.program import program_digest


@dataclass(frozen=True, kw_only=True)
class Store:
    """Store of results in a folder, which need not exist yet."""

    folder: Path

    def get(self, key: str) -> Any:
        """Payload of an entry; None: absent or damaged."""
        path = self._path(key)
        try:
            digest, _, payload = read_kept(path).partition(b"\n")
        except FileNotFoundError:
            return None
        except OSError:
            digest, payload = b"", b""
        if hashlib.sha256(key.encode() + payload).hexdigest().encode() == digest:
            return json.loads(payload)
        discard(path if path.parent.is_dir() else path.parent)
        return None

    def put(self, key: str, payload: Any) -> None:
        """Store a payload, plain data. Raises: OSError: it cannot be written; no partial file remains."""
        content = json.dumps(payload, allow_nan=False).encode()
        # The digest includes the key, so that a renamed entry does not match.
        digest = hashlib.sha256(key.encode() + content).hexdigest()
        write_whole(self._path(key), f"{digest}\n".encode() + content)

    def _path(self, key: str) -> Path:
        return self.folder / key[:2] / key


def key_of(content: Mapping[str, Any]) -> str:
    """Name of the entry for a content, plain data, as computed by this version of the program."""
    text = json.dumps([program_digest(), content], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
