"""A loop with foreign FMUs as one FMU: the bits of `hystfmu run`; errors name the unit."""

import contextlib
import ctypes as C
import math
import re
import tomllib
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
import tomli_w
from bad_fmu import LOOP, bad_fmu
from click.testing import CliRunner
from drawn_unit import LETTERS, Variable, bounds, drawn_fmu
from engines import boxed, ready
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmu_slave import Slave
from heap import leaves_nothing
from invoked import invoked

from hystfmu.cli import main
from hystfmu.fmu.write.export import export_fmu
from hystfmu.graph import Graph, Node
from hystfmu.scenario import simulate

PLAYS = Node("plays", "backlash_sum", {}, {"w0": 0.3, "r": [0.1, 0.2, 0.3], "w": [0.3, 0.2, 0.1]})


@pytest.fixture
def foreign(loop: Any, write: Any) -> Any:
    """Writes the loop with its PID as a foreign FMU, and the plays as another before the plant."""

    def make(fmi: int = 2, coupling: str = "gauss_seidel", **changes: Any) -> Path:
        loop["units"]["reference"]["values"]["shape"] = "sine"
        folder = Path(write(loop))
        pid = Node("pid", "pid", {}, loop["units"]["pid"]["values"])
        export_fmu(Graph.single(pid), folder / "pid.fmu", fmi)  # type: ignore[arg-type]
        export_fmu(Graph.single(PLAYS), folder / "plays.fmu", fmi)  # type: ignore[arg-type]
        loop["units"]["pid"] = {"fmu": "pid.fmu", "inputs": {"u_ff": 0.125}, "set": {"Ki": 1500.0}}
        loop["units"]["plays"] = {"fmu": "plays.fmu"}
        loop["order"] = ["plays", "plant", "reference", "pid"]
        loop["connections"] |= {"plays.u": "pid.u", "plant.u": "plays.y"}
        loop["coupling"] = {"scheme": coupling, "events": "grid"}
        loop.update(changes)
        return Path(write(loop))

    return make


def written(folder: Path, out: Path) -> None:
    invoked(["ssp", str(folder), "-o", str(out)])


def unpacked(folder: Path, tmp_path: Path) -> tuple[Path, Path]:
    """Write the container of a scenario; return the folder of its files, and the file that describes the system."""
    written(folder, tmp_path / "box.fmu")
    box = Path(fmpy.extract(str(tmp_path / "box.fmu"), str(tmp_path / "a box %20 ü")))
    return box, box / "resources" / "system.txt"


@pytest.mark.some(1)
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("coupling", ["gauss_seidel", "jacobi"])
def test_the_container_has_the_bits_of_the_run(foreign: Any, tmp_path: Path, fmi: int, coupling: str) -> None:
    folder = foreign(fmi, coupling)
    written(folder, tmp_path / "box.fmu")
    system = ready(folder)
    ours = simulate(system, "native")
    got = boxed(tmp_path / "box.fmu", tmp_path / "box", 1e-4, system.n_steps)
    for end in system.columns:
        assert got[end].tobytes() == ours[end].tobytes(), end
    assert np.ptp(ours["plant.y"]) > 0.1


@pytest.mark.turn("containers")
def test_fine_units_and_several_steps_at_once(foreign: Any, loop: Any, tmp_path: Path) -> None:
    loop["units"]["plant"]["fine"] = True
    folder = foreign(ripple=4)
    written(folder, tmp_path / "box.fmu")
    system = ready(folder)
    ours = simulate(system, "native")["plant.y"][::12]
    got = boxed(tmp_path / "box.fmu", tmp_path / "box", 3e-4, len(ours) - 1)["plant.y"]
    assert got.tobytes() == ours.tobytes()


@pytest.mark.turn("containers")
@pytest.mark.some(1)
@pytest.mark.parametrize("version", [2, 3])
def test_a_reference_fmu_in_a_container(loop: Any, write: Any, measured: Path, tmp_path: Path, version: int) -> None:
    """Feedthrough between controller and plant: foreign code, and the bits of `hystfmu run`."""
    original = measured / "reference_fmus" / f"fmi{version}" / "Feedthrough.fmu"
    if not original.exists():
        pytest.skip(f"no {original}")
    loop["units"]["wire"] = {"fmu": "Feedthrough.fmu"}
    loop["order"] = ["wire", "plant", "reference", "pid"]
    ends = {"wire.Float64_continuous_input": "pid.u", "plant.u": "wire.Float64_continuous_output"}
    loop["connections"] |= ends
    loop["coupling"] = {"events": "grid"}
    folder = Path(write(loop))
    (folder / "Feedthrough.fmu").write_bytes(original.read_bytes())
    written(folder, tmp_path / "box.fmu")
    system = ready(folder)
    ours = simulate(system, "native")
    got = boxed(tmp_path / "box.fmu", tmp_path / "box", 1e-4, system.n_steps)
    assert got["plant.y"].tobytes() == ours["plant.y"].tobytes()
    assert set(got) == set(ours.columns)


