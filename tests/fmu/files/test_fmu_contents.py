"""Further contents of an FMU: documentation, icon, terminals, reference experiment, licence."""

from __future__ import annotations

import hashlib
import struct
import xml.etree.ElementTree as ET
import zipfile
import zlib
from html.parser import HTMLParser
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.util import read_csv
from fmu_master import BLOCKS, loop, single
from lxml import etree

import hystfmu as hy
from hystfmu.fmu import export_fmu
from hystfmu.graph import Graph, Node
from hystfmu.model import Model

REF = "extra/org.fmi-standard.fmi-ls-ref"
SCHEMAS = Path(fmpy.__file__).parent / "schema" / "fmi3"
GRAPHS = {"loop": loop, **{n: lambda n=n: single(n) for n in ("prandtl_ishlinskii", "reference", "scaling", "mlp")}}


def _entries(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {e.filename: archive.read(e) for e in archive.infolist()}


@pytest.fixture
def model() -> Model:
    graph = single("prandtl_ishlinskii")
    history = {"data": "bench <1>.csv", "span_u": [-2.0, 3.0], "rows": 500}
    return Model("prandtl_ishlinskii", graph, 2e-4, "a & b", {"rms_percent": 0.25, "parameters": 11}, history)


# ---- the reference experiment ---------------------------------------------------------------------------------------
@pytest.mark.parametrize("name", list(GRAPHS))
def test_an_importer_repeats_the_reference_experiment(tmp_path: Path, fmi: int, name: str) -> None:
    """fmpy repeats the experiment of the archive and reproduces every recorded digit."""
    path = export_fmu(GRAPHS[name](), tmp_path / "x.fmu", fmi)  # type: ignore[arg-type]
    entries = _entries(path)
    for csv in ("input.csv", "result.csv"):
        if f"{REF}/{csv}" in entries:
            (tmp_path / csv).write_bytes(entries[f"{REF}/{csv}"])
    experiment = ET.fromstring(entries[f"{REF}/experiments.xml"]).find("Experiment")
    assert experiment is not None
    run = experiment.find("TransientSimulation")
    assert run is not None
    has_input = experiment.find("Stimuli") is not None
    want = read_csv(tmp_path / "result.csv")
    got = fmpy.simulate_fmu(
        str(path),
        start_time=float(run.get("startTime", "")),
        stop_time=float(run.get("stopTime", "")),
        output_interval=float(run.get("stepSize", "")),
        input=read_csv(tmp_path / "input.csv") if has_input else None,
        fmi_type="CoSimulation",
        record_events=False,
    )
    assert len(got) == len(want) == 201
    for column in want.dtype.names or ():
        if column == "time":
            np.testing.assert_allclose(got["time"], want["time"], rtol=0, atol=1e-9)
        elif name in ("loop", "reference"):  # a source depends on the time, which fmpy accumulates differently
            np.testing.assert_allclose(got[column], want[column], rtol=1e-9, atol=1e-12)
        else:
            np.testing.assert_array_equal(got[column], want[column])


def test_reference_experiment_spans_the_data(tmp_path: Path, model: Model, fmi: int) -> None:
    entries = _entries(export_fmu(model, tmp_path / "x.fmu", fmi))  # type: ignore[arg-type]
    rows = np.loadtxt(entries[f"{REF}/input.csv"].decode().splitlines(), delimiter=",", skiprows=1)
    assert (rows[:, 1].min(), rows[:, 1].max()) == (-2.0, 3.0)
    np.testing.assert_allclose(np.diff(rows[:, 0]), 2e-4, rtol=1e-9)


def test_manifest_names_every_file_with_its_checksum(tmp_path: Path, fmi: int) -> None:
    """fmi-ls-ref 1.0.0-beta.1: attributes in the namespace, one <Related> for every file but the manifest."""
    entries = _entries(export_fmu(single("pid"), tmp_path / "x.fmu", fmi))  # type: ignore[arg-type]
    root = ET.fromstring(entries[f"{REF}/fmi-ls-manifest.xml"])
    assert root.tag == "fmiReferences"
    assert root.get("{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-name") == "org.fmi-standard.fmi-ls-ref"
    files = {n.rsplit("/", 1)[1] for n in entries if n.startswith(REF)} - {"fmi-ls-manifest.xml"}
    assert {r.get("source") for r in root} == files
    for related in root:
        content = entries[f"{REF}/{related.get('source')}"]
        assert related.get("checksum") == hashlib.sha256(content).hexdigest()


# ---- pictures -------------------------------------------------------------------------------------------------------
def _pixels(png: bytes) -> np.ndarray:
    """Decode a PNG (RGB, no filter) independently of the writer and verify every checksum."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    at, data, size = 8, b"", (0, 0)
    while at < len(png):
        n, kind = struct.unpack(">I4s", png[at : at + 8])
        content = png[at + 8 : at + 8 + n]
        assert zlib.crc32(kind + content) == struct.unpack(">I", png[at + 8 + n : at + 12 + n])[0]
        if kind == b"IHDR":
            size = struct.unpack(">II", content[:8])
            assert content[8:] == bytes([8, 2, 0, 0, 0])
        data += content if kind == b"IDAT" else b""
        at += 12 + n
    assert kind == b"IEND"
    lines = np.frombuffer(zlib.decompress(data), np.uint8).reshape(size[1], 1 + 3 * size[0])
    assert not lines[:, 0].any()
    return lines[:, 1:].reshape(size[1], size[0], 3)


@pytest.mark.parametrize("name", BLOCKS)
def test_icon_shows_the_loop(tmp_path: Path, fmi: int, name: str) -> None:
    entries = _entries(export_fmu(single(name), tmp_path / "x.fmu", fmi))  # type: ignore[arg-type]
    picture = _pixels(entries["model.png" if fmi == 2 else "terminalsAndIcons/icon.png"])
    assert picture.shape == (128, 128, 3), "the standard requires at least 100 x 100 pixels"
    ink = np.argwhere(picture[:, :, 0] < 100)
    assert 150 < len(ink) < 8000
    assert ink.min() > 10
    assert ink.max() < 118
    if fmi == 3:
        assert ET.fromstring(entries["terminalsAndIcons/icon.svg"]).tag.endswith("svg")


# ---- terminals ------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("name", BLOCKS)
def test_terminals_follow_the_schema(tmp_path: Path, name: str) -> None:
    graph = single(name)
    entries = _entries(export_fmu(graph, tmp_path / "x.fmu", 3))
    root = etree.fromstring(entries["terminalsAndIcons/terminalsAndIcons.xml"])
    etree.XMLSchema(file=str(SCHEMAS / "fmi3TerminalsAndIcons.xsd")).assertValid(root)
    members = {m.get("variableName") for m in root.iter("TerminalMemberVariable")}
    assert members == {p.name for p in graph.ports if p.kind in ("input", "output")}


# ---- documentation --------------------------------------------------------------------------------------------------
class _Page(HTMLParser):
    """Collect the text and require that every tag is closed."""

    def __init__(self, content: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.words: list[str] = []
        self.links: list[str] = []
        self.feed(content)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.links += [str(v) for k, v in attrs if k in ("href", "src")]
        if tag not in ("meta", "br"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.links += [str(v) for k, v in attrs if k in ("href", "src")]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)


@pytest.mark.parametrize("name", BLOCKS)
def test_documentation_describes_the_content(tmp_path: Path, fmi: int, name: str) -> None:
    graph = single(name)
    entries = _entries(export_fmu(graph, tmp_path / "x.fmu", fmi))  # type: ignore[arg-type]
    page = _Page(entries["documentation/index.html"].decode())
    text = "".join(page.words)
    block = graph.nodes[0].block
    for part in (block.equation, block.source, *(p.text for p in graph.ports), *(p.var.interval for p in graph.ports)):
        assert part in text
    assert page.links == ["licenses/license.txt"], "self-contained"
    assert "<svg" in entries["documentation/index.html"].decode()
    assert entries["documentation/licenses/license.txt"].startswith(b"BSD 3-Clause License")


@pytest.mark.usefixtures("fmutool_or_not")
def test_documentation_reports_the_fit(tmp_path: Path, model: Model, fmi: int) -> None:
    path = export_fmu(model, tmp_path / "x.fmu", fmi)  # type: ignore[arg-type]
    text = "".join(_Page(_entries(path)["documentation/index.html"].decode()).words)
    for part in ("a & b", "bench <1>.csv", "RMS error, % of the span of y", "0.25", "-2 3", "500"):
        assert part in text
    assert hy.validate(path) == []


def test_names_of_files_follow_the_standard(tmp_path: Path) -> None:
    two = _entries(export_fmu(single("pid"), tmp_path / "2.fmu", 2, "p"))
    three = _entries(export_fmu(single("pid"), tmp_path / "3.fmu", 3, "p"))
    assert not [n for n in two if n.startswith("terminalsAndIcons")], "FMI 2.0 has no such directory"
    assert "model.png" not in three
    assert {n.split("/")[0] for n in three} == {
        "modelDescription.xml",
        "binaries",
        "resources",
        "terminalsAndIcons",
        "documentation",
        "extra",
    }


def test_a_graph_has_a_default_experiment(tmp_path: Path, fmi: int) -> None:
    graph = Graph.single(Node("d", "delay", {"n": 3}))
    root = ET.fromstring(_entries(export_fmu(graph, tmp_path / "x.fmu", fmi))["modelDescription.xml"])  # type: ignore[arg-type]
    assert root.find("DefaultExperiment").get("stepSize") == "0.001"  # type: ignore[union-attr]
