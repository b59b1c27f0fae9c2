"""`hystfmu validate` finds every defect of a table of broken FMUs and names it; a correct FMU passes.

broken.c is compiled once: the guid selects the defect.  Defects of an archive are made from the correct FMU.
FMUs of others that obey the standard are in test_trials.py.
"""

import io
import shutil
import stat
import struct
import subprocess
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path

import fmpy
import pytest

import hystfmu as hy
from hystfmu.base.errors import InputError

SOURCE = Path(__file__).with_name("broken.c")
HEADERS = Path(fmpy.__file__).parent / "c-code"
BINARY = f"binaries/{fmpy.platform}/broken{fmpy.sharedLibraryExtension}"
XML = "modelDescription.xml"
GOOD = SOURCE.with_suffix(".xml").read_text()

EXCHANGE = SOURCE.with_name("broken_exchange.xml").read_text()

Entries = dict[str, bytes]


def _swap(old: str, new: str) -> Callable[[Entries], Entries]:
    """Replace one piece of text in the model description."""
    assert old in GOOD + EXCHANGE
    return lambda e: {**e, XML: e[XML].replace(old.encode(), new.encode(), 1)}


def _add(name: str, content: bytes = b"x") -> Callable[[Entries], Entries]:
    return lambda e: {**e, name: content}


def _drop(name: str) -> Callable[[Entries], Entries]:
    return lambda e: {k: v for k, v in e.items() if k != name}


def _typed(e: Entries, name: str, facts: str) -> Entries:
    """Give the real variable a declared type that states these attributes."""
    before, own, after = e[XML].decode().partition(f'name="{name}"')
    types = f'<TypeDefinitions><SimpleType name="T"><Real {facts}/></SimpleType></TypeDefinitions>'
    after = after.replace("<Real", '<Real declaredType="T"', 1)
    return {**e, XML: f"{before.replace('<DefaultE', f'{types}<DefaultE')}{own}{after}".encode()}


