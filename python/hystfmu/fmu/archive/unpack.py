"""Unpack untrusted archives: refuse unsafe entries, limit number and size of files, verify checksums."""

from __future__ import annotations

import errno
import posixpath
import shutil
import stat
import zipfile
import zlib
from collections import Counter
from pathlib import Path

MOST_ENTRIES = 10_000
MOST_UNPACKED = 512 * 2**20
MOST_XML = 64 * 2**20
XML = "modelDescription.xml"
_OF_THE_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO)
_SHOWN = 80  # characters of a name in a message
_PARSED = (".xml", ".ssd", ".ssv")
_OPAQUE = ("resources/", "documentation/", "extra/")


def _is_parsed(name: str) -> bool:
    """Return whether this program reads a file as XML. The content of other XML files is not restricted."""
    place = posixpath.normpath(name)
    return place.endswith(_PARSED) and (not place.endswith(".xml") or not place.startswith(_OPAQUE))


def _shown(name: str) -> str:
    return repr(name if len(name) <= _SHOWN else f"{name[:_SHOWN]}...")


def _unsafe(entry: zipfile.ZipInfo) -> str:
    """Return the reason why an entry is unsafe, or an empty string."""
    name = entry.orig_filename
    if "\\" in name or "\0" in name:
        return "has a backslash or a null byte in its name"
    if name.startswith("/") or ":" in name.split("/")[0] or ".." in name.split("/"):
        return "would be written outside the folder"
    if stat.S_ISLNK(entry.external_attr >> 16):
        return "is a symbolic link"
    return "is encrypted" if entry.flag_bits & 1 else ""


def archive_problems(archive: zipfile.ZipFile, needs: str = XML) -> list[str]:
    """Return the reasons why an archive must not be unpacked, one line each; it must contain the file `needs`."""
    entries = archive.infolist()
    if len(entries) > MOST_ENTRIES:
        return [f"the archive must have at most {MOST_ENTRIES} files. Got {len(entries)} instead."]
    size = sum(e.file_size for e in entries)
    if size > MOST_UNPACKED:
        return [f"the archive must unpack to at most {MOST_UNPACKED} bytes. Got {size} instead."]
    problems = [f"{_shown(e.filename)} {why}" for e in entries if (why := _unsafe(e))]
    names = Counter(posixpath.normpath(e.filename) for e in entries if not e.is_dir())  # './a' and 'a' are one file
    problems += [f"{_shown(name)} occurs in the archive more than once" for name, n in names.items() if n > 1]
    if needs not in names:
        near = min((n for n in names if n.rpartition("/")[2].lower() == needs.lower()), key=len, default="")
        there = f"; it has {_shown(near)}: the file must be at the top, spelt like this" if near else ""
        problems.append(f"the archive has no {needs}{there}")
    large = (e.filename for e in entries if _is_parsed(e.filename) and e.file_size > MOST_XML)
    problems += [f"{_shown(name)} is larger than {MOST_XML} bytes" for name in large]
    return problems


def unpack(archive: zipfile.ZipFile, folder: Path) -> list[str]:
    """Write the entries of an archive without `archive_problems` to a folder; return the problems found, one line each.

    Entries are copied in pieces to limit memory. At most the declared size of an entry is written, and its checksum is
    verified.

    Raises
    ------
    OSError
        The folder cannot be written: its disk is full, read-only or broken.
    """
    problems = []
    for entry in archive.infolist():
        if entry.is_dir():
            continue
        path = folder / entry.filename
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            # "x": where names differ in case only, Windows and macOS would overwrite the first file
            with archive.open(entry) as packed, path.open("xb") as unpacked:
                shutil.copyfileobj(packed, unpacked, 1 << 20)
        except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as e:
            problems.append(f"{_shown(entry.filename)} cannot be unpacked: {e}")
        except OSError as e:
            if e.errno in _OF_THE_DISK:
                raise
            problems.append(f"{_shown(entry.filename)} cannot be unpacked: {e.strerror or e}")
    return problems


def xml_problems(folder: Path) -> list[str]:
    """Return the files that could make an XML parser read other files or expand without limit, one line each."""
    problems = []
    for file in sorted(folder.rglob("*")):
        name = file.relative_to(folder).as_posix()
        if not _is_parsed(name) or not file.is_file():
            continue
        content = file.read_bytes()
        if b"\0" in content:
            problems.append(f"{name} is not encoded in UTF-8")  # the search below would miss words in UTF-16
        elif b"<!DOCTYPE" in content or b"<!ENTITY" in content:
            problems.append(f"{name} must not declare a document type or entities")
    return problems
