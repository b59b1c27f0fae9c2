"""Cache of unpacked FMUs and SSPs, keyed by the hash of the archive: all runs and processes share one copy.

A folder gets its name by an atomic rename, so that two processes that unpack the same archive never see a partial copy.
The cache may be deleted between runs.
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
    """Return `$HYSTFMU_CACHE`, or `hystfmu` in the cache folder of the user."""
    if "HYSTFMU_CACHE" in os.environ:
        return Path(os.environ["HYSTFMU_CACHE"])
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "hystfmu" / "cache"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "hystfmu"


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
    digest = hashlib.sha256(read_bytes(path, MOST_UNPACKED)).hexdigest()
    folder = cache_folder().absolute() / digest
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
        raise InputError(f"{path}: not a ZIP archive, or truncated ({e})") from None
    except OSError as e:
        raise InputError(f"{path}: cannot be unpacked: {e.strerror or e}") from None
    return folder, digest