VARIABLES = [
    Variable("text", "String", "parameter", ("start",)),
    Variable("whole", "Integer", "parameter", (3,)),
    Variable("truth", "Boolean", "parameter", (False,)),
    Variable("n", "Integer", "input", (0,)),
    Variable("on", "Boolean", "input", (False,)),
    Variable("k", "Integer", "output", (0,)),
    Variable("b", "Boolean", "output", (False,)),
]


def typed(write: Any, fmi: int = 2, **changes: Any) -> Path:
    """A loop with a foreign unit whose variables are no real numbers."""
    unit = {"fmu": "x.fmu", "set": {"text": "a b", "whole": 7, "truth": True}, "inputs": {"on": 1.0}}
    data = {
        "name": "typed",
        "step": 1e-3,
        "stop": 0.01,
        "order": ["reference", "x"],
        "units": {"reference": {"block": "reference", "values": {"amplitude": 3.0, "frequency": 60.0}}, "x": unit},
        "connections": {"x.n": "reference.r"},
        "record": ["x.k", "x.b"],
        "metrics": {"p": {"kind": "final", "signal": "x.k"}},
    }
    folder = Path(write(data | changes))
    words = {"Integer": "Int32"} if fmi == 3 else {}
    drawn_fmu(folder / "x.fmu", fmi, [replace(v, type=words.get(v.type, v.type)) for v in VARIABLES])
    return folder


@pytest.mark.turn("containers")
@pytest.mark.some(1)
@pytest.mark.parametrize("fmi", [2, 3])
def test_texts_whole_numbers_and_booleans(write: Any, tmp_path: Path, fmi: int) -> None:
    folder = typed(write, fmi)
    written(folder, tmp_path / "box.fmu")
    system = ready(folder)
    ours = simulate(system, "native")
    got = boxed(tmp_path / "box.fmu", tmp_path / "box", 1e-3, system.n_steps)
    assert {end: got[end].tobytes() for end in got} == {end: ours[end].tobytes() for end in ours.columns}
    description = fmpy.read_model_description(str(tmp_path / "box.fmu"))
    kinds = {v.name: (v.type, v.variability) for v in description.modelVariables}
    assert (kinds["x_k"], kinds["x_b"]) == (("Integer", "discrete"), ("Boolean", "discrete"))
    assert kinds["reference_r"] == ("Real", "continuous")


def test_a_number_that_does_not_fit_names_its_input(write: Any, tmp_path: Path) -> None:
    reference = {"amplitude": 3e9, "frequency": 60.0}
    folder = typed(write)
    data = tomllib.loads((folder / "scenario.toml").read_text())
    data["units"]["reference"]["values"] = reference
    folder = Path(write(data))
    line = tried(unpacked(folder, tmp_path)[0], 5)[0]
    assert re.fullmatch(r"unit 'x' refuses the step from t = 0\.\d+ s: n: -?\S+ does not fit the type Integer", line)
    data["units"]["x"]["inputs"]["on"], data["units"]["x"]["set"]["whole"] = 1.0, 2**31
    result = invoked(["ssp", str(write(data)), "-o", str(tmp_path / "other.fmu")], status=2)
    assert "units.x: whole: 2.14748e+09 does not fit the type Integer" in result.output


def test_outputs_of_one_name_are_refused(write: Any, tmp_path: Path) -> None:
    folder = typed(write)
    data = tomllib.loads((folder / "scenario.toml").read_text())
    variables = [*VARIABLES, Variable("k_k", "Integer", "output", (0,))]
    drawn_fmu(folder / "x.fmu", 2, variables)
    data["units"]["x_k"], data["order"] = data["units"]["x"], ["reference", "x", "x_k"]
    data["connections"]["x_k.n"] = "reference.r"
    result = invoked(["ssp", str(write(data)), "-o", str(tmp_path / "box.fmu")], status=2)
    assert "x.k_k and x_k.k: both outputs would have the name x_k_k in a container" in result.output


