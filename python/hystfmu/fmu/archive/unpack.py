"""Unpack untrusted archives: refuse unsafe entries, limit number and size of files, verify checksums."""

from __future__ import annotations

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


def _unsafe(entry: zipfile.ZipInfo) -> str:
    """Return why an entry is unsafe, or an empty string."""
    name = entry.orig_filename
    if "\\" in name or "\0" in name:
        return "has a backslash or a null byte in its name"
    if name.startswith("/") or ":" in name.split("/")[0] or ".." in name.split("/"):
        return "would be written outside the folder"
    if stat.S_ISLNK(entry.external_attr >> 16):
        return "is a symbolic link"
    return "is encrypted" if entry.flag_bits & 1 else ""


def archive_problems(archive: zipfile.ZipFile, needs: str = XML) -> list[str]:
    """Return why an archive must not be unpacked, one line each.  `needs` is a file that it must contain."""
    entries = archive.infolist()
    if len(entries) > MOST_ENTRIES:
        return [f"the archive must have at most {MOST_ENTRIES} files. Got {len(entries)} instead."]
    size = sum(e.file_size for e in entries)
    if size > MOST_UNPACKED:
        return [f"the archive must unpack to at most {MOST_UNPACKED} bytes. Got {size} instead."]
    problems = [f"{e.filename!r} {why}" for e in entries if (why := _unsafe(e))]
    twice = [name for name, n in Counter(e.filename for e in entries).items() if n > 1]
    problems += [f"{name!r} occurs in the archive more than once" for name in twice]
    names = {e.filename for e in entries}
    if needs not in names:
        problems.append(f"the archive has no {needs}")
    large = (e.filename for e in entries if e.filename.endswith(".xml") and e.file_size > MOST_XML)
    problems += [f"{name} is larger than {MOST_XML} bytes" for name in large]
    return problems


def unpack(archive: zipfile.ZipFile, folder: Path) -> list[str]:
    """Write the entries of an archive without `archive_problems` to a folder; return the problems found, one line each.

    Entries are copied in pieces to bound memory.  An entry yields at most its declared size, and its checksum is
    verified.
    """
    problems = []
    for entry in archive.infolist():
        if entry.is_dir():
            continue
        path = folder / entry.filename
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with archive.open(entry) as packed, path.open("wb") as unpacked:
                shutil.copyfileobj(packed, unpacked, 1 << 20)
        except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as e:
            problems.append(f"{entry.filename!r} cannot be unpacked: {e}")
        except OSError as e:
            problems.append(f"{entry.filename!r} cannot be unpacked: {e.strerror or e}")
    return problems


def xml_problems(folder: Path) -> list[str]:
    """Return which XML files could make a parser read other files or expand without limit, one line each."""
    problems = []
    for file in sorted(folder.rglob("*.xml")):
        content, name = file.read_bytes(), file.relative_to(folder).as_posix()
        if b"\0" in content:
            problems.append(f"{name} is not encoded in UTF-8")  # the search below would miss words in UTF-16
        elif b"<!DOCTYPE" in content or b"<!ENTITY" in content:
            problems.append(f"{name} must not declare a document type or entities")
    return problems
