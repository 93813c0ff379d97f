"""Build the source distribution and the wheel of the last commit, the same bytes every time.

    .venv/bin/python tools/make_dist.py [FOLDER]

Built from a copy of what is committed. The wheel takes SOURCE_DATE_EPOCH by itself; in setuptools' archive of
the sources, directories, generated files and the gzip header carry the clock, so that it is written again.
"""

from __future__ import annotations

import gzip
import io
import os
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_BUILD = """
import sys
from setuptools import build_meta
target = sys.argv[1]
build_meta.build_sdist(target)
build_meta.build_wheel(target)
"""


def main() -> int:
    """Build both into FOLDER (dist/) and print their names."""
    target = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "dist").resolve()
    target.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, check=True, capture_output=True).stdout
        with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
            tar.extractall(folder, filter="data")
        committed = ["git", "log", "-1", "--format=%ct"]
        epoch = int(subprocess.run(committed, cwd=ROOT, check=True, capture_output=True).stdout)
        for path in build(Path(folder), target=target, epoch=epoch):
            print(path)
    return 0


def build(checkout: Path, *, target: Path, epoch: int) -> list[Path]:
    """Build the distributions from a checkout, in which files are written.

    Args: `epoch`: s since 1970 (UTC), the time of every file.
    Returns: Source distribution and wheel.
    """
    environment = {**os.environ, "SOURCE_DATE_EPOCH": str(epoch)}
    command = [sys.executable, "-c", _BUILD, str(target)]
    subprocess.run(command, cwd=checkout, env=environment, check=True, capture_output=True)
    (sources,), (wheel,) = target.glob("*.tar.gz"), target.glob("*.whl")
    sources.write_bytes(without_clock(sources.read_bytes(), epoch=epoch))
    return [sources, wheel]


def without_clock(archive: bytes, *, epoch: int) -> bytes:
    """A compressed tar archive with sorted members, of one time and without owner."""
    written = io.BytesIO()
    with (
        tarfile.open(fileobj=io.BytesIO(archive), mode="r:gz") as read,
        gzip.GzipFile(fileobj=written, mode="wb", filename="", mtime=epoch) as compressed,
        tarfile.open(fileobj=compressed, mode="w", format=tarfile.PAX_FORMAT) as tar,
    ):
        for member in sorted(read.getmembers(), key=lambda member: member.name):
            content = read.extractfile(member) if member.isfile() else None
            member.mtime, member.pax_headers = epoch, {}
            member.uid = member.gid = 0
            member.uname = member.gname = ""
            member.mode = 0o755 if member.isdir() or member.mode & 0o100 else 0o644
            tar.addfile(member, content)
    return written.getvalue()


if __name__ == "__main__":
    sys.exit(main())
