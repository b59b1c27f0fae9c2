"""Archives of FMUs and SSPs: unpacking of untrusted archives into a cache, and writing of reproducible archives.

Unpacking refuses unsafe entries, limits the number and size of files, and verifies checksums.

Each unpacked archive is one entry of the cache, identified by the hash of the archive, so all runs and processes share
one copy. An entry is verified whenever it is used; a damaged entry is unpacked again. A new entry is renamed
atomically, so that no process uses an incomplete copy. Entries that were not used for 30 days are removed. If the cache
is too large, the oldest entries are removed earlier. The user may delete the cache between runs. A process that cannot
write to the cache uses a temporary cache, which is removed at the end of the process.
"""

import errno
import hashlib
import io
import json
import lzma
import os
import posixpath
import re
import shutil
import stat
import struct
import tempfile
import time
import xml.etree.ElementTree as ET
import zipfile
import zlib
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from hystfmu.base import InputError, read_bytes, xml_text
from hystfmu.base.child import open_result, read_result

MOST_ENTRIES = 10_000
MOST_UNPACKED = 512 * 2**20
MOST_XML = 64 * 2**20
XML = "modelDescription.xml"
_OF_THE_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO)
_SHOWN = 80  # maximum number of characters of a name in a message
_PARSED = (".xml", ".ssd", ".ssv")
_OPAQUE = ("resources/", "documentation/", "extra/")


def _is_parsed(name: str) -> bool:
    """Return whether HystFMU parses the file `name` as XML. The content of other XML files is not restricted."""
    place = posixpath.normpath(name)
    return place.endswith(_PARSED) and (not place.endswith(".xml") or not place.startswith(_OPAQUE))


def _shown(name: str) -> str:
    return repr(name if len(name) <= _SHOWN else f"{name[:_SHOWN]}...")


def _unsafe(entry: zipfile.ZipInfo) -> str:
    """Return the reason why an entry of an archive is unsafe; an empty string for a safe entry."""
    name = entry.orig_filename
    if "\\" in name or "\0" in name:
        return "has a backslash or a null byte in its name"
    if name.startswith("/") or ":" in name.split("/")[0] or ".." in name.split("/"):
        return "would be written outside the folder"
    if stat.S_ISLNK(entry.external_attr >> 16):
        return "is a symbolic link"
    return "is encrypted" if entry.flag_bits & 1 else ""


def archive_problems(archive: zipfile.ZipFile, needs: str = XML) -> list[str]:
    """Return the reasons why an archive must not be unpacked, one line each. It must contain the file `needs`."""
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
    """Unpack an archive that has no `archive_problems` into a folder; return further problems, one line each.

    Entries are copied in pieces to limit the memory. At most the declared size of an entry is written, and its checksum
    is verified.

    Raises
    ------
    OSError
        The folder cannot be written, because the disk is full, read-only or defective.
    """
    problems = []
    for entry in archive.infolist():
        if entry.is_dir():
            continue
        path = folder / entry.filename
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            # mode "x": if two names differ only in case, Windows and macOS would overwrite the first file
            with archive.open(entry) as packed, path.open("xb") as unpacked:
                shutil.copyfileobj(packed, unpacked, 1 << 20)
        except (zipfile.BadZipFile, zlib.error, lzma.LZMAError, EOFError, NotImplementedError, RuntimeError) as e:
            problems.append(f"{_shown(entry.filename)} cannot be unpacked: {e}")
        except OSError as e:
            if e.errno in _OF_THE_DISK:
                raise
            problems.append(f"{_shown(entry.filename)} cannot be unpacked: {e.strerror or e}")
    return problems


def xml_problems(folder: Path) -> list[str]:
    """Return the unsafe XML files in a folder, one line each.

    An unsafe file could cause an XML parser to read other files, or to expand entities without limit.
    """
    problems = []
    for file in sorted(folder.rglob("*")):
        name = file.relative_to(folder).as_posix()
        if not _is_parsed(name) or not file.is_file():
            continue
        content = file.read_bytes()
        if b"\0" in content:
            problems.append(f"{name} is not encoded in UTF-8")  # the search below would not find words in UTF-16
        elif b"<!DOCTYPE" in content or b"<!ENTITY" in content:
            problems.append(f"{name} must not declare a document type or entities")
    return problems


_NEW = "new"


def cache_folder() -> Path:
    """Return the folder of the cache: `$HYSTFMU_CACHE`, or `hystfmu` in the cache folder of the user."""
    if "HYSTFMU_CACHE" in os.environ:
        return Path(os.environ["HYSTFMU_CACHE"])
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "hystfmu" / "cache"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "hystfmu"


@cache
def _temporary() -> tempfile.TemporaryDirectory[str]:
    """Return the folder of a temporary cache, for a process that cannot write to the cache of the user.

    The folder is removed at the end of the process.
    """
    return tempfile.TemporaryDirectory(prefix="hystfmu-cache-")


