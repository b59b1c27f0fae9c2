"""Cache of unpacked FMUs and SSPs, keyed by the hash of the archive: all runs and processes share one copy.

An entry is checked whenever it is used; a damaged entry is unpacked again. An entry gets its name by an atomic rename,
so that two processes that unpack the same archive never see a partial copy. Unused entries are removed automatically,
and the oldest entries are removed if the cache is too large. The user may delete the cache between runs. A process that
cannot write to the cache uses a temporary cache, which is removed at its end.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
import shutil
import tempfile
import time
import zipfile
from contextlib import suppress
from functools import cache
from pathlib import Path

from hystfmu.base.child import open_result, read_result
from hystfmu.base.errors import InputError
from hystfmu.base.files import read_bytes
from hystfmu.fmu.archive.unpack import MOST_UNPACKED, XML, archive_problems, unpack, xml_problems

_NEW = "new"


def cache_folder() -> Path:
    """Return `$HYSTFMU_CACHE`, or `hystfmu` in the cache folder of the user."""
    if "HYSTFMU_CACHE" in os.environ:
        return Path(os.environ["HYSTFMU_CACHE"])
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "hystfmu" / "cache"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "hystfmu"


@cache
def _temporary() -> tempfile.TemporaryDirectory[str]:
    """Make a temporary cache for a process that cannot write to the cache of the user.

    The temporary cache is removed at the end of the process.
    """
    return tempfile.TemporaryDirectory(prefix="hystfmu-cache-")


def unpacked(path: str | Path, needs: str = XML) -> tuple[Path, str]:
    """Unpack an archive, or find its unpacked copy.

    Parameters
    ----------
    path : str or Path
        The archive, an untrusted file.
    needs : str, optional
        File that the archive must contain.

    Returns
    -------
    folder : Path
        Folder of the unpacked archive.
    digest : str
        SHA-256 of the archive.

    Raises
    ------
    InputError
        The file is not an archive, is unsafe or too large, or cannot be unpacked.
    """
    content = read_bytes(path, MOST_UNPACKED)
    digest = hashlib.sha256(content).hexdigest()
    try:
        with suppress(OSError):
            return _copy(cache_folder().absolute(), digest, path, content, needs), digest
        return _copy(Path(_temporary().name), digest, path, content, needs), digest
    except InputError:
        raise
    except (zipfile.BadZipFile, ValueError) as e:  # ValueError: its directory points before the file
        raise InputError(f"{path}: not a ZIP archive, or truncated ({e})") from None
    except OSError as e:
        raise InputError(f"{path}: cannot be unpacked: {e.strerror or e}") from None


def _copy(within: Path, digest: str, path: str | Path, content: bytes, needs: str) -> Path:
    """Return the folder of an unpacked archive in a cache."""
    entry = within / digest
    with suppress(OSError):
        os.utime(entry)  # first: what is used is not pruned
    if is_intact(entry):
        return entry / CONTENT
    within.mkdir(parents=True, exist_ok=True)
    made = Path(tempfile.mkdtemp(prefix=PARTIAL, dir=within))
    try:
        unpacks = made / _NEW / CONTENT
        unpacks.mkdir(parents=True)
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            problems = archive_problems(archive, needs) or unpack(archive, unpacks) or xml_problems(unpacks)
        if problems:
            raise InputError(f"{path}: {problems[0]}")
        write_hashes(made / _NEW)
        _put(made, entry)
    finally:
        shutil.rmtree(made, ignore_errors=True)
    prune(within)
    return entry / CONTENT


def _put(made: Path, entry: Path) -> None:
    """Rename an entry to its final name; a damaged entry of this name is removed.

    Another process may have renamed its copy first.
    """
    try:
        os.rename(made / _NEW, entry)
    except OSError:
        if not is_intact(entry):
            os.rename(entry, made / "old")
            os.rename(made / _NEW, entry)


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
    """Return the SHA-256 of each file by its name.

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


PARTIAL = ".unpack-"
_DAY = 86400.0  # s
_LONG = 30 * _DAY
_IN_USE = _DAY  # a run may still need what was used since
_MOST = 4 * 2**30  # bytes
_ENTRY = re.compile(r"[0-9a-f]{64}")


def prune(within: Path) -> None:
    """Remove entries, and files of killed processes. Other files of the folder are kept."""
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
    """Remove an entry. The entry is renamed first, so that no process finds a part of the entry."""
    with suppress(OSError):
        made = tempfile.mkdtemp(prefix=PARTIAL, dir=entry.parent)
        with suppress(OSError):
            os.rename(entry, os.path.join(made, entry.name))
        shutil.rmtree(made, ignore_errors=True)
