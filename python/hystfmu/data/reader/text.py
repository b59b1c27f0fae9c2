"""From the bytes of an untrusted file to text: bounded decompression, encodings, line ends."""

from __future__ import annotations

import re
import zlib
from pathlib import Path

from hystfmu.base.errors import InputError
from hystfmu.base.files import read_bytes

GZIP = b"\x1f\x8b"
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]")
_MARKS = ((b"\xef\xbb\xbf", "utf-8"), (b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"))
_LOOK = 1000  # bytes that tell UTF-16 without a mark


def content_of(path: str | Path, most: int) -> tuple[bytes, list[str]]:
    """Read a file, unpack gzip, and return the bytes and a remark.

    Raises
    ------
    InputError
        The file cannot be read, is damaged, or has more than `most` bytes, unpacked ones included.
    """
    content = read_bytes(path, most)
    if not content.startswith(GZIP):
        return content, []
    parts, size = [], 0
    while content.startswith(GZIP):
        unpacker = zlib.decompressobj(wbits=31)
        try:
            parts.append(unpacker.decompress(content, most - size + 1))
        except zlib.error as e:
            raise InputError(f"{path}: The file must be a whole gzip archive. Got {e} instead.") from None
        size += len(parts[-1])
        if size > most:
            raise InputError(f"{path}: The file must have at most {most} bytes when unpacked. Got more.")
        if not unpacker.eof:
            raise InputError(f"{path}: The file must be a whole gzip archive. Got one that breaks off.")
        content = unpacker.unused_data
    return b"".join(parts), ["gzip"]


def text_of(content: bytes, path: str | Path) -> tuple[str, list[str]]:
    """Decode a text file; lines end with a line feed afterwards.

    Text is UTF-8 or UTF-16, with or without a byte order mark; otherwise cp1252, the encoding of Windows, is assumed.

    Raises
    ------
    InputError
        The bytes are not text.
    """
    name, start = next(((n, len(m)) for m, n in _MARKS if content.startswith(m)), ("", 0))
    if not name:
        zeros = [content[k:_LOOK:2].count(0) for k in (0, 1)]
        half = max(1, min(len(content), _LOOK) // 2)
        name = "utf-16-le" if zeros[1] > 0.7 * half else "utf-16-be" if zeros[0] > 0.7 * half else "utf-8"
    try:
        text = content[start:].decode(name)
    except UnicodeDecodeError as e:
        if name != "utf-8" or start:
            raise InputError(f"{path}: The file must be text. Got bytes that are not {_shown(name)}.") from None
        try:
            text, name = content.decode("cp1252"), "cp1252"
        except UnicodeDecodeError:
            line = content.count(b"\n", 0, e.start) + 1
            raise InputError(
                f"{path}: line {line}: The file must be text. Got the byte 0x{content[e.start]:02x}."
            ) from None
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    if found := _CONTROL.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise InputError(f"{path}: line {line}: The file must be text. Got the character 0x{ord(found[0]):02x}.")
    plain = name == "utf-8"
    return text, [] if plain else [_shown(name)]


def _shown(name: str) -> str:
    return {"utf-8": "UTF-8", "utf-16-le": "UTF-16", "utf-16-be": "UTF-16"}.get(name, name)
