"""Unpacked FMUs and SSPs, by the hash of their archive: each is unpacked once, however many runs and processes use it.

A folder appears under its name as a whole (atomic rename): two processes that unpack the same archive do not see each
other's half.  It may be deleted at any time between runs.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
import zipfile
from pathlib import Path

from hystfmu.base.errors import InputError
from hystfmu.base.files import read_bytes
from hystfmu.fmu.archive.unpack import MOST_UNPACKED, XML, archive_problems, unpack, xml_problems


def cache_folder() -> Path:
    """`$HYSTFMU_CACHE`, else `hystfmu` in the user's folder for caches."""
    if "HYSTFMU_CACHE" in os.environ:
        return Path(os.environ["HYSTFMU_CACHE"])
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "hystfmu" / "cache"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "hystfmu"


def unpacked(path: str | Path, needs: str = XML) -> tuple[Path, str]:
    """The folder of an unpacked archive, and its SHA-256; `needs` is the file that makes it what it should be.

    Raises
    ------
    InputError
        Not an archive, unsafe, too large, or no room for it.
    """
    digest = hashlib.sha256(read_bytes(path, MOST_UNPACKED)).hexdigest()
    folder = cache_folder() / digest
    if folder.is_dir():
        return folder, digest
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        made = Path(tempfile.mkdtemp(prefix=".unpack-", dir=folder.parent))
        try:
            with zipfile.ZipFile(path) as archive:
                problems = archive_problems(archive, needs) or unpack(archive, made) or xml_problems(made)
            if problems:
                raise InputError(f"{path}: {problems[0]}")
            try:
                os.rename(made, folder)
            except OSError:  # another process was faster
                if not folder.is_dir():
                    raise
        finally:
            shutil.rmtree(made, ignore_errors=True)
    except zipfile.BadZipFile as e:
        raise InputError(f"{path}: not a zip archive, or cut off ({e})") from None
    except OSError as e:
        raise InputError(f"{path}: cannot be unpacked: {e.strerror or e}") from None
    return folder, digest
