"""Write terminalsAndIcons.xml (FMI Specification 3.0.1, section 2.4.9): inputs and outputs as terminals, and the icon.

FMI 2.0 has no such file; its icon is model.png.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from hystfmu.fmu.archive.xml_file import xml_file
from hystfmu.graph import Graph

_SQUARE = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}


def terminals_and_icons(graph: Graph) -> bytes:
    """Write the file of a graph.  Terminals match by name ("bus"): two units connect where names agree."""
    root = ET.Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    picture = ET.SubElement(root, "GraphicalRepresentation")
    ET.SubElement(picture, "CoordinateSystem", {**_SQUARE, "suggestedScalingFactorTo_mm": "0.1"})
    ET.SubElement(picture, "Icon", _SQUARE)
    groups = {kind: [p for p in graph.ports if p.kind == kind] for kind in ("input", "output")}
    terminals = ET.SubElement(root, "Terminals") if any(groups.values()) else root
    for kind, ports in groups.items():
        if ports:
            terminal = ET.SubElement(
                terminals, "Terminal", name=f"{kind}s", matchingRule="bus", description=f"all {kind}s"
            )
            for p in ports:
                member = {"variableName": p.name, "memberName": p.name, "variableKind": "signal"}
                ET.SubElement(terminal, "TerminalMemberVariable", member)
    return xml_file(root)
