"""Answers kept in a folder, each found by the content that it was computed from.

An entry begins with the digest of its payload and is written whole or not at all.  One that does not fit its
digest, such as a file with a flipped bit, a link or a folder, counts as absent and is removed; it is computed
again.
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
    """Entries in a folder, which need not exist yet."""

    folder: Path

    def get(self, key: str) -> Any:
        """Payload of an entry; None: there is none, or it is damaged."""
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
        """Keep a payload, plain data. Raises: OSError: it cannot be written; nothing is left behind."""
        content = json.dumps(payload, allow_nan=False).encode()
        # With the key in the digest an entry under another's name does not fit.
        digest = hashlib.sha256(key.encode() + content).hexdigest()
        write_whole(self._path(key), f"{digest}\n".encode() + content)

    def _path(self, key: str) -> Path:
        return self.folder / key[:2] / key


def key_of(content: Mapping[str, Any]) -> str:
    """Name of the entry that this program computes from a content, plain data."""
    text = json.dumps([program_digest(), content], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