def unpacked(path: str | Path, needs: str = XML) -> tuple[Path, str]:
    """Unpack an untrusted archive into the cache, or find its copy there. The archive must contain the file `needs`.

    Returns the folder of the unpacked archive, and the SHA-256 hash of the archive.

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
    # ValueError: an offset in the directory is negative; NotImplementedError: the version of the format is unknown
    except (zipfile.BadZipFile, ValueError, NotImplementedError) as e:
        raise InputError(f"{path}: not a ZIP archive, or truncated ({e})") from None
    except OSError as e:
        raise InputError(f"{path}: cannot be unpacked: {e.strerror or e}") from None


def _copy(within: Path, digest: str, path: str | Path, content: bytes, needs: str) -> Path:
    """Return the folder of an archive in a cache; unpack the archive if the cache does not contain it."""
    entry = within / digest
    with suppress(OSError):
        os.utime(entry)  # updated first, so that `prune` does not remove an entry in use
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
    """Give a new entry of the cache its final name, and remove a damaged entry with this name.

    If another process has already added a valid entry with this name, that entry stays.
    """
    try:
        os.rename(made / _NEW, entry)
    except OSError:
        if not is_intact(entry):
            os.rename(entry, made / "old")
            os.rename(made / _NEW, entry)


CONTENT = "content"
_HASHES = "hashes.json"
_MOST_HASHES = 2**24  # maximum size of the file of hashes (bytes)


def write_hashes(entry: Path) -> None:
    """Store the hashes of all files of an entry in the file of hashes."""
    (entry / _HASHES).write_text(json.dumps(_hashes(entry / CONTENT)))


def is_intact(entry: Path) -> bool:
    """Return whether an entry contains exactly the files that were unpacked, without changes."""
    try:
        return bool(json.loads(read_result(entry / _HASHES, _MOST_HASHES)) == _hashes(entry / CONTENT))
    except (OSError, InputError, ValueError, RecursionError):
        return False


def _hashes(content: Path) -> dict[str, str]:
    """Return the SHA-256 hash of each file of an entry, by the name of the file.

    Raises
    ------
    OSError, InputError
        A file cannot be read, or is a link.
    """
    found = {}
    for above, folders, names in os.walk(content):  # os.walk does not follow links
        for name in [*names, *(f for f in folders if os.path.islink(os.path.join(above, f)))]:
            path = Path(above, name)
            with open_result(path) as f:  # open_result refuses links
                found[path.relative_to(content).as_posix()] = hashlib.file_digest(f, "sha256").hexdigest()
    return found


PARTIAL = ".unpack-"
_DAY = 86400.0  # s
_LONG = 30 * _DAY
_IN_USE = _DAY  # a run may still need entries that were used within this time
_MOST = 4 * 2**30  # size of the cache (bytes) above which old entries are removed
_ENTRY = re.compile(r"[0-9a-f]{64}")


def prune(within: Path) -> None:
    """Remove unused entries from a cache, and temporary files of killed processes. Other files stay."""
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
    """Remove an entry of the cache. The entry is renamed first, so that no process uses a part of it."""
    with suppress(OSError):
        made = tempfile.mkdtemp(prefix=PARTIAL, dir=entry.parent)
        with suppress(OSError):
            os.rename(entry, os.path.join(made, entry.name))
        shutil.rmtree(made, ignore_errors=True)


def xml_file(root: ET.Element) -> bytes:
    """Return the content of an XML file with the given root element."""
    for element in root.iter():
        element.attrib.update({name: xml_text(value) for name, value in element.attrib.items()})
        if element.text is not None:
            element.text = xml_text(element.text)
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'.encode()


_VERSION = 20  # version 2.0, needed for deflate
_UNIX = 3
_DEFLATE = 8
_UTF_8 = 1 << 11  # flag of a name that is not ASCII
_DATE = 1 << 5 | 1  # 1980-01-01, so that equal content gives equal files
_FILE = 0o100000


@dataclass(frozen=True)
class Deflated:
    """A file of an archive, with its content and the compressed content, a raw deflate stream (RFC 1951)."""

    content: bytes
    stream: bytes

    @classmethod
    def of(cls, content: bytes, level: int = 6) -> "Deflated":
        """Return a file of an archive with the given content, compressed with the given level."""
        maker = zlib.compressobj(level, zlib.DEFLATED, -zlib.MAX_WBITS, 9)
        return cls(content, maker.compress(content) + maker.flush())


def zip_file(members: Mapping[str, bytes | Deflated], executable: str = "") -> bytes:
    """Return a zip archive of files, in the given order. Equal files give bit-identical archives.

    Files in the folder `executable` get the executable permission of Unix. All sizes are below 4 GB. The format is
    defined in PKWARE APPNOTE 6.3.10, sections 4.3.7, 4.3.12 and 4.3.16.
    """
    body, directory = b"", b""
    for name, given in members.items():
        member = given if isinstance(given, Deflated) else Deflated.of(given)
        checksum, encoded = zlib.crc32(member.content), name.encode()
        flags = 0 if name.isascii() else _UTF_8
        sizes = struct.pack("<5H3I2H", _VERSION, flags, _DEFLATE, 0, _DATE, checksum, len(member.stream),
                            len(member.content), len(encoded), 0)  # fmt: skip
        mode = 0o755 if executable and name.startswith(executable) else 0o644
        place = struct.pack("<3H2I", 0, 0, 0, (_FILE | mode) << 16, len(body))
        directory += b"PK\1\2" + struct.pack("<BB", _VERSION, _UNIX) + sizes + place + encoded
        body += b"PK\3\4" + sizes + encoded + member.stream
    end = struct.pack("<4H2IH", 0, 0, len(members), len(members), len(directory), len(body), 0)
    return body + directory + b"PK\5\6" + end
