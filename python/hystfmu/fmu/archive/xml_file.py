"""Write the XML files of an FMU: UTF-8, indented, with a final newline."""

from __future__ import annotations

import xml.etree.ElementTree as ET


def xml_file(root: ET.Element) -> bytes:
    """Return the bytes of an XML file."""
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'.encode()
