"""Mistakes seeded into sound classes: each must be found by the second parser, the compiler, the lint or the C table.

The unchanged classes are quiet (test_library.py, and below).
"""

import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import form
import library
import lint
import pymoca.parser
import pytest
import simulate
import table

from hystfmu.core.library import block_types


@dataclass(frozen=True)
class Mistake:
    """`old` in a file of the library becomes `new`; `finder` says so in a line with the words `says`."""

    kind: str
    file: str
    old: str
    new: str
    finder: str
    says: str


def _rows(text: str) -> Iterator[Mistake]:
    file = ""
    for line in text.splitlines():
        if line.startswith("["):
            file = line.strip("[]")
        elif line and not line.startswith("#"):
            kind, finder, change, says = line.split(" | ")
            old, new = (part.strip("`").replace("\\n", "\n") for part in change.split(" => "))
            yield Mistake(kind, file, old, new, finder, says)


MISTAKES = {m.kind: m for m in _rows(Path(__file__).with_name("mistakes.txt").read_text())}


def kinds(finder: str) -> list[str]:
    return [k for k, m in MISTAKES.items() if m.finder == finder]


def mutated(kind: str, folder: Path) -> tuple[Path, str]:
    """A copy of a file with the mistake in it, and the qualified name of its class."""
    m = MISTAKES[kind]
    body = library.text(library.ROOT / f"{m.file}.mo")
    assert m.old in body, "the text to change is not there any more"
    changed = folder / f"{m.file.rsplit('/', 1)[1]}.mo"
    changed.write_text(body.replace(m.old, m.new))
    return changed, f"HystFMU.{m.file.replace('/', '.')}"


def parsed(kind: str, folder: Path) -> library.Class:
    """The class with the mistake in it."""
    changed, name = mutated(kind, folder)
    tree = pymoca.parser.parse(changed.read_text())
    assert tree is not None
    for part in name.split("."):
        tree = tree.classes[part]
    return library.Class(name, changed, tree)


@pytest.mark.parametrize("kind", kinds("parser"))
def test_second_parser_finds(kind: str, tmp_path: Path) -> None:
    changed, _ = mutated(kind, tmp_path)
    with pytest.raises(pymoca.parser.ModelicaSyntaxError) as e:
        pymoca.parser.parse(changed.read_text())
    assert MISTAKES[kind].says in str(e.value)


@pytest.mark.parametrize("kind", kinds("lint"))
def test_lint_finds(kind: str, tmp_path: Path) -> None:
    c = parsed(kind, tmp_path)
    found = [m.replace(f" {c.name}:", "", 1) for m in lint.complaints(c)]
    assert [m for m in found if MISTAKES[kind].says in m], found


@pytest.mark.parametrize("kind", kinds("table"))
def test_comparison_with_the_c_table_finds(kind: str, tmp_path: Path) -> None:
    found = list(table.differences(parsed(kind, tmp_path)))
    assert [m for m in found if MISTAKES[kind].says in m], found


@pytest.mark.stress
def test_compiler_finds(tmp_path: Path) -> None:
    """All of them in one process: each file in turn takes the place of the sound one in a copy of the library."""
    copy = tmp_path / "HystFMU"
    shutil.copytree(library.ROOT, copy, ignore=shutil.ignore_patterns("Resources"))
    cases = {}
    for i, kind in enumerate(kinds("compiler")):
        folder = tmp_path / f"case{i}"
        folder.mkdir()
        cases[kind] = mutated(kind, folder)
    sound = simulate.load_changed(copy, [(library.ROOT / "Dynamics" / "Sum.mo", "HystFMU.Dynamics.Sum")])
    assert sound == [""]
    found = dict(zip(cases, simulate.load_changed(copy, list(cases.values())), strict=True))
    other = {kind: complaint for kind, complaint in found.items() if MISTAKES[kind].says not in complaint}
    assert other == {}


# ---- files and folders
@pytest.fixture
def control(tmp_path: Path) -> Path:
    """A copy of one package, where it stands in the library."""
    return shutil.copytree(library.ROOT / "Control", tmp_path / "HystFMU" / "Control")


def test_sound_package_is_quiet(control: Path) -> None:
    assert list(form.order_complaints(control)) == []
    for file in control.glob("*.mo"):
        assert list(form.place_complaints(file, control.parents[1])) == []


@pytest.mark.parametrize(("old", "new", "says"), [
    ("Pid\n", "", "does not list Pid"),
    ("Pid\n", "Pid\nFuzzy\n", "lists Fuzzy, which has no file"),
    ("Pid\n", "Pid\nPid\n", "lists Pid twice"),
], ids=["entry left out", "entry without a file", "entry twice"])  # fmt: skip
def test_order_of_a_package_is_checked(old: str, new: str, says: str, control: Path) -> None:
    order = control / "package.order"
    assert old in order.read_text()
    order.write_text(order.read_text().replace(old, new))
    assert list(form.order_complaints(control)) == [f"package.order of Control {says}"]


@pytest.mark.parametrize(("old", "new", "says"), [
    ("HystFMU.Control;", "HystFMU.Plants;", "Pid.mo is within HystFMU.Plants and stands in HystFMU.Control"),
    ("within HystFMU.Control;\n", "", "Pid.mo is within nothing and stands in HystFMU.Control"),
    ("end Pid;", "end PID;", "Pid.mo does not end with 'end Pid;'"),
], ids=["another within", "no within", "another end"])  # fmt: skip
def test_place_of_a_file_is_checked(old: str, new: str, says: str, control: Path) -> None:
    file = control / "Pid.mo"
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new))
    assert list(form.place_complaints(file, control.parents[1])) == [says]


@pytest.mark.parametrize(("change", "says"), [
    (lambda b: b.replace(b"Pid", b"P\xefd", 1), "is not UTF-8 at byte"),
    (lambda b: b"\xef\xbb\xbf" + b, "has a byte order mark"),
    (lambda b: b.replace(b"  ", b"\t", 1), "has a tab"),
    (lambda b: b.replace(b"\n", b"\r\n"), "has a carriage return"),
    (lambda b: b.rstrip(), "does not end with one newline"),
    (lambda b: b + b"\n", "does not end with one newline"),
], ids=["another encoding", "mark", "tab", "line ends", "no newline", "two newlines"])  # fmt: skip
def test_bytes_of_a_file_are_checked(change: Callable[[bytes], bytes], says: str, control: Path) -> None:
    file = control / "Pid.mo"
    assert list(form.encoding_complaints(file)) == []
    file.write_bytes(change(file.read_bytes()))
    assert [m for m in form.encoding_complaints(file) if m.startswith(f"Pid.mo {says}")]


def test_block_without_a_validation_is_found() -> None:
    classes = dict(library.classes())
    del classes["HystFMU.Validation.Sum"]
    assert form.untested(classes) == ["HystFMU.Dynamics.Sum"]


def test_there_are_kinds_enough() -> None:
    assert len(MISTAKES) >= 50
    assert {m.finder for m in MISTAKES.values()} == {"parser", "compiler", "lint", "table"}


# ---- Classes with a twin among the C blocks carry the same names, units, ranges and defaults
def test_every_class_equals_the_table() -> None:
    assert len(table.pairs()) >= 40
    assert {n: found for n in table.pairs() if (found := list(table.differences(library.classes()[n])))} == {}


def test_every_block_has_a_class() -> None:
    classes = [n for n in table.pairs() if not library.classes()[n].tree.partial]
    assert {table.TWINS[n.rsplit(".", 1)[-1]].name for n in classes} == set(block_types())
