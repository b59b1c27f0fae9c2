"""Contents of an FMU: names, texts, documentation, icon, terminals, reference experiment, licence."""

import csv
import hashlib
import re
import struct
import xml.etree.ElementTree as ET
import zipfile
import zlib
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, Literal

import fmpy
import numpy as np
import pytest
from fmpy.util import read_csv
from fmu_master import BLOCKS, loop, single
from invoked import invoked
from lxml import etree

import hystfmu as hy
from hystfmu.fmu import export_fmu
from hystfmu.graph import Graph, Input, Node, Output
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
    for file in ("input.csv", "result.csv"):
        if f"{REF}/{file}" in entries:
            (tmp_path / file).write_bytes(entries[f"{REF}/{file}"])
    experiment = ET.fromstring(entries[f"{REF}/experiments.xml"]).find("Experiment")
    assert experiment is not None
    run = experiment.find("TransientSimulation")
    assert run is not None
    has_input = experiment.find("Stimuli") is not None
    want = read_csv(tmp_path / "result.csv")
    got = fmpy.simulate_fmu(
        str(path), start_time=float(run.get("startTime", "")), stop_time=float(run.get("stopTime", "")),
        output_interval=float(run.get("stepSize", "")), input=read_csv(tmp_path / "input.csv") if has_input else None,
        fmi_type="CoSimulation", record_events=False,
    )  # fmt: skip
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


def test_a_name_with_a_comma_is_one_cell(tmp_path: Path, fmi: int) -> None:
    name = 'u, "a"'
    graph = Graph([Node("plays", "backlash_sum")], (), [Input(name, ("plays.u",))], [Output("y", "plays.y")])
    entries = _entries(export_fmu(graph, tmp_path / "x.fmu", fmi))  # type: ignore[arg-type]
    head, first = list(csv.reader(entries[f"{REF}/input.csv"].decode().splitlines()))[:2]
    assert (head, len(first)) == (["time", name], 2)


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


@pytest.mark.some(8)
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
@pytest.mark.some(6)
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


@pytest.mark.some(8)
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


def test_documentation_reports_the_fit(tmp_path: Path, model: Model, fmi: int) -> None:
    path = export_fmu(model, tmp_path / "x.fmu", fmi)  # type: ignore[arg-type]
    text = "".join(_Page(_entries(path)["documentation/index.html"].decode()).words)
    for part in ("a & b", "bench <1>.csv", "RMS error, % of the span of y", "0.25", "-2 3", "500"):
        assert part in text


def test_names_of_files_follow_the_standard(tmp_path: Path) -> None:
    two = _entries(export_fmu(single("pid"), tmp_path / "2.fmu", 2, "p"))
    three = _entries(export_fmu(single("pid"), tmp_path / "3.fmu", 3, "p"))
    assert not [n for n in two if n.startswith("terminalsAndIcons")], "FMI 2.0 has no such directory"
    assert "model.png" not in three
    assert {n.split("/")[0] for n in three} == {
        "modelDescription.xml", "binaries", "resources", "terminalsAndIcons", "documentation", "extra",
    }  # fmt: skip


def test_a_graph_has_a_default_experiment(tmp_path: Path, fmi: int) -> None:
    graph = Graph.single(Node("d", "delay", {"n": 3}))
    root = ET.fromstring(_entries(export_fmu(graph, tmp_path / "x.fmu", fmi))["modelDescription.xml"])  # type: ignore[arg-type]
    assert root.find("DefaultExperiment").get("stepSize") == "0.001"  # type: ignore[union-attr]


