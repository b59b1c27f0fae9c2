"""The C core under AddressSanitizer and UBSan on good, extreme and damaged block files; what its objects contain."""

import random
import subprocess
from pathlib import Path
from typing import Any

import compiled
import fmpy
import numpy as np
import pytest
import tomli_w
from drawn_unit import LETTERS, Variable, drawn_fmu, library, value
from excitation import configurations, node

from hystfmu import Graph, Input, InputError, Node, Output
from hystfmu.core.library import BlockType, Var, block_types
from hystfmu.scenario import Cases
from hystfmu.scenario.ssp.write import write_loop

HERE = Path(__file__).parent
SOURCES = sorted(compiled.CORE.rglob("*.c"))


# ---- what the objects contain ---------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def objects() -> list[Path]:
    return compiled.objects(SOURCES, [*compiled.STRICT, "-O1", "-fno-pic"])


def symbols(objects: list[Path]) -> list[tuple[str, str, str]]:
    """(object, type letter, name) of every symbol."""
    listing = subprocess.run(["nm", "-A", *map(str, objects)], capture_output=True, text=True, check=True).stdout
    found = []
    for line in listing.splitlines():
        file, symbol = line.rsplit(":", 1)
        *_, letter, name = symbol.split()
        found.append((Path(file).stem, letter, name))
    return found


# what C compilers may call on their own, and the two string functions that the reader of files uses
MEMORY = {"memcpy", "memmove", "memset", "memcmp", "memchr", "strlen", "strcmp"}
SENTENCES = {"snprintf", "strchr", *MEMORY}


@pytest.mark.turn("compiled C", name="objects")
def test_core_needs_no_libm_and_allocates_nothing(objects: list[Path]) -> None:
    own = {name for _, letter, name in symbols(objects) if letter in "TR"}
    outside = {(o, name) for o, letter, name in symbols(objects) if letter == "U" and name not in own}
    assert {(o, n) for o, n in outside if n not in (SENTENCES if o == "message" else MEMORY)} == set()


@pytest.mark.turn("compiled C", name="objects")
def test_core_has_no_variable_of_its_own(objects: list[Path]) -> None:
    assert [(o, name) for o, letter, name in symbols(objects) if letter in "bBdDC"] == []


# ---- sanitizers -----------------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def driver(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled.sanitized(tmp_path_factory.mktemp("sanitized") / "drive_core", [*SOURCES, HERE / "drive_core.c"])


def drive(driver: Path, copies: int, files: list[Path]) -> None:
    command = [str(driver), str(copies), *map(str, files)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=1200)
    assert done.returncode == 0, f"exit {done.returncode}: " + done.stderr[-3000:]


def loop() -> Graph:
    """A closed loop: wires, several nodes, an input that feeds two blocks."""
    nodes = [
        Node("plant", "transfer_function", {"na": 2, "nb": 0}),
        Node("pid", "pid", {}, {"Ki": 2.0, "u_max": 3.0}),
        Node("play", "prandtl_ishlinskii", {}, {"r": np.linspace(0.1, 1, 10)}),
    ]
    wires = [("plant.y", "pid.y"), ("pid.u", "play.u"), ("play.y", "plant.u")]
    return Graph(nodes, wires, [Input("r", ("pid.y_d", "pid.u_ff"))], [Output("y", "plant.y"), Output("u", "pid.u")])


def implicit() -> Graph:
    """A bank of plays and a network inside an implicit inverse."""
    nodes = [
        Node("inverse", "implicit_inverse"),
        Node("bank", "play_bank", {"n": 2}, {"r": [0.0, 0.3]}),
        Node("net", "mlp", {"n_in": 2, "n_hidden": 3}),
    ]
    wires = [("inverse.u", "bank.u"), ("bank.z", "net.u"), ("net.y", "inverse.h")]
    return Graph(nodes, wires, [Input("y", ("inverse.y",))], [Output("u", "inverse.u")])


@pytest.mark.stress
@pytest.mark.parametrize("copies", [30, pytest.param(500, marks=pytest.mark.stress)])
def test_every_block_and_damaged_copies_of_its_file(driver: Path, tmp_path: Path, copies: int) -> None:
    files = []
    for name, block in block_types().items():
        for i, values in enumerate(configurations(block)):
            if made := node(block, values):
                files.append(tmp_path / f"{name}-{i}.bin")
                files[-1].write_bytes(Graph.single(made).to_bytes())
    for graph in (loop, implicit):
        files.append(tmp_path / f"{graph.__name__}.bin")
        files[-1].write_bytes(graph().to_bytes())
    drive(driver, copies, files)


def extremes(v: Var) -> list[float]:
    """The ends of the range of a variable, and the largest and smallest numbers."""
    reals = [v.lo, v.hi, 1e300, -1e300, 5e-324, -5e-324, 1e12, -1e12, 0.0] if v.type == "real" else [v.lo, v.hi]
    return [x for x in dict.fromkeys(reals) if np.isfinite(x) and v.lo <= x <= v.hi]