def test_events_between_steps_are_refused(foreign: Any, loop: Any, tmp_path: Path) -> None:
    loop["units"]["reference"]["values"] |= {"shape": "triangle", "frequency": 33.0}
    folder = foreign()
    data = tomllib.loads((folder / "scenario.toml").read_text())
    data["units"]["reference"]["values"]["shape"] = "triangle"
    (folder / "scenario.toml").write_text(tomli_w.dumps(data))
    written(folder, tmp_path / "box.fmu")
    data["coupling"]["events"] = "located"
    (folder / "scenario.toml").write_text(tomli_w.dumps(data))
    result = invoked(["ssp", str(folder), "-o", str(tmp_path / "other.fmu")], status=2)
    assert "coupling.events must be 'grid': a container locates no events between steps" in result.output


def made(box: Path, said: list[str], **changes: str) -> FMU2Slave:
    """An instance of the container unpacked to `box`, or one without component; its messages go to `said`."""
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(lambda _c, _n, _s, _k, m: said.append(m.decode()))
    callbacks.allocateMemory, callbacks.freeMemory = defaultCallbacks.allocateMemory, defaultCallbacks.freeMemory
    told = fmpy.read_model_description(str(box), validate=False)
    names = {"guid": told.guid, "modelIdentifier": told.coSimulation.modelIdentifier, "instanceName": "box"}
    slave = FMU2Slave(unzipDirectory=str(box), **names | changes)
    with contextlib.suppress(Exception):  # fmpy raises a plain one
        slave.instantiate(callbacks=callbacks)
    return slave


def called(slave: FMU2Slave, name: str, *arguments: Any) -> int:
    """The status of a function of FMI 2.0; numbers that are no float are ints of C."""
    call = getattr(slave.dll, name)
    call.argtypes = None
    return int(call(C.c_void_p(slave.component), *(C.c_double(a) if isinstance(a, float) else a for a in arguments)))


def tried(folder: Path, n: int = 1, h: float = 0.0) -> list[str]:
    """What an instance logs when it is made and makes n steps, of h if it is given; nothing if all goes well."""
    said: list[str] = []
    slave = made(folder, said)
    if slave.component is None:
        return said
    h = h or float(fmpy.read_model_description(str(folder), validate=False).defaultExperiment.stepSize)
    with contextlib.suppress(FMICallException):
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        for k in range(n):
            slave.doStep(k * h, h)
    slave.freeInstance()
    return said


def test_errors_name_the_unit(foreign: Any, tmp_path: Path) -> None:
    box, system = unpacked(foreign(), tmp_path)
    next((box / "resources" / "units" / "plays" / "binaries").rglob("*.so")).write_bytes(b"no library")
    (line,) = tried(box)
    assert line.startswith("unit 'plays': its library cannot be loaded: ")
    system.write_text(system.read_text().replace("Gauss", "").replace("coupling 0", "coupling 7"))
    (line,) = tried(box)
    assert line.startswith("resources/system.txt is damaged near its byte")


def test_a_damaged_system_file_never_crashes(foreign: Any, tmp_path: Path) -> None:
    """Every tenth word cut away, doubled or replaced: a sentence, or a system that is whole."""
    box, file = unpacked(foreign(), tmp_path)
    words, refused = file.read_text().split(" "), 0
    for k in range(1, len(words), 10):
        for new in ([], ["-1"], ["99999999999"], [words[k], words[k]]):
            file.write_text(" ".join([*words[:k], *new, *words[k + 1 :]]))
            said = tried(box)
            assert len(said) <= 1, (k, new, said)
            refused += len(said)
    assert refused > 30


def test_what_a_container_cannot_step_is_refused(foreign: Any, loop: Any, tmp_path: Path) -> None:
    folder = foreign(coupling="iterative")
    result = invoked(["ssp", str(folder), "-o", str(tmp_path / "box.fmu")], status=2)
    assert "the coupling of a container must not be iterative" in result.output
    result = CliRunner().invoke(main, ["ssp", str(folder), "--fmi", "3", "-o", str(tmp_path / "box.fmu")])
    assert "a loop with foreign FMUs needs FMI 2.0" in result.output
    loop["coupling"] = {"scheme": "jacobi", "events": "grid"}
    loop["units"]["plant"]["hold"] = "first"
    (folder / "scenario.toml").write_text(tomli_w.dumps(loop))
    result = CliRunner().invoke(main, ["ssp", str(folder), "-o", str(tmp_path / "box.fmu")])
    assert "plant must have no hold, which a container does not support" in result.output
    assert not (tmp_path / "box.fmu").exists()


def test_the_archive_passes_the_checks_of_fmpy(foreign: Any, tmp_path: Path) -> None:
    from fmpy.validation import validate_fmu

    written(foreign(), tmp_path / "box.fmu")
    assert validate_fmu(str(tmp_path / "box.fmu")) == []
    with zipfile.ZipFile(tmp_path / "box.fmu") as archive:
        names = archive.namelist()
    assert "resources/units/pid/modelDescription.xml" in names
    assert sum(n.endswith(".so") for n in names) == 4  # of the container, of both foreign FMUs, one of all of ours


