"""How every XML file of an FMU is written: UTF-8, indented, ends with a newline."""

from __future__ import annotations

import xml.etree.ElementTree as ET


def xml_file(root: ET.Element) -> bytes:
    """The bytes of a whole file."""
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'.encode()