def extreme_files(block: BlockType, folder: Path) -> list[Path]:
    files: list[Path] = []
    for i, values in enumerate(configurations(block)):
        for v in block.parameters:
            for x in extremes(v):
                try:
                    content = Graph.single(Node("b", block.name, {}, {**values, v.name: x})).to_bytes()
                except InputError:
                    continue
                files.append(folder / f"{block.name}-{i}-{v.name}={x:g}.bin")
                files[-1].write_bytes(content)
    return files


@pytest.mark.stress
def test_extreme_legal_values(driver: Path, tmp_path: Path) -> None:
    """No legal value may crash, hang or overflow an integer: the bounds of the table protect the block."""
    drive(driver, 0, [f for block in block_types().values() for f in extreme_files(block, tmp_path)])


# ---- A container of foreign units under AddressSanitizer and UBSan: random calls, and damaged files of its system
CONTAINER = [
    *sorted(compiled.CORE.rglob("*.c")),
    *sorted((compiled.FMU_BUILD / "master").glob("*.c")),
    *sorted((compiled.FMU_BUILD / "container").glob("*.c")),
    *(f for f in sorted((compiled.FMI / "files").glob("*.c")) if f.name != "open_file.c"),  # the driver has its own
]


def every_type(fmi: int, rng: random.Random) -> tuple[list[Variable], dict[str, Any]]:
    """An FMU with a parameter, an input and an output of each type, and what a scenario sets."""
    made, given = [], {}
    for kind in LETTERS[fmi]:
        made.append(Variable(f"p{kind}", kind, "parameter", (value(rng, kind, exact=False),)))
        given[f"p{kind}"] = value(rng, kind)
        made += [Variable(f"u{kind}", kind, "input", (value(rng, kind, exact=False),))]
        made += [Variable(f"v{kind}", kind, "input", (value(rng, kind, exact=False),))]
        made += [Variable(f"y{kind}", kind, "output", (value(rng, kind, exact=False),))]
    if fmi == 3:
        made.insert(0, Variable("n", "UInt64", "structuralParameter", (2,)))
        made += [Variable("pn", "Float32", "parameter", (0.5, 0.25), 0), Variable("un", "Int8", "input", (1, 2), 0)]
        given |= {"n": 3, "pn": [0.1, 0.2, 0.3]}
    return made, given


@pytest.fixture
def box(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An unpacked container of two units with variables of all types, whose binaries are sanitized as well."""
    monkeypatch.setenv("HYSTFMU_CACHE", str(tmp_path / "cache"))
    rng, folder = random.Random(1), tmp_path / "drawn"
    folder.mkdir()
    reference = {"shape": "sine", "amplitude": 3.0, "frequency": 60.0}
    units: dict[str, Any] = {"reference": {"block": "reference", "values": reference}}
    connections = {}
    for fmi in (2, 3):
        variables, given = every_type(fmi, rng)
        drawn_fmu(folder / f"x{fmi}.fmu", fmi, variables)
        units[f"x{fmi}"] = {"fmu": f"x{fmi}.fmu", "set": given}
        for kind in LETTERS[fmi]:
            if kind not in ("String", "Enumeration") and not kind.startswith("U"):
                connections[f"x{fmi}.u{kind}"] = "reference.r"
    connections |= {"x3.un_2": "reference.r", "x3.uUInt16": "x3.yUInt8", "x3.vBoolean": "x2.yBoolean"}
    data = {
        "name": "box", "step": 1e-3, "stop": 1.0, "order": list(units), "units": units, "connections": connections,
        "metrics": {"p": {"kind": "final", "signal": "x2.yReal"}},
    }  # fmt: skip
    (folder / "scenario.toml").write_text(tomli_w.dumps(data))
    fmu = write_loop(Cases(folder).cases[0], tmp_path / "box.fmu", 2)
    made = Path(fmpy.extract(str(fmu), str(tmp_path / "box")))
    for fmi in (2, 3):
        (unit,) = (made / "resources" / "units" / f"x{fmi}").rglob("drawn.*")
        unit.write_bytes(library(fmi, *compiled.SANITIZE).read_bytes())
    return made


@pytest.mark.stress
@pytest.mark.parametrize("calls", [20_000, pytest.param(1_000_000, marks=pytest.mark.stress)])
def test_random_calls_and_damaged_files(box: Path, tmp_path: Path, calls: int) -> None:
    # cc also compiles the units that the program loads: a process can have the runtime of one compiler only
    sources = [*CONTAINER, HERE / "drive_container.c"]
    program = compiled.sanitized(tmp_path / "drive", sources, "-ldl", compilers=["cc"])
    description = fmpy.read_model_description(str(box), validate=False)
    outputs, resources = len(description.modelVariables), box / "resources"
    words = [resources.as_uri(), description.guid, str(resources / "system.txt"), str(outputs), str(calls), "1"]
    done = subprocess.run([str(program), *words], capture_output=True, text=True, timeout=3000)
    assert done.returncode == 0, f"exit {done.returncode}: {done.stderr[-3000:]}"
    instances, steps = (int(word) for word in done.stdout.split() if word.isdigit())
    assert instances > calls // 1000
    assert steps > calls // 10