LIMITED = [  # line of the system file, place of a number in it, its least and largest value
    ("hystfmu-system ", 1, 2, 2),
    ("coupling ", 1, 0, 1),
    ("coupling ", 2, 1, 1000),
    ("units ", 1, 1, None),
    ("unit x ", 2, 2, 3),
    ("unit x ", 6, 1, 1_000_000),
    ("unit x ", 7, 1, 10_000),
    ("unit x ", 9, 0, None),
    ("parameters 3 ", 3, 0, 2**32 - 1),
    ("parameters 3 ", 4, 1, None),
    ("connected 1 ", 5, 0, 2**32 - 1),
    ("connected 1 ", 6, 1, 1),
    ("connected 1 ", 7, -1, 5),
    ("outputs 2 ", 5, 0, 2**32 - 1),
    ("outputs 2 ", 6, 1, 1),
]


def test_a_number_outside_its_limits_is_damage(write: Any, tmp_path: Path) -> None:
    box, file = unpacked(typed(write, 3), tmp_path)
    lines = file.read_text().split("\n")
    for line, place, least, most in LIMITED:
        (row,) = (k for k, text in enumerate(lines) if text.startswith(line))
        words = lines[row].split(" ")
        for value in [least - 1, *([] if most is None else [most + 1])]:
            changed = " ".join([*words[:place], str(value), *words[place + 1 :]])
            file.write_text("\n".join([*lines[:row], changed, *lines[row + 1 :]]))
            (said,) = tried(box)
            assert said.startswith("resources/system.txt is damaged near its byte "), (line, place, value)
    for line, place in (("coupling ", 3), ("coupling ", 4), ("unit x ", 8)):
        for bits in ("0000000000000000", "bff0000000000000", "7ff8000000000000", "7ff0000000000000"):
            changed = [" ".join([*w[:place], bits, *w[place + 1 :]]) if t.startswith(line) else t
                       for t, w in ((t, t.split(" ")) for t in lines)]  # fmt: skip
            file.write_text("\n".join(changed))
            (said,) = tried(box)
            assert said.startswith("resources/system.txt is damaged near its byte "), (line, place, bits)


def test_a_parameter_outside_its_type_is_damage(write: Any, tmp_path: Path) -> None:
    box, file = unpacked(typed(write, 3), tmp_path)
    head, reference, tail = re.split(r"i (\d+) 1 7\b", file.read_text())
    real = ["7ff8000000000000", "3FF0000000000000"], ["3ff000000000000", "3ff00000000000000", "3ff000000000000g", "1.0"]
    words = {"d": real, "f": real, "?": (["0", "1"], ["2", "-1", "01", "true"])}
    file.write_text(f"{head}x {reference} 1 7{tail}")  # no type at all
    assert "is damaged near its byte" in tried(box)[0]
    for letter, kind in ((of, k) for k, of in LETTERS[3].items() if of != "s"):
        low, high = bounds(kind)
        good, bad = words.get(letter, ([low, 0, high], [low - 1, high + 1, f"{high}x", "x", "1.0"]))
        for text in [*good, *bad]:
            file.write_text(f"{head}{letter} {reference} 1 {text}{tail}")
            (line,) = tried(box) or ("",)
            called = {"e": "q"}.get(letter, letter)
            other = f"unit 'x': refuses a parameter: reference {reference} is no variable of type {called}"
            of_type = "" if letter == "i" else other
            assert line == of_type if text in good else "is damaged near its byte" in line, (letter, text)


@pytest.mark.parametrize("text", ["%4G", "%G4", "%4", "%00", "%4a"])
def test_a_wrong_escape_in_a_name_is_damage(write: Any, tmp_path: Path, text: str) -> None:
    box, file = unpacked(typed(write), tmp_path)
    whole = file.read_text()
    assert whole.count("unit x ") == 1
    file.write_text(whole.replace("unit x ", f"unit {text} "))
    (said,) = tried(box)
    assert said.startswith("resources/system.txt is damaged near its byte ")
    file.write_text(whole.replace("unit x ", "unit x%4A "))
    assert tried(box) == []
    file.write_text(whole.replace("unit x ", "unit %44 "))
    assert tried(box) == []


def test_a_type_of_another_version_is_damage(write: Any, tmp_path: Path) -> None:
    box, file = unpacked(typed(write), tmp_path)
    whole = file.read_text()
    for letter in "fbBhHIqQe":
        file.write_text(re.sub(r"(connected 1 \d+ )i ", rf"\g<1>{letter} ", whole))
        assert file.read_text() != whole
        (said,) = tried(box)
        assert said.startswith("resources/system.txt is damaged near its byte "), letter


