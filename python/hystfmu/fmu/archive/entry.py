"""An entry of the cache of unpacked archives: a folder with the content and the hash of each file of it."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

from hystfmu.base.errors import InputError
from hystfmu.base.results import open_result, read_result

CONTENT = "content"
_HASHES = "hashes.json"
_MOST_HASHES = 2**24  # bytes


def write_hashes(entry: Path) -> None:
    """Store the hash of each file of the content."""
    (entry / _HASHES).write_text(json.dumps(_hashes(entry / CONTENT)))


def is_intact(entry: Path) -> bool:
    """Return whether the content has exactly the files that were unpacked."""
    try:
        return bool(json.loads(read_result(entry / _HASHES, _MOST_HASHES)) == _hashes(entry / CONTENT))
    except (OSError, InputError, ValueError, RecursionError):
        return False


def _hashes(content: Path) -> dict[str, str]:
    """Return SHA-256 by name.

    Raises
    ------
    OSError, InputError
        A file cannot be read, or is a link.
    """
    found = {}
    for above, folders, names in os.walk(content):  # which follows no links
        for name in [*names, *(f for f in folders if os.path.islink(os.path.join(above, f)))]:
            path = Path(above, name)
            with open_result(path) as f:  # which refuses them
                found[path.relative_to(content).as_posix()] = hashlib.file_digest(f, "sha256").hexdigest()
    return found
