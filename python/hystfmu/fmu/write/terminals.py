"""Icon and terminals of an FMU: terminalsAndIcons.xml, and the loop as PNG of 128 x 128 pixels and as SVG."""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ET
import zlib

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.fmu.archive.writing import xml_file
from hystfmu.graph import Graph
from hystfmu.report.curve import path

SIZE, MARGIN, FRAME = 128, 22, 5
INK, PAPER, EDGE = (31, 95, 168), (247, 249, 252), (185, 200, 218)
_STROKE, _REACH = 1.7, 4  # half the line width; distance up to which the line shades a pixel


def _points(curve: tuple[Array, Array]) -> Array:
    """Return the curve in pixels, shape (n, 2), with y downwards; a constant signal becomes a line in the middle."""
    room = SIZE - 2 * MARGIN
    columns = []
    for values, turned in zip(curve, (False, True), strict=True):
        lo, span = values.min(), np.ptp(values)
        share = (values - lo) / span if span > 0 else np.full(len(values), 0.5)
        columns.append(MARGIN + room * (1 - share if turned else share))
    return np.column_stack(columns)


def _shades(points: Array) -> Array:
    """Return the coverage of every pixel by the line, shape (SIZE, SIZE), 0 to 1."""
    steps = np.maximum(1, np.ceil(2 * np.hypot(*np.diff(points, axis=0).T)).astype(int))
    places = np.concatenate([[0.0], np.cumsum(steps)])
    dense = np.column_stack([np.interp(np.arange(places[-1] + 1), places, column) for column in points.T])
    around = np.arange(-_REACH, _REACH + 1)
    x = np.floor(dense[:, 0])[:, None, None] + around[None, None, :]
    y = np.floor(dense[:, 1])[:, None, None] + around[None, :, None]
    distance = np.hypot(x + 0.5 - dense[:, 0, None, None], y + 0.5 - dense[:, 1, None, None])
    nearest = np.full(SIZE * SIZE, np.inf)
    np.minimum.at(nearest, (y * SIZE + x).astype(int).ravel(), distance.ravel())
    return np.clip(_STROKE + 0.5 - nearest, 0.0, 1.0).reshape(SIZE, SIZE)


def png(curve: tuple[Array, Array]) -> bytes:
    """Return the icon as PNG (8-bit RGB); `curve` is (x, y), each of shape (n,)."""
    inside = np.full((SIZE, SIZE, 1), 0.0)
    inside[FRAME:-FRAME, FRAME:-FRAME] = 1.0
    core = np.full((SIZE, SIZE, 1), 0.0)
    core[FRAME + 1 : -FRAME - 1, FRAME + 1 : -FRAME - 1] = 1.0
    picture = 255.0 * (1 - inside) + np.array(EDGE) * (inside - core) + np.array(PAPER) * core
    shade = _shades(_points(curve))[..., None]
    picture = picture * (1 - shade) + np.array(INK) * shade
    lines = picture.round().astype(np.uint8).reshape(SIZE, -1)
    raw = np.column_stack([np.zeros(SIZE, np.uint8), lines]).tobytes()  # each line begins with the filter type 0 (none)

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    head = struct.pack(">IIBBBBB", SIZE, SIZE, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b"")


def svg(curve: tuple[Array, Array]) -> bytes:
    """Return the icon as SVG; `curve` is (x, y), each of shape (n,)."""
    points = _points(curve)
    ink, paper, edge = ("#{:02x}{:02x}{:02x}".format(*c) for c in (INK, PAPER, EDGE))
    side = SIZE - 2 * FRAME
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SIZE} {SIZE}">'
        f'<rect x="{FRAME}" y="{FRAME}" width="{side}" height="{side}" fill="{paper}" stroke="{edge}"/>'
        f'<path transform="scale(.1)" fill="none" stroke="{ink}" stroke-width="{20 * _STROKE:g}" '
        f'stroke-linejoin="round" d="{path(points[:, 0], points[:, 1])}"/></svg>\n'
    ).encode()


_SQUARE = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}


def terminals_and_icons(graph: Graph) -> bytes:
    """Write the file of a graph. Terminals match by name ("bus"): ports of two units connect if their names agree."""
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
