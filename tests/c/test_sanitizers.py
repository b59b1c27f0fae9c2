"""The C core under AddressSanitizer and UBSan on good, extreme and damaged block files; what its objects contain."""

import subprocess
from pathlib import Path

import compiled
import numpy as np
import pytest
from excitation import configurations, node

from hystfmu.base.errors import InputError
from hystfmu.core.library import BlockType, Var, block_types
from hystfmu.graph import Graph, Input, Node, Output

HERE = Path(__file__).parent
SOURCES = sorted(compiled.CORE.rglob("*.c"))


# ---- what the objects contain ---------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def objects() -> list[Path]:
    return compiled.objects(SOURCES, [*compiled.STRICT, "-O2", "-fno-pic"])


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


def test_core_needs_no_libm_and_allocates_nothing(objects: list[Path]) -> None:
    own = {name for _, letter, name in symbols(objects) if letter in "TR"}
    outside = {(o, name) for o, letter, name in symbols(objects) if letter == "U" and name not in own}
    assert {(o, n) for o, n in outside if n not in (SENTENCES if o == "message" else MEMORY)} == set()


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


def test_extreme_legal_values(driver: Path, tmp_path: Path) -> None:
    """No legal value may crash, hang or overflow an integer: the bounds of the table protect the block."""
    drive(driver, 0, [f for block in block_types().values() for f in extreme_files(block, tmp_path)])
