"""Remove unused archives from the cache, and the oldest ones if it is too large."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
import time
from contextlib import suppress
from pathlib import Path

PARTIAL = ".unpack-"
_DAY = 86400.0  # s
_LONG = 30 * _DAY
_IN_USE = _DAY  # a run may still need what was used since
_MOST = 4 * 2**30  # bytes
_ENTRY = re.compile(r"[0-9a-f]{64}")


def prune(within: Path) -> None:
    """Remove entries, and remains of killed processes. Other files of the folder stay."""
    with suppress(OSError):
        now = time.time()
        unused = {p: now - p.lstat().st_mtime for p in within.iterdir() if p.is_dir() and not p.is_symlink()}
        for path in [p for p in unused if p.name.startswith(PARTIAL) and unused[p] > _IN_USE]:
            shutil.rmtree(path, ignore_errors=True)
        entries = sorted((p for p in unused if _ENTRY.fullmatch(p.name)), key=lambda p: unused[p], reverse=True)
        sizes = {p: _size(p) for p in entries}
        total = sum(sizes.values())
        for path in entries:
            if unused[path] > (_LONG if total <= _MOST else _IN_USE):
                _remove(path)
                total -= sizes[path]


def _size(folder: Path) -> int:
    size = 0
    for above, _, names in os.walk(folder):
        for name in names:
            with suppress(OSError):
                size += os.lstat(os.path.join(above, name)).st_size
    return size


def _remove(entry: Path) -> None:
    """Remove an entry: it is renamed first, so that no process finds a part of it."""
    with suppress(OSError):
        made = tempfile.mkdtemp(prefix=PARTIAL, dir=entry.parent)
        with suppress(OSError):
            os.rename(entry, os.path.join(made, entry.name))
        shutil.rmtree(made, ignore_errors=True)
