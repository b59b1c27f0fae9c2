"""Reference experiment of an FMU, which is a stimulus with nested loops and the response; icons and terminals.

Importers can repeat the experiment and compare the results. The formats are the FMI Layered Standard for References
(fmi-ls-ref 1.0.0-beta.1) and, for the experiment, MA-HS-Experiments. The documentation and the icons show the
hysteresis loop of this experiment. The icons are a PNG file of 128 x 128 pixels and an SVG file.
"""

import hashlib
import math
import struct
import xml.etree.ElementTree as ET
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from hystfmu.base import Array
from hystfmu.fmu.archive import xml_file
from hystfmu.fmu.write.description import Fmi
from hystfmu.graph import Graph, Port
from hystfmu.graph.graph import suitable_step
from hystfmu.model import Model
from hystfmu.report.axis import path

SIZE, MARGIN, FRAME = 128, 22, 5
INK, PAPER, EDGE = (31, 95, 168), (247, 249, 252), (185, 200, 218)
_STROKE, _REACH = 1.7, 4  # pixels: half the line width; maximum distance at which a line colours a pixel


def _points(curve: tuple[Array, Array]) -> Array:
    """Return the points (n, 2) of a curve in pixels, with y downwards. A constant signal is drawn in the middle."""
    room = SIZE - 2 * MARGIN
    columns = []
    for values, turned in zip(curve, (False, True), strict=True):
        lo, span = values.min(), np.ptp(values)
        share = (values - lo) / span if span > 0 else np.full(len(values), 0.5)
        columns.append(MARGIN + room * (1 - share if turned else share))
    return np.column_stack(columns)


def _shades(points: Array) -> Array:
    """Return the fraction (SIZE, SIZE) of each pixel that the line covers, 0 to 1."""
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
    """Return the icon as a PNG file (8-bit RGB). `curve` contains x and y, each of shape (n,)."""
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
    """Return the icon as an SVG file. `curve` contains x and y, each of shape (n,)."""
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
    """Return the content of terminalsAndIcons.xml for a graph.

    The terminals have the matching rule "bus": an importer connects the ports of two FMUs if their names are equal.
    """
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


FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
_NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
# a major loop, then minor loops inside it; linear ramps are bit-identical on all computers
_PEAKS = (0.0, 1.0, -1.0, 1.0, -0.5, 0.5, -0.25, 0.75, -1.0)
_ROWS = 25  # rows per ramp
_NUMBERS = 1500  # approximate number of values in result.csv; with many outputs, it contains only the first ramps


def _path() -> Array:
    """Return the stimulus (n,) of the reference experiment, scaled to [-1, 1]."""
    places = np.arange(_ROWS * (len(_PEAKS) - 1) + 1) / _ROWS
    return np.interp(places, np.arange(len(_PEAKS)), _PEAKS)


def _span(port: Port, model: Model | None) -> tuple[float, float]:
    """Return the range of the stimulus at a port. By default, it is the start value +- 1.

    If `model` contains the range of the training data, the function returns this range.
    """
    span = model.provenance.get("span_u") if model else None
    if isinstance(span, Sequence) and len(span) == 2 and math.isfinite(span[1] - span[0]) and port.size == 1:
        return float(span[0]), float(span[1])
    lo, hi = port.start[0] - 1.0, port.start[0] + 1.0
    return max(lo, port.var.lo), min(hi, port.var.hi)


