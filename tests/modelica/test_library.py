"""Form of the library: two parsers read it, folders and names fit, documentation is there, and the lint is quiet."""

from __future__ import annotations

import re
from pathlib import Path

import library
import lint
import pymoca.parser
import pytest
import simulate

CLASSES = library.classes()
BLOCKS = sorted(
    n
    for n, c in CLASSES.items()
    if c.tree.type == "block" and not c.tree.partial and not n.startswith(("HystFMU.Icons", "HystFMU.Validation"))
)


FOLDERS = [d for d in [library.ROOT, *sorted(library.ROOT.rglob("*"))] if d.is_dir() and "Resources" not in d.parts]


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda d: str(d.relative_to(library.ROOT)))
def test_package_order_lists_the_classes_of_the_folder(folder: Path) -> None:
    listed = (folder / "package.order").read_text().split()
    there = [f.stem for f in folder.glob("*.mo") if f.stem != "package"] + [
        d.name for d in folder.iterdir() if d.is_dir() and d.name != "Resources"
    ]
    assert sorted(listed) == sorted(there)


@pytest.mark.parametrize("file", library.files(), ids=lambda f: str(f.relative_to(library.ROOT)))
def test_file_stands_where_its_class_says(file: Path) -> None:
    inside = file.parent if file.stem != "package" else file.parent.parent
    path = inside.relative_to(library.ROOT.parent).parts
    name = file.stem if file.stem != "package" else file.parent.name
    body = library.text(file)
    within = re.search(r"^within ([\w.]+);", body, re.M)
    assert (within[1] if within else "") == ".".join(path)
    assert ".".join([*path, name]) in CLASSES
    assert re.search(rf"^end {name};\s*\Z", body, re.M), f"the file does not end with 'end {name};'"


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_lint_is_quiet(name: str) -> None:
    assert list(lint.complaints(CLASSES[name])) == []


@pytest.mark.parametrize(
    ("rule", "body"),
    [
        ("undocumented", 'block Bad "b" end Bad;'),
        ("missing_each", 'block Bad "b" parameter Real r[3](min = 0) = {1, 2, 3}; end Bad;'),
        ("missing_each", 'block Bad "b" parameter Real r[3] = 0; end Bad;'),
        ("outside_when", 'block Bad "b" discrete Real z; equation z = time; end Bad;'),
        (
            "outside_when",
            'block Bad "b" Real z; equation when sample(0, 1) then z = time; end when; z = time; end Bad;',
        ),
        ("assigned_input", 'block Bad "b" Interfaces.RealInput u; equation u = time; end Bad;'),
        (
            "protected_access",
            'block Bad "b" Operators.Sampled.ZhaoTan a; Real y; equation y = a.extrema[1]; end Bad;',
        ),
        ("protected_access", 'block Bad "b" Operators.Sampled.ZhaoTan a; Real y; equation y = a.nothing; end Bad;'),
        ("equal_reals", 'block Bad "b" parameter Real r = 1; Real y; equation y = if r == 1 then 2 else 3; end Bad;'),
        ("equal_reals", 'block Bad "b" parameter Real r[2] = {1, 2}; Real y = if r[1] <> 1 then 2 else 3; end Bad;'),
        ("below_min", 'block Bad "b" parameter Real r(min = 0) = -1; end Bad;'),
        (
            "unlike_units",
            'block Bad "b" Control.Feedforward a; Control.SlidingMode s; equation connect(s.s, a.ddr); end Bad;',
        ),
    ],
)
def test_lint_finds(rule: str, body: str, tmp_path: Path) -> None:
    file = tmp_path / "Bad.mo"
    file.write_text(f"within HystFMU.Operators;\n{body}\n")
    tree = pymoca.parser.parse(file.read_text()).classes["HystFMU"].classes["Operators"].classes["Bad"]
    assert rule in {m.split(":")[0] for m in lint.complaints(library.Class("HystFMU.Operators.Bad", file, tree))}


def test_every_class_loads() -> None:
    names = [n for n, c in CLASSES.items() if simulate.can_load(c)]
    assert len(names) > 100
    assert {n: complaint for n, complaint in simulate.load(names).items() if complaint} == {}


@pytest.mark.parametrize("name", BLOCKS)
def test_block_has_a_validation(name: str) -> None:
    tested = {
        str(library.find(str(c.tree.symbols["tested"].type), n).name)  # type: ignore[union-attr]
        for n, c in CLASSES.items()
        if n.startswith("HystFMU.Validation.") and c.tree.type == "model"
    }
    assert name in tested


def test_every_function_is_used() -> None:
    used = "\n".join(library.text(f) for f in library.files())
    for name, c in CLASSES.items():
        if c.tree.type == "function" and not name.startswith("HystFMU.Icons"):
            calls = re.findall(rf"(?<!function )\b{c.short_name}\(", used)
            assert calls, f"no block and no function calls {name}"
