"""Archives of strangers: what must not be unpacked, and how the rest is."""

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
    """Why this entry must not be unpacked, or an empty string."""
    name = entry.orig_filename
    if "\\" in name or "\0" in name:
        return "has a backslash or a zero byte in its name"
    if name.startswith("/") or ":" in name.split("/")[0] or ".." in name.split("/"):
        return "would be written outside the folder"
    if stat.S_ISLNK(entry.external_attr >> 16):
        return "is a symbolic link"
    return "is encrypted" if entry.flag_bits & 1 else ""


def archive_problems(archive: zipfile.ZipFile, needs: str = XML) -> list[str]:
    """Why an archive must not be unpacked; nothing is written.  `needs` is the file without which it is of no use."""
    entries = archive.infolist()
    if len(entries) > MOST_ENTRIES:
        return [f"the archive has {len(entries)} files; the limit is {MOST_ENTRIES}"]
    size = sum(e.file_size for e in entries)
    if size > MOST_UNPACKED:
        return [f"the archive unpacks to {size} bytes; the limit is {MOST_UNPACKED}"]
    problems = [f"{e.filename!r} {why}" for e in entries if (why := _unsafe(e))]
    twice = [name for name, n in Counter(e.filename for e in entries).items() if n > 1]
    problems += [f"{name!r} is in the archive more than once" for name in twice]
    names = {e.filename for e in entries}
    if needs not in names:
        problems.append(f"the archive has no {needs}")
    large = (e.filename for e in entries if e.filename.endswith(".xml") and e.file_size > MOST_XML)
    problems += [f"{name} is larger than {MOST_XML} bytes" for name in large]
    return problems


def unpack(archive: zipfile.ZipFile, folder: Path) -> list[str]:
    """Write the entries of an archive that was found safe; the names of damaged ones.

    Piece by piece: an entry never needs memory for all of it, yields no more than its declared size, and its checksum
    is compared at the end.
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
    """XML files that could make a parser read other files or grow without limit."""
    problems = []
    for file in sorted(folder.rglob("*.xml")):
        content, name = file.read_bytes(), file.relative_to(folder).as_posix()
        if b"\0" in content:
            problems.append(f"{name} is not encoded in UTF-8")  # in UTF-16 the words below would not be found
        elif b"<!DOCTYPE" in content or b"<!ENTITY" in content:
            problems.append(f"{name} declares a document type; entities are refused")
    return problems
