"""Cache of unpacked FMUs and SSPs, keyed by the hash of the archive: all runs and processes share one copy.

An entry is checked whenever it is used; a damaged one is unpacked again. It gets its name by an atomic rename, so that
two processes that unpack the same archive never see a partial copy. The cache may be deleted between runs. A process
that cannot write it has one in a temporary folder, for as long as it runs.
"""

from __future__ import annotations

import hashlib
import io
import os
import shutil
import tempfile
import zipfile
from contextlib import suppress
from functools import cache
from pathlib import Path

from hystfmu.base.errors import InputError
from hystfmu.base.files import read_bytes
from hystfmu.fmu.archive.entry import CONTENT, is_intact, write_hashes
from hystfmu.fmu.archive.prune import PARTIAL, prune
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
    """Make a temporary cache for a process that cannot write the cache of the user.

    It is removed at the end of the process.
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
        If the file is not an archive, is unsafe or too large, or cannot be unpacked.
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

    Another process may have been faster.
    """
    try:
        os.rename(made / _NEW, entry)
    except OSError:
        if not is_intact(entry):
            os.rename(entry, made / "old")
            os.rename(made / _NEW, entry)
