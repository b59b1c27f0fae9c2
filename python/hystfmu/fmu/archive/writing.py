"""Write ZIP and XML files reproducibly: equal content gives equal bytes."""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ET
import zlib
from collections.abc import Mapping
from dataclasses import dataclass

from hystfmu.base.printable import xml_text


def xml_file(root: ET.Element) -> bytes:
    """Return the bytes of an XML file."""
    for element in root.iter():
        element.attrib.update({name: xml_text(value) for name, value in element.attrib.items()})
        if element.text is not None:
            element.text = xml_text(element.text)
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'.encode()


_VERSION = 20  # 2.0: deflate
_UNIX = 3
_DEFLATE = 8
_DATE = 1 << 5 | 1  # 1980-01-01, so that equal content gives equal files
_FILE = 0o100000


@dataclass(frozen=True)
class Deflated:
    """A member of an archive: its content and its raw deflate stream (RFC 1951)."""

    content: bytes
    stream: bytes

    @classmethod
    def of(cls, content: bytes, level: int = 6) -> Deflated:
        """Deflate the content."""
        maker = zlib.compressobj(level, zlib.DEFLATED, -zlib.MAX_WBITS, 9)
        return cls(content, maker.compress(content) + maker.flush())


def zip_file(members: Mapping[str, bytes | Deflated], executable: str = "") -> bytes:
    """Return an archive with its members in the given order (PKWARE APPNOTE 6.3.10, sections 4.3.7, 4.3.12 and 4.3.16).

    Parameters
    ----------
    members : mapping
        Content by name; names are ASCII, all sizes below 4 GB.
    executable : str, optional
        Folder whose members get the executable mode of Unix.

    Returns
    -------
    bytes
        The archive; equal members give equal bytes at any time.
    """
    body, directory = b"", b""
    for name, given in members.items():
        member = given if isinstance(given, Deflated) else Deflated.of(given)
        checksum = zlib.crc32(member.content)
        sizes = struct.pack("<5H3I2H", _VERSION, 0, _DEFLATE, 0, _DATE, checksum, len(member.stream),
                            len(member.content), len(name), 0)  # fmt: skip
        mode = 0o755 if executable and name.startswith(executable) else 0o644
        place = struct.pack("<3H2I", 0, 0, 0, (_FILE | mode) << 16, len(body))
        directory += b"PK\1\2" + struct.pack("<BB", _VERSION, _UNIX) + sizes + place + name.encode("ascii")
        body += b"PK\3\4" + sizes + name.encode("ascii") + member.stream
    end = struct.pack("<4H2IH", 0, 0, len(members), len(members), len(directory), len(body), 0)
    return body + directory + b"PK\5\6" + end