@pytest.mark.turn("containers")
@pytest.mark.some(1)
@pytest.mark.parametrize("fmi", [2, 3])
def test_halves_go_to_the_even_number(write: Any, tmp_path: Path, fmi: int) -> None:
    folder = typed(write, fmi)
    data = tomllib.loads((folder / "scenario.toml").read_text())
    steps = {"shape": "steps", "levels": [-2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 3.5], "T": 1e-3}
    data["units"]["reference"] = {"block": "reference", "dims": {"m": 7}, "values": steps}
    folder = Path(write(data))
    written(folder, tmp_path / "box.fmu")
    got = boxed(tmp_path / "box.fmu", tmp_path / "box", 1e-3, 6)
    whole = {**steps, "levels": [-2.0, -2.0, 0.0, 0.0, 2.0, 2.0, 4.0]}
    data["units"]["reference"]["values"] = whole
    rounded = simulate(ready(Path(write(data))), "native")
    assert got["x.k"].tobytes() == rounded["x.k"][:7].tobytes()


NUMBERS = {  # type of FMI 3.0 -> a value that it holds and its start value, the signal has -8 to 8
    **dict.fromkeys(("Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64"), (100, 1)),
    **{"Float32": (0.1, 2.5), "Float64": (0.1, 2.5), "Boolean": (True, False)},
}


@pytest.mark.turn("containers")
def test_every_type_of_fmi_3_has_the_bits_of_the_run(write: Any, tmp_path: Path) -> None:
    """Parameters, connected inputs and outputs; unsigned types read the square of the signal."""
    variables, given, ends = [], {}, {}
    for kind, (value, start) in NUMBERS.items():
        variables += [Variable(f"{c[0]}_{kind}", kind, c, (start,)) for c in ("parameter", "input", "output")]
        given[f"p_{kind}"] = value
        ends[f"x.i_{kind}"] = "square.y" if kind.startswith("U") else "reference.r"
    folder = Path(
        write(
            {
                "name": "typed",
                "step": 1e-3,
                "stop": 0.02,
                "order": ["reference", "square", "x"],
                "units": {
                    "reference": {"block": "reference", "values": {"amplitude": 8.0, "frequency": 60.0}},
                    "square": {"block": "product", "dims": {"n": 2, "m": 0}},
                    "x": {"fmu": "x.fmu", "set": given},
                },
                "connections": {"square.u_1": "reference.r", "square.u_2": "reference.r", **ends},
                "record": [f"x.o_{kind}" for kind in NUMBERS],
                "metrics": {"p": {"kind": "final", "signal": "x.o_Float64"}},
            }
        )
    )
    drawn_fmu(folder / "x.fmu", 3, variables)
    written(folder, tmp_path / "box.fmu")
    system = ready(folder)
    ours = simulate(system, "native")
    got = boxed(tmp_path / "box.fmu", tmp_path / "box", 1e-3, system.n_steps)
    for kind in NUMBERS:
        assert got[f"x.o_{kind}"].tobytes() == ours[f"x.o_{kind}"].tobytes(), kind
        assert np.ptp(got[f"x.o_{kind}"]) > 0, kind


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_end_reaches_the_units(write: Any, tmp_path: Path, fmi: int) -> None:
    folder = typed(write, fmi)
    words = {"Integer": "Int32"} if fmi == 3 else {}
    drawn_fmu(folder / "x.fmu", fmi, [replace(v, type=words.get(v.type, v.type)) for v in VARIABLES], last=-1)
    written(folder, tmp_path / "box.fmu")
    slave = Slave(tmp_path / "box.fmu", tmp_path / "box", silent=True)
    slave.start()
    for _ in range(2):
        assert slave.fmu.dll.fmi2Terminate(slave.fmu.component) == 3
    slave.fmu.freeInstance()


@pytest.mark.parametrize(("fmi", "why"), [(2, ""), (3, ": the FMU ends the simulation")])
def test_a_unit_that_ends_the_simulation_is_named(write: Any, tmp_path: Path, fmi: int, why: str) -> None:
    folder = typed(write, fmi)
    words = {"Integer": "Int32"} if fmi == 3 else {}
    drawn_fmu(folder / "x.fmu", fmi, [replace(v, type=words.get(v.type, v.type)) for v in VARIABLES], last=2)
    box, line = unpacked(folder, tmp_path)[0], f"unit 'x' refuses the step from t = 0.001 s{why}"
    assert tried(box, 3) == tried(box, h=1e6) == [line]  # 1e9 steps are the most