# defect: change of the archive, part of the message
ARCHIVES: dict[str, tuple[Callable[[Entries], Entries], str]] = {
    "no description": (_drop(XML), "the archive has no modelDescription.xml"),
    "zip slip": (_add("../evil.txt"), "'../evil.txt' would be written outside the folder"),
    "absolute path": (_add("/evil.txt"), "'/evil.txt' would be written outside the folder"),
    "way out of a folder": (_add("a/../../evil.txt"), "'a/../../evil.txt' would be written outside the folder"),
    "path of a drive": (_add("C:/evil.txt"), "'C:/evil.txt' would be written outside the folder"),
    "not XML": (_add(XML, b"<fmiModelDescription"), "(modelDescription.xml, line 1)"),
    "external entity": (
        lambda e: {**e, XML: e[XML].replace(b"<fmi", b'<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]><fmi', 1)},
        "must not declare a document type",
    ),
    "external entity in UTF-16": (
        lambda e: {**e, XML: GOOD.replace("UTF-8", "UTF-16").replace("<fmi", "<!DOCTYPE x><fmi", 1).encode("utf-16")},
        "modelDescription.xml is not encoded in UTF-8",
    ),
    "unknown attribute": (_swap('modelName="broken"', 'modelName="broken" colour="red"'), "'colour'"),
    "duplicate names": (_swap('name="k"', 'name="u"'), '"u" (line'),
    "input without start": (_swap('start="0.0" ', ""), 'Variable "u" (line 8) has no start value'),
    "undefined unit": (_swap('<Unit name="V"/>', '<Unit name="A"/>'), 'The unit "V" of variable "u"'),
    "illegal variability": (
        _swap('causality="parameter" variability="fixed"', 'causality="parameter" variability="continuous"'),
        'causality="parameter" and variability="continuous"',
    ),
    "output not in the structure": (_swap('<Outputs><Unknown index="2" dependencies="1"/></Outputs>', ""), "Outputs"),
    "no binary for this platform": (
        lambda e: {("binaries/other/broken.so" if k == BINARY else k): v for k, v in e.items()},
        "has no binary for this platform",
    ),
    "not a binary": (_add(BINARY, b"\x7fELF"), "the binary cannot be loaded"),
    "wrong guid": (_swap('guid="{broken}"', 'guid="{other}"'), "the FMU cannot be instantiated"),
    "start value differs": (_swap('start="2.0"', 'start="2.5"'), "k: the start value is 2.5, but the binary has 2.0"),
    "wrong value reference": (
        _swap('valueReference="1"', 'valueReference="9"'),
        "y (value reference 9) cannot be read",
    ),
    "false dependency": (_swap('index="2" dependencies="1"', 'index="2" dependencies=""'), "y depends on u at once"),
    "minimum above maximum": (_swap('start="2.0"', 'start="2.0" min="3" max="1"'), "k: the minimum 3 is above the max"),
    "start outside the range": (
        _swap('start="2.0"', 'start="2.0" max="1"'),
        "k: the start value 2 is outside its range",
    ),
    "start outside the range of its type": (
        lambda e: _typed(e, "k", 'max="1"'),
        "k: the start value 2 is outside its range",
    ),
    "nominal of zero": (
        _swap('start="2.0"', 'start="2.0" nominal="0"'),
        "k: the nominal value is 0; it must be positive",
    ),
    "factor of zero": (
        _swap('<Unit name="V"/>', '<Unit name="V"><BaseUnit factor="0" kg="1"/></Unit>'),
        'the unit "V" has the factor 0 to its base unit',
    ),
    "display unit of no unit": (_swap('unit="V"', 'unit="V" displayUnit="mV"'), 'The display unit "mV"'),
    "stop before start": (
        _swap('stepSize="0.01"', 'startTime="2" stopTime="1" stepSize="0.01"'),
        "the default experiment stops at 1 s, before its start at 2 s",
    ),
    "step of zero": (_swap('stepSize="0.01"', 'stepSize="0"'), "the step size of the default experiment is 0"),
    "index of another variable": (_swap('<Outputs><Unknown index="2"', '<Outputs><Unknown index="3"'), "Outputs must"),
    "output listed twice": (
        _swap('<Outputs><Unknown index="2" dependencies="1"/>', '<Outputs><Unknown index="2"/><Unknown index="2"/>'),
        "ModelStructure/Outputs lists y 2 times",
    ),
    "kinds without dependencies": (
        _swap('index="2" dependencies="1"', 'index="2" dependencies="1" dependenciesKind="fixed fixed"'),
        "dependencies and dependenciesKind attributes of the outputs",
    ),
    "calculated with a start value": (
        _swap('initial="calculated">\n      <Real/>', 'initial="calculated">\n      <Real start="1"/>'),
        'has initial="calculated" but provides a start value',
    ),
    "initial unknowns left out": (
        _swap('<InitialUnknowns><Unknown index="2"/></InitialUnknowns>', ""),
        "ModelStructure/InitialUnknowns does not contain",
    ),
    "binary of another name": (
        _swap('modelIdentifier="broken"', 'modelIdentifier="intact"'),
        "no binary is named after the modelIdentifier 'intact'",
    ),
    "no interface": (_swap("<CoSimulation", "<VendorAnnotations"), "VendorAnnotations"),
}

# defect: number in broken.c, part of the message
UNITS: dict[str, tuple[int, str]] = {
    "state advances on get": (1, "reading the outputs changes them: y is"),
    "state advances on set": (2, "setting an input to another value and back changes the run: y is"),
    "memory leak": (3, "bytes per step"),
    "restoring does nothing": (4, "after restoring a saved state the run differs: y is"),
    "a state can be restored once": (5, "after restoring a saved state a second time the run differs: y is"),
    "reset does nothing": (6, "after reset the run differs from that of a new instance: y is"),
    "crash of a second instance": (7, "the FMU crashed (SIGSEGV) while running a second instance"),
    "instances share memory": (8, "the same run in a second instance differs: y is"),
    "doStep hangs": (9, "did not finish within 3 s while making 100 steps"),
    "doStep crashes": (10, "the FMU crashed (SIGABRT) while making 100 steps"),
    "NaN": (11, "y is nan after step 7"),
    "wrong derivative": (12, "the directional derivative of y with respect to u is -1, but differences give 1"),
    "input is ignored": (13, "u: set to"),
    "doStep refuses": (14, "step 21: fmi2DoStep failed with status 3 (error)"),
    "not repeatable": (15, "the same run in a second instance differs: y is"),
    "folder with odd letters": (16, "in a folder with a space and non-ASCII letters: the FMU cannot be instantiated"),
    "ends the process": (17, "the FMU ended its process with status 3 while making 100 steps"),
    "takes all memory": (18, "while making 100 steps"),
    "serialized state loses bytes": (19, "after restoring a deserialized state the run differs: y is"),
    "a parameter of another value": (20, "k: the start value is 2.0, but the binary has 2.5"),
    "crash on NULL": (21, "the FMU crashed (SIGSEGV) while freeing NULL"),
    "reset keeps a parameter": (22, "after reset k is 1.125 instead of its start value 2.0"),
    "a freed state is not NULL": (23, "fmi2FreeFMUstate does not set the pointer to NULL"),
    "a variable cannot be read": (24, "w (value reference 4) cannot be read"),
    "steps of one length only": (25, "a step of 0.5 times the step size: fmi2DoStep failed with status 3"),
    "terminate fails": (26, "terminating: fmi2Terminate failed with status 3"),
    "ends at once": (27, "the FMU ends the simulation in its first step"),
    "refuses an input": (28, "u (value reference 0) cannot be set to -"),
}