# ---- names of two devices --------------------------------------------------------------------------------------------
def hystfmu(*words: object) -> str:
    return invoked([str(w) for w in words]).output


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Records of two stacks with German headings, and a model of the same kind of each."""
    there = tmp_path_factory.mktemp("records")
    data = hy.synthetic.piezo(60, 1000.0)
    for name, scale in (("Mess 1", 1.0), ("Mess 2", 1.5)):
        rows = np.column_stack([data.t, scale * data.u, scale * data.y])
        np.savetxt(there / f"{name}.csv", rows, delimiter=",", header="Zeit [s],Spannung [V],Weg [um]", comments="")
        out = there / f"{name}.model.toml"
        hystfmu("fit", there / f"{name}.csv", "--model", "prandtl_ishlinskii", "--set", "N=8", "-o", out)
    return there


def described(path: Path) -> tuple[Any, str]:
    """The description of an FMU, and the title of its page."""
    with zipfile.ZipFile(path) as archive:
        (title,) = re.findall("<title>(.*)</title>", archive.read("documentation/index.html").decode())
    return fmpy.read_model_description(str(path)), title


@pytest.mark.turn("good FMUs")
@pytest.mark.some(1)
@pytest.mark.parametrize("fmi", [2, 3])
def test_two_devices(folder: Path, tmp_path: Path, fmi: int) -> None:
    made = []
    for name in ("Mess 1", "Mess 2"):
        out = tmp_path / f"{name}.fmu"
        hystfmu("export", folder / f"{name}.model.toml", "--fmi", fmi, "--source", "-o", out)
        again = hy.Model.load(folder / f"{name}.model.toml").export(tmp_path / "again.fmu", fmi, name, source=True)  # type: ignore[arg-type]
        assert again.read_bytes() == out.read_bytes()
        made.append(described(out))
    (one, title), (two, other) = made
    assert (one.modelName, title) == ("Mess 1", "Mess 1")
    assert (two.modelName, other) == ("Mess 2", "Mess 2")
    for found, name, high in ((one, "Mess 1", 100), (two, "Mess 2", 150)):
        assert found.coSimulation.modelIdentifier == found.modelExchange.modelIdentifier == name.replace(" ", "_")
        model = hy.Model.load(folder / f"{name}.model.toml")
        assert found.description.startswith(f"{model.text}; fitted to the record {name}: ")
        assert f"input 0 to {high} V, output in um, RMS error {model.fit['rms_percent']:.2g} %" in found.description
        assert model.provenance["sha256"][:8] in found.description
        ports = {v.name: v.description for v in found.modelVariables}
        assert (ports["u"], ports["y"]) == ("Spannung, in V", "Weg, in um")


def test_a_model_in_memory_is_named_after_its_record(folder: Path, tmp_path: Path) -> None:
    names = set()
    for record in ("Mess 1", "Mess 2"):
        model = hy.Model.load(folder / f"{record}.model.toml")
        forward, _ = described(model.export(tmp_path / "m.fmu"))
        back, _ = described(model.inverse().export(tmp_path / "i.fmu"))
        assert forward.modelName == f"{record} prandtl_ishlinskii"
        assert back.modelName == f"{record} prandtl_ishlinskii_inverse"
        assert f"fitted to the record {record}: " in back.description
        texts = {v.name: v.description for v in back.modelVariables}
        assert texts["y"] == "input for the wanted output: Spannung, in V"
        names |= {forward.description, back.description}
    assert len(names) == 4


def test_what_no_record_names(tmp_path: Path) -> None:
    t = np.arange(400) * 1e-3
    u = 50 * (1 - np.cos(20 * t)) * np.exp(-t)
    y = 0.3 * u + 0.1 * np.maximum.accumulate(u)
    model = hy.fit(hy.Dataset(t, u, y, name="bench", unit_y="um"), "prandtl_ishlinskii", N=4)
    ports = {v.name: v.description for v in described(model.export(tmp_path / "m.fmu"))[0].modelVariables}
    assert (ports["u"], ports["y"]) == ("input of the record bench", "output of the record bench, in um")


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize(
    ("name", "identifier"), [("a b", "a_b"), ("1a", "_1a"), ("Größe 1", "Gr__e_1"), ("a" * 300, "a" * 60)]
)
def test_any_name_has_an_identifier(tmp_path: Path, fmi: Literal[2, 3], name: str, identifier: str) -> None:
    found, title = described(hy.Model("sum", hy.blocks.Sum().graph).export(tmp_path / "x.fmu", fmi, name))
    assert (found.modelName, title) == (name, name)
    assert found.coSimulation.modelIdentifier == identifier
    with zipfile.ZipFile(tmp_path / "x.fmu") as archive:
        assert [n for n in archive.namelist() if re.fullmatch(rf"binaries/[^/]*/{identifier}\..*", n)]