@pytest.mark.parametrize(
    ("defect", "start", "t"), [("", "1e400", "0"), ("{ y = 1e400; return fmi2OK; }", "0.0", "0.006")]
)
def test_values_that_are_not_finite_end_a_run(tmp_path: Path, defect: str, start: str, t: str) -> None:
    (tmp_path / "scenario.toml").write_text(tomli_w.dumps(LOOP))
    extra = f"__attribute__((constructor)) static void start(void) {{ y = {start}; }}"
    bad_fmu(tmp_path / "bad.fmu", defect, -1.0, extra)
    assert tried(unpacked(tmp_path, tmp_path)[0], 8) == [f"values that are not finite at t = {t} s"]


def test_outputs_are_known_in_initialization_mode(write: Any, tmp_path: Path) -> None:
    written(typed(write), tmp_path / "box.fmu")
    slave = Slave(tmp_path / "box.fmu", tmp_path / "box", silent=True)
    reference, found = slave.variables["x_k"].valueReference, []
    slave.fmu.setupExperiment(startTime=0.0)
    for call in (slave.fmu.enterInitializationMode, slave.fmu.exitInitializationMode):
        call()
        found += slave.fmu.getInteger([reference])
    assert found[0] == found[1] != 0
    slave.free()


H = 1e-3
STEPS = [  # begin and length of a step of a container with steps of H, in this order; why it is refused
    (0.0, 0.0, "the step size must be in (0, 1e9] s. Got 0 instead."),
    (0.0, -H, "the step size must be in (0, 1e9] s. Got -0.001 instead."),
    (0.0, math.nan, "the step size must be in (0, 1e9] s. Got nan instead."),
    (0.0, math.nextafter(1e9, 2e9), "the step size must be in (0, 1e9] s. Got 1e+09 instead."),
    (0.0, 1e9, "the step size must be at most 1e9 steps of 0.001 s. Got 1e+09 s instead."),
    (1.1e-6, H, "is at t = 0 s; the step starts at 1.1e-06 s"),
    (-1.1e-6, H, "is at t = 0 s; the step starts at -1.1e-06 s"),
    (math.nan, H, "is at t = 0 s; the step starts at nan s"),
    (0.0, 0.9e-9, ""),  # rounding of a clock
    (0.0, 1.1e-9, "the step size must be a whole number of 0.001 s. Got 1.1e-09 s instead."),
    (0.0, 0.9989e-3, "the step size must be a whole number of 0.001 s. Got 0.0009989 s instead."),
    (0.0, 1.0011e-3, "the step size must be a whole number of 0.001 s. Got 0.0010011 s instead."),
    (0.9e-6, 1.0009e-3, ""),
    (1.0009e-3, 0.9991e-3, ""),  # the clock of the importer is at 2 ms
    (2e-3, 3 * H, ""),
    (5e-3, H + 1.1e-6, "the step ends at t = 0.0060011 s, after the stop time 0.006 s"),
    (5e-3 + 0.9e-6, H + 0.3e-6, "the step ends at t = 0.0060012 s, after the stop time 0.006 s"),
    (5e-3, H + 0.9e-6, ""),
    (6e-3 + 0.9e-6, H, "the step ends at t = 0.0070009 s, after the stop time 0.006 s"),
]


def test_steps_follow_the_clock_of_the_importer_to_a_thousandth(write: Any, tmp_path: Path) -> None:
    said: list[str] = []
    slave = made(unpacked(typed(write), tmp_path)[0], said)
    setup = slave.dll.fmi2SetupExperiment
    for start, stop in ((1.0, 2.0), (0.0, -1e-9), (0.0, math.inf), (0.0, math.nan)):
        assert setup(slave.component, 0, 0.0, start, 1, stop) == 3
        late = "starts at t = 0 only", "the stop time must be finite and not before the start time"
        assert said.pop() == late[start == 0]
    for stop in (0.0, 6 * H):
        assert setup(slave.component, 0, 0.0, 0.0, 1, stop) == 0
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    for t, h, line in STEPS:
        assert slave.dll.fmi2DoStep(slave.component, t, h, 1) == (3 if line else 0), (t, h, said)
        assert said == [line] * bool(line)
        said.clear()
    last, ended = C.c_double(), C.c_int(7)
    for kind, status in ((0, 2), (1, 2), (2, 0), (3, 2)):
        assert called(slave, "fmi2GetRealStatus", kind, C.byref(last)) == status
        assert called(slave, "fmi2GetBooleanStatus", kind, C.byref(ended)) == 2 * (kind != 3)
    assert (last.value, ended.value) == (6 * H, 0)
    slave.reset()  # the stop time is gone
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    slave.doStep(0.0, 9 * H)
    slave.freeInstance()
    assert said == []