# the same in Model Exchange
STATES: dict[str, tuple[int, str]] = {
    "events without an end": (29, "the event iteration does not end"),
    "event in the past": (30, "the next time event is announced for 0.01 s, which is before 0.1013 s"),
    "derivatives of another order": (31, "derivative 1 is -1.25, but der(x), which the model structure names, is"),
    "derivatives change the unit": (32, "rejected steps change the run in Model Exchange: y is"),
    "time changes the unit": (33, "rejected steps change the run in Model Exchange: y is"),
    "no nominal": (34, "the nominal value of continuous state 1 is 0; it must be positive"),
    "no Event Mode": (35, "entering Event Mode: fmi2EnterEventMode failed with status 3"),
    "states not repeatable": (36, "the same run in a new instance differs in Model Exchange: y is"),
}
STRUCTURES: dict[str, tuple[Callable[[Entries], Entries], str]] = {
    "states of another order": (
        _swap(
            '<Unknown index="5" dependencies="1"/><Unknown index="6" dependencies="4"/>',
            '<Unknown index="6" dependencies="4"/><Unknown index="5" dependencies="1"/>',
        ),
        "continuous state 1 is 0.375, but w, which the model structure names, is 1.25",
    ),
    "a state left out": (_swap('<Unknown index="6" dependencies="4"/>', ""), "does not contain the expected set"),
    "a dependency on a state left out": (_swap('dependencies="1 3"', 'dependencies="1"'), "y depends on x at once"),
    "a derivative of no state": (_swap('<Real derivative="4"/>', "<Real/>"), 'must have the attribute "derivative"'),
}


@pytest.fixture(scope="module")
def compile_unit(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., bytes]:
    compiler = shutil.which("cc")
    if not compiler:
        pytest.skip("no C compiler")
    out = tmp_path_factory.mktemp("broken") / "broken.so"

    def build(*more: str) -> bytes:
        flags = ["-shared", "-fPIC", "-O1", "-w", "-fvisibility=hidden", f"-I{HEADERS}", *more]
        subprocess.run([compiler, *flags, str(SOURCE), "-o", str(out)], check=True, timeout=60)
        return out.read_bytes()

    return build


@pytest.fixture(scope="module")
def good(compile_unit: Callable[..., bytes]) -> Entries:
    return {XML: GOOD.encode(), BINARY: compile_unit()}


def _pack(entries: Entries) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    return out.getvalue()


def _problems(tmp_path: Path, content: bytes, seconds: float = 30) -> list[str]:
    path = tmp_path / "x.fmu"
    path.write_bytes(content)
    problems = hy.validate(path, seconds)
    assert all("\n" not in p for p in problems)
    assert [p.name for p in tmp_path.iterdir()] == ["x.fmu"]
    assert not (tmp_path.parent / "evil.txt").exists()
    return problems


def test_the_good_one_passes(tmp_path: Path, good: Entries) -> None:
    """Without this test the tables below would show nothing."""
    assert _problems(tmp_path, _pack(good)) == []


def test_one_that_refuses_what_its_types_exclude_passes(tmp_path: Path, good: Entries) -> None:
    refuses = _swap("{broken}", f"{{broken {UNITS['refuses an input'][0]}}}")(good)
    assert _problems(tmp_path, _pack(_typed(refuses, "u", 'min="0"'))) == []


