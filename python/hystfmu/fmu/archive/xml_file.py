"""Write XML files: UTF-8, indented, with a final newline; characters that XML cannot hold become visible escapes."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from hystfmu.base.printable import xml_text


def xml_file(root: ET.Element) -> bytes:
    """Return the bytes of an XML file."""
    for element in root.iter():
        element.attrib.update({name: xml_text(value) for name, value in element.attrib.items()})
        if element.text is not None:
            element.text = xml_text(element.text)
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'.encode()