def test_an_output_is_read_by_its_own_type(write: Any, tmp_path: Path) -> None:
    said: list[str] = []
    box, _ = unpacked(typed(write), tmp_path)
    slave, told = made(box, said), fmpy.read_model_description(str(box)).modelVariables
    value = (C.c_double * 2)()
    for kind in ("Real", "Integer", "Boolean"):
        get = f"fmi2Get{kind}"
        for k in range(len(told) + 2):
            good = k < len(told) and told[k].type == kind
            assert called(slave, get, C.byref(C.c_uint(k)), C.c_size_t(1), value) == (0 if good else 3)
            assert said == ([] if good else [f"{get}: no variable has the value reference {k}"])
            said.clear()
        for pointers in ((None, value), (value, None)):
            assert called(slave, get, pointers[0], C.c_size_t(1), pointers[1]) == 3
            assert said.pop() == f"{get}: a pointer is NULL"
    slave.freeInstance()


def test_a_container_that_cannot_be_made_or_reset(write: Any, tmp_path: Path) -> None:
    said: list[str] = []
    box, file = unpacked(typed(write), tmp_path)
    assert made(box, said, guid="100% a#b").component is None
    assert said.pop() == "the GUID '100%% a##b' does not belong to this system.txt"
    slave = made(box, said)
    assert not slave.dll.fmi2Instantiate(b"box", 0, slave.guid.encode(), b"", slave.callbacks, 0, 0)
    assert said.pop() == "has no Model Exchange"
    file.rename(file.with_suffix(".old"))
    assert slave.dll.fmi2Reset(slave.component) == slave.dll.fmi2Reset(slave.component) == 3
    assert slave.dll.fmi2Terminate(slave.component) == 3
    assert said[2:] == ["fmi2Terminate is not allowed now"]
    file.with_suffix(".old").rename(file)
    slave.reset()
    slave.enterInitializationMode()
    slave.freeInstance()


@pytest.mark.turn("containers")
@pytest.mark.parametrize("fmi", [2, 3])
def test_an_instance_leaves_no_memory_and_no_library_behind(write: Any, tmp_path: Path, fmi: int) -> None:
    said: list[str] = []
    box, _ = unpacked(typed(write, fmi), tmp_path)

    slave = made(box, said)
    place = f"file://{box / 'resources'}".replace("%", "%25").encode()

    def live() -> None:
        for token in (slave.guid, "another"):
            one = slave.dll.fmi2Instantiate(b"box", 1, token.encode(), place, slave.callbacks, 0, 0)
            assert bool(one) == (token == slave.guid)
            if one:
                assert slave.dll.fmi2Reset(one) == 0
                slave.dll.fmi2FreeInstance(one)
        said.clear()

    assert leaves_nothing(live)
    slave.freeInstance()
    assert str(box / "resources") not in Path("/proc/self/maps").read_text()


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_unit_without_a_function_or_that_refuses_a_parameter(write: Any, tmp_path: Path, fmi: int) -> None:
    box, file = unpacked(typed(write, fmi), tmp_path)
    library = next((box / "resources" / "units" / "x" / "binaries").rglob("*.so"))
    whole, text = library.read_bytes(), file.read_text()
    names = ["Instantiate", "SetupExperiment"] if fmi == 2 else ["InstantiateCoSimulation"]
    names += ["EnterInitializationMode", "ExitInitializationMode", "Terminate", "FreeInstance", "DoStep"]
    integer = "Integer" if fmi == 2 else "Int32"
    for name in [*names, f"Set{integer}", f"Get{integer}", "SetBoolean"]:
        old = f"\0fmi{fmi}{name}\0".encode()
        assert old in whole
        library.unlink()  # one that is loaded must stay as it is
        library.write_bytes(whole.replace(old, old[:-2] + b"_\0"))
        line = "refuses a parameter" if name == "SetBoolean" else "its library lacks functions of the standard"
        assert tried(box) == [f"unit 'x': {line}"], name
    library.write_bytes(whole)
    file.write_text(re.sub(r"(parameters 3 s )\d+ ", r"\g<1>99 ", text))
    assert tried(box) == ["unit 'x': refuses a parameter: reference 99 is no variable of type s"]
    file.write_text(re.sub(r"(inputs 1 \S+ )\d+ ", r"\g<1>99 ", text))
    assert tried(box) == ["unit 'x': refuses the initialisation: reference 99 is no variable of type ?"]