@pytest.mark.some(1)
@pytest.mark.usefixtures("fmutool_or_not")
@pytest.mark.parametrize("defect", list(ARCHIVES))
def test_broken_archive(tmp_path: Path, good: Entries, defect: str) -> None:
    change, message = ARCHIVES[defect]
    problems = _problems(tmp_path, _pack(change(good)))
    assert any(message in p for p in problems), problems


@pytest.mark.some(1)
@pytest.mark.usefixtures("fmutool_or_not")
@pytest.mark.parametrize("defect", list(UNITS))
def test_broken_unit(tmp_path: Path, good: Entries, defect: str) -> None:
    number, message = UNITS[defect]
    limit = 3 if defect == "doStep hangs" else 30
    problems = _problems(tmp_path, _pack(_swap("{broken}", f"{{broken {number}}}")(good)), limit)
    assert any(message in p for p in problems), problems


@pytest.mark.turn("good FMUs")
def test_the_good_one_passes_in_model_exchange(tmp_path: Path, good: Entries) -> None:
    assert _problems(tmp_path, _pack({**good, XML: EXCHANGE.encode()})) == []


@pytest.mark.some(1)
@pytest.mark.usefixtures("fmutool_or_not")
@pytest.mark.parametrize("defect", [*STATES, *STRUCTURES])
def test_broken_states(tmp_path: Path, good: Entries, defect: str) -> None:
    if defect in STATES:
        number, message = STATES[defect]
        change = _swap("{broken}", f"{{broken {number}}}")
    else:
        change, message = STRUCTURES[defect]
    problems = _problems(tmp_path, _pack(change({**good, XML: EXCHANGE.encode()})))
    assert any(message in p for p in problems), problems


@pytest.mark.turn("broken binaries")
@pytest.mark.usefixtures("fmutool_or_not")
def test_missing_symbol(tmp_path: Path, good: Entries, compile_unit: Callable[..., bytes]) -> None:
    (problem,) = _problems(tmp_path, _pack({**good, BINARY: compile_unit("-DNO_STEP")}))
    assert problem.startswith("the binary does not export fmi2DoStep")


@pytest.mark.turn("broken descriptions")
def test_errors_of_fmutool_are_reported(tmp_path: Path, good: Entries) -> None:
    pytest.importorskip("fmu_manipulation_toolbox")
    problems = _problems(tmp_path, _pack(ARCHIVES["unknown attribute"][0](good)))
    assert any(p.startswith("fmutool: ") and "colour" in p for p in problems), problems


def test_entry_twice(tmp_path: Path, good: Entries) -> None:
    out = io.BytesIO(_pack(good))
    with zipfile.ZipFile(out, "a") as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        archive.writestr(XML, GOOD)
    assert _problems(tmp_path, out.getvalue()) == [f"{XML!r} occurs in the archive more than once"]


def test_symbolic_link(tmp_path: Path, good: Entries) -> None:
    out = io.BytesIO(_pack(good))
    with zipfile.ZipFile(out, "a") as archive:
        link = zipfile.ZipInfo("resources/link")
        link.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(link, "/etc/passwd")
    assert _problems(tmp_path, out.getvalue()) == ["'resources/link' is a symbolic link"]


@pytest.mark.parametrize(("size", "message"), [(3 << 30, "the archive must unpack to"), (100, "cannot be unpacked")])
def test_bomb(tmp_path: Path, good: Entries, size: int, message: str) -> None:
    """An entry with a declared size of 3 GiB, and one that is larger than declared."""
    out = bytearray(_pack({**good, "resources/zeros": bytes(1 << 20)}))
    at = out.index(struct.pack("<I", 1 << 20), out.rindex(b"PK\x01\x02"))
    out[at : at + 4] = struct.pack("<I", size)
    (problem,) = _problems(tmp_path, bytes(out))
    assert message in problem


def test_damaged_entry(tmp_path: Path, good: Entries) -> None:
    content = bytearray(_pack({"resources/data": bytes(range(256)) * 40, **good}))
    content[100] ^= 0xFF
    (problem,) = _problems(tmp_path, bytes(content))
    assert problem.startswith("'resources/data' cannot be unpacked")


@pytest.mark.parametrize("keep", [0, 10, 1000, -1, -30])
def test_cut_off(tmp_path: Path, good: Entries, keep: int) -> None:
    with pytest.raises(InputError, match=r"x\.fmu: not a ZIP archive, or truncated"):
        _problems(tmp_path, _pack(good)[:keep])