@dataclass(frozen=True)
class Reference:
    """Inputs u (rows, scalar inputs) and outputs y (rows, scalar outputs) of a graph, with the step h (s).

    Row 0 belongs to the initialisation. For the outputs of row k, the inputs of row k - 1 are set, and then a step to
    the time of row k is made. This is the behaviour of a master that sets the inputs at the beginning of every step.
    """

    graph: Graph
    h: float
    u: Array
    y: Array

    @classmethod
    def of(cls, graph: Graph, model: Model | None = None) -> "Reference":
        """Return the reference experiment of a graph. The stimulus has the range of the training data of `model`.

        Each covariate increases from the lower to the upper end of its range in the training data.
        """
        h = suitable_step(graph)
        columns = []
        drifting = model.provenance.get("span_covariates", {}) if model else {}
        rows = len(_path())
        for port in graph.ports:
            if port.kind != "input":
                continue
            if port.name in drifting:
                lo, hi = drifting[port.name]
                columns.append(lo + (hi - lo) * np.arange(rows) / (rows - 1))
            else:
                lo, hi = _span(port, model)
                columns += [lo + (hi - lo) * (_path() + 1) / 2] * port.size
        u = np.column_stack([*columns, np.zeros((rows, 0))])
        held = np.vstack([u[:1], u[:-1]])
        return cls(graph, h, u, graph.executor().run(held, graph.n_outputs, h))

    @cached_property
    def curve(self) -> tuple[Array, Array]:
        """Curve (x, y) for plots: the first output over the first input or, without inputs, over time.

        Its values are finite, even if the output of the model overflows.
        """
        y = np.clip(np.nan_to_num(self.y[:, 0]), -1e150, 1e150)
        if self.u.shape[1]:
            return self.u[:-1, 0], y[1:]
        return np.asarray(self.h * np.arange(len(y)), dtype=np.float64), y

    def _csv(self, kind: str, values: Array, fmi: Fmi) -> bytes:
        """Return a CSV file with the time and one column for each variable. In FMI 2.0, each element is a variable."""
        ports = [p for p in self.graph.ports if p.kind == kind]
        names = [n for p in ports for n in (p.scalar_names if fmi == 2 else (p.name,))]
        widths = [w for p in ports for w in ([1] * p.size if fmi == 2 else [p.size])]
        starts = np.concatenate([[0], np.cumsum(widths)]).astype(int).tolist()
        lines = [",".join(["time", *map(_cell, names)])]
        for k, row in enumerate(values.tolist()):
            words = [" ".join(map(repr, row[a:b])) for a, b in pairwise(starts)]
            lines.append(",".join([repr(k * self.h), *words]))
        return ("\n".join(lines) + "\n").encode()

    def files(self, fmi: Fmi) -> dict[str, bytes]:
        """Return the files of the FMI Layered Standard for References, by their names in the archive."""
        rows = min(len(self.y), max(2 * _ROWS, _NUMBERS // max(1, self.y.shape[1])) + 1)
        files = {"result.csv": self._csv("output", self.y[:rows], fmi)}
        if self.u.shape[1]:
            files["input.csv"] = self._csv("input", self.u[:rows], fmi)
        root = ET.Element("Experiments", name="reference", description="One run with a recorded result.")
        experiment = ET.SubElement(
            root,
            "Experiment",
            name="nested loops",
            description="Co-simulation with fixed steps; the inputs of a row are set at its time, before the step.",
        )
        stop = repr((rows - 1) * self.h)
        ET.SubElement(experiment, "TransientSimulation", startTime="0.0", stopTime=stop, stepSize=repr(self.h))
        if "input.csv" in files:
            ET.SubElement(experiment, "Stimuli", source="input.csv", type="text/csv")
        ET.SubElement(experiment, "References", source="result.csv", type="text/csv")
        files["experiments.xml"] = xml_file(root)
        files["fmi-ls-manifest.xml"] = _manifest(files)
        return {f"{FOLDER}/{name}": content for name, content in sorted(files.items())}


def _cell(name: str) -> str:
    """Return a name as a cell of a CSV file."""
    return '"' + name.replace('"', '""') + '"' if set(name) & set(',"') else name


def _manifest(files: dict[str, bytes]) -> bytes:
    ET.register_namespace("fmi-ls", _NAMESPACE)
    root = ET.Element(
        "fmiReferences",
        {
            f"{{{_NAMESPACE}}}fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
            f"{{{_NAMESPACE}}}fmi-ls-version": "1.0.0-beta.1",
            f"{{{_NAMESPACE}}}fmi-ls-description": "Layered Standard providing information on related files included "
            "in an FMU.",
        },
    )
    for name, kind, role, text in (
        ("experiments.xml", "application/x-ma-hs-experiments", "experiment/smoke-test", "Reference experiment"),
        ("input.csv", "text/csv", "other", "Stimulus of the reference experiment"),
        ("result.csv", "text/csv", "result", "Recorded outputs of the reference experiment"),
    ):
        if name in files:
            digest = hashlib.sha256(files[name]).hexdigest()
            related = {"type": kind, "source": name, "role": role, "description": text}
            ET.SubElement(root, "Related", {**related, "checksum": digest, "checksumType": "SHA-256"})
    return xml_file(root)