@pytest.mark.parametrize("limit", ["needsExecutionTool", "canBeInstantiatedOnlyOncePerProcess"])
def test_a_limit_of_a_unit_is_one_of_the_container(write: Any, tmp_path: Path, limit: str) -> None:
    folder = typed(write)
    with zipfile.ZipFile(folder / "x.fmu") as old:
        files = {n: old.read(n) for n in old.namelist()}
    files["modelDescription.xml"] = files["modelDescription.xml"].replace(
        b"<CoSimulation", f'<CoSimulation {limit}="true"'.encode()
    )
    with zipfile.ZipFile(folder / "x.fmu", "w") as new:
        for name, content in files.items():
            new.writestr(name, content)
    written(folder, tmp_path / "box.fmu")
    told = fmpy.read_model_description(str(tmp_path / "box.fmu")).coSimulation
    assert (told.needsExecutionTool, told.canBeInstantiatedOnlyOncePerProcess) == tuple(
        limit == x for x in ("needsExecutionTool", "canBeInstantiatedOnlyOncePerProcess")
    )


def test_files_of_a_unit_keep_their_names(write: Any, tmp_path: Path) -> None:
    folder = typed(write)
    with zipfile.ZipFile(folder / "x.fmu", "a") as archive:
        archive.writestr("resources/Größe.csv", "1")
    written(folder, tmp_path / "box.fmu")
    with zipfile.ZipFile(tmp_path / "box.fmu") as archive:
        assert archive.read("resources/units/x/resources/Größe.csv") == b"1"
        assert {i.flag_bits for i in archive.infolist() if i.filename.isascii()} == {0}


# function of FMI 2.0 with its arguments -> phases in which it is allowed; made, initializing, stepping, ended
PHASES = {
    ("fmi2SetupExperiment", 0, 0.0, 0.0, 0, 0.0): "made",
    ("fmi2EnterInitializationMode",): "made",
    ("fmi2ExitInitializationMode",): "initializing",
    ("fmi2DoStep", 0.0, 1e-3, 1): "stepping",
    ("fmi2GetReal", None, 0, None): "made initializing stepping ended",
    ("fmi2GetRealStatus", 2, None): "stepping ended",
    ("fmi2GetBooleanStatus", 3, None): "stepping ended",
    ("fmi2Terminate",): "stepping",
    ("fmi2Reset",): "made initializing stepping ended",
    ("fmi2SetDebugLogging", 0, 0, None): "made initializing stepping ended",
}
WAY = ["EnterInitializationMode", "ExitInitializationMode", "Terminate"]


ABSENT = ["GetFMUstate", "SetFMUstate", "FreeFMUstate", "SerializedFMUstateSize", "SerializeFMUstate"]
ABSENT += ["DeSerializeFMUstate", "GetDirectionalDerivative", "CancelStep"]
NONE = ["SetReal", "SetInteger", "SetBoolean", "GetString", "SetString"]
NONE += ["SetRealInputDerivatives", "GetRealOutputDerivatives"]


def test_a_call_outside_its_phase_is_an_error(write: Any, tmp_path: Path) -> None:
    said: list[str] = []
    box, _ = unpacked(typed(write), tmp_path)
    for at, phase in enumerate(("made", "initializing", "stepping", "ended")):

        def there(at: int = at) -> FMU2Slave:
            slave = made(box, said)
            for step in WAY[:at]:
                assert getattr(slave.dll, f"fmi2{step}")(slave.component) == 0
            return slave

        for (name, *arguments), phases in PHASES.items():
            status = called(slave := there(), name, *arguments)
            slave.freeInstance()
            refused = said == [f"{name} is not allowed now"]
            assert refused == (phase not in phases.split()), (name, phase, status, said)
            assert (status == 3) == refused
            said.clear()
        slave = there()
        for name in ABSENT:
            assert called(slave, f"fmi2{name}", None, None, None) == 3
            assert said.pop() == f"fmi2{name} is not available: not declared"
        for name in NONE:
            assert called(slave, f"fmi2{name}", None, C.c_size_t(0), None, None) == 0
            assert called(slave, f"fmi2{name}", None, C.c_size_t(1), None, None) == 3
            assert said.pop() == f"fmi2{name}: there is no such variable"
        for name in ("Status", "IntegerStatus", "StringStatus"):
            assert called(slave, f"fmi2Get{name}", 0, None) == 2
        slave.freeInstance()
    library = made(box, said).dll
    library.fmi2GetVersion.restype = library.fmi2GetTypesPlatform.restype = C.c_char_p
    assert (library.fmi2GetVersion(), library.fmi2GetTypesPlatform()) == (b"2.0", b"default")
