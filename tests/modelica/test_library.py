"""Form of the library: two parsers read it, folders and names fit, documentation is there, and the lint is quiet."""

import re
from xml.etree import ElementTree

import compare
import form
import library
import lint
import numpy as np
import pytest
import simulate
from syntax_tree import references

Classes = dict[str, library.Class]


@pytest.fixture(scope="module")
def classes() -> Classes:
    return library.classes()


def test_every_package_order_lists_the_classes_of_its_folder() -> None:
    inside = (d for d in library.ROOT.rglob("*") if d.is_dir() and "Resources" not in d.parts)
    assert [m for folder in (library.ROOT, *inside) for m in form.order_complaints(folder)] == []


def test_every_file_stands_where_its_class_says(classes: Classes) -> None:
    top = library.ROOT.parent
    for file in library.files():
        assert [*form.place_complaints(file, top), *form.encoding_complaints(file)] == []
        name = file.relative_to(top).with_suffix("").as_posix().replace("/", ".")
        assert name.removesuffix(".package") in classes


@pytest.mark.stress  # `make check`
def test_lint_is_quiet_about_every_class(classes: Classes) -> None:
    assert [m for c in classes.values() for m in lint.complaints(c)] == []


@pytest.mark.stress
def test_every_class_loads(classes: Classes) -> None:
    """Every block; the models are compiled where they are simulated, one by one (test_validation.py)."""
    names = sorted({n for n, c in classes.items() if simulate.can_load(c)} - set(compare.models()))
    assert len(names) > 60
    assert {n: complaint for n, complaint in simulate.load(names).items() if complaint} == {}


def test_every_block_has_a_validation(classes: Classes) -> None:
    assert len(form.blocks(classes)) > 50
    assert form.untested(classes) == []


def test_every_part_of_a_loop_is_in_an_example(classes: Classes) -> None:
    """As the base, in a slot, or as a part of what is there."""
    texts = {
        n: library.text(c.file) for n, c in classes.items() if n.startswith(("HystFMU.Examples.", "HystFMU.Loops."))
    }
    reached = {n for n in texts if n.startswith("HystFMU.Examples.")}
    loops = {n for n in texts if n.startswith("HystFMU.Loops.")}
    assert len(loops) > 5
    for _ in loops:
        code = [re.sub(r"Documentation\(.*", "", texts[n], flags=re.S) for n in reached]
        reached |= {n for n in loops if any(re.search(rf"\b{n.rsplit('.', 1)[1]}\b", t) for t in code)}
    assert loops <= reached


def test_loops_show_every_connection(classes: Classes) -> None:
    """No equation gives an input of a component of an example its value: the diagram would not show it."""
    for name, c in classes.items():
        if name.startswith(("HystFMU.Examples.", "HystFMU.Loops.")):
            assert re.findall(r"(?m)^ +\w+\.\w+ = .*", library.text(c.file)) == [], name


def test_every_function_is_used(classes: Classes) -> None:
    text = "\n".join(library.text(f) for f in library.files())
    called = set(re.findall(r"(?<!function )\b(\w+)\(", text))
    for name, c in classes.items():
        if c.tree.type == "function" and not name.startswith("HystFMU.Icons"):
            assert c.short_name in called, f"no block and no function calls {name}"


def test_only_sources_and_the_clock_of_samples_know_the_time(classes: Classes) -> None:
    """The trajectory of any other class is shifted with the start of a simulation, together with its inputs."""
    users = set()
    for name, c in classes.items():
        values = [e for s in c.tree.symbols.values() for e in library.modifiers(s.class_modification).values()]
        tree = c.tree.equations, c.tree.initial_equations, c.tree.statements, c.tree.initial_statements, values
        if "time" in references(tree) and not name.startswith(("HystFMU.Sources.", "HystFMU.Validation.")):
            users.add(name)
    assert users == {"HystFMU.Interfaces.Sampled"}


@pytest.mark.some(1)
@pytest.mark.parametrize("start", [1.0, -2.5])
def test_samples_begin_with_the_simulation(start: float) -> None:
    """A controller under a constant error integrates from the start time on, whatever that is."""
    text = "model M HystFMU.Control.Pid a(Ki = 2, Ts = 0.1); equation a.y_d = 1; a.y = 0; a.u_ff = 0; end M;"
    found = []
    for t in (0.0, start):
        v = simulate.solve_text(text, t + 1, 0.1, 1e-6, t).values
        found.append(simulate.Trajectory({**v, "time": v["time"] - t}).at(0.1)["a.u"])
    assert np.ptp(found[0]) > 1
    assert found[1] == pytest.approx(found[0], abs=1e-12)


def test_examples_with_physical_ports_come_first() -> None:
    listed = (library.ROOT / "Examples" / "package.order").read_text().split()
    physical = [
        bool(re.search(r"connect\(\w+\.(pin|flange)", library.text(library.ROOT / f"Examples/{n}.mo"))) for n in listed
    ]
    assert physical == sorted(physical, reverse=True)
    assert any(physical)


def test_pictures_of_the_guide_are_drawings() -> None:
    """Each is XML with curves or components in it, and a page shows it."""
    shown = "".join(library.text(f) for f in (library.ROOT / "UsersGuide").glob("*.mo"))
    pictures = sorted((library.ROOT / "Resources" / "Images").glob("*.svg"))
    assert pictures
    for file in pictures:
        drawing = ElementTree.parse(file).getroot()
        assert len(drawing.findall(".//{*}polyline")) + len(drawing.findall(".//{*}rect")) > 1, file.name
        assert f"Resources/Images/{file.name}" in shown
