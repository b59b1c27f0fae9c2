"""Generation of all generated files of a library, and comparison with the files on disk.

The page UsersGuide.Checks lists the lint rules by section of the language specification.
"""

import re
import tomllib
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path, PurePath

from generator import validation
from generator.base_class import base_classes, enumerations, package
from generator.declarations import number
from generator.drawing import drawn, nested, pictures
from generator.records import records
from generator.shelf import REALISATIONS, Shelf, is_generated, mark
from hystfmu.base import escape
from hystfmu.modelica.literals import class_text

# packages and pages of the guide in reading order
_ORDER = """
UsersGuide Operators Inverse Networks Dynamics Actuators Plants Control Loops Sources Functions
Data Examples Validation Interfaces Types Choices Icons
BaseClasses Models Sampled Events Smooth
GettingStarted TutorialLoops TutorialRealisations TutorialExport TutorialActuator Realisations Conventions Checks
ToolSupport References ReleaseNotes Contact License
"""
_FIRST = _ORDER.split()


def orders(files: Iterable[PurePath], first: Collection[PurePath] = ()) -> dict[PurePath, str]:
    """Return the text of every package.order of a library, by its path relative to the folder of the library.

    `files` are the .mo files. Each package.order lists the `first` files first, then the packages that a reader needs
    first (such as UsersGuide), then all other classes in alphabetical order.
    """
    inside: dict[PurePath, set[str]] = {}
    for file in files:
        folder = file.parent
        inside.setdefault(folder, set())
        if file.stem != "package":
            inside[folder].add(file.stem)
        while folder.parts:
            inside.setdefault(folder.parent, set()).add(folder.name)
            folder = folder.parent
    ahead = {(f.parent, f.stem) for f in first}
    return {
        folder / "package.order": "".join(
            f"{n}\n"
            for n in sorted(names, key=lambda n, f=folder: ((f, n) not in ahead, *_key(n)))  # type: ignore[misc]
        )
        for folder, names in inside.items()
    }


def _key(name: str) -> tuple[int, str]:
    return (_FIRST.index(name) if name in _FIRST else len(_FIRST), name)


_FOLDER = PurePath("Resources", "Scripts", "OpenModelica")
_WHERE = "run with omc in a folder of its own, with HystFMU or a link to it in it."
_LOAD = 'loadFile("HystFMU/package.mo"); getErrorString();'


def scripts(texts: Mapping[str, str]) -> dict[PurePath, str]:
    """Return the text of every OpenModelica script, by its path relative to the folder of a library.

    `texts` contains the text of each class by its name inside HystFMU.
    """
    operators = [m for r in REALISATIONS for m in sorted(texts) if m.startswith(f"Validation.{r}.")]
    examples = [m for m in sorted(texts) if m.startswith("Examples.")]
    return {
        _FOLDER / "Check.mos": _script("Checks the whole library", ["checkAllModelsRecursive(HystFMU)"]),
        _FOLDER / "Examples.mos": _script("Simulates every example", _simulations(examples, texts)),
        _FOLDER / "Operators.mos": _script(
            "Simulates the Validation models of every operator", _simulations(operators, texts)
        ),
    }


def _simulations(models: list[str], texts: Mapping[str, str]) -> list[str]:
    return [f"simulate(HystFMU.{m}, {_settings(texts[m])})" for m in models if not m.endswith(".package")]


def _settings(text: str) -> str:
    """Return the arguments of ``simulate`` for the experiment of a model.

    The number of intervals is rounded here, because OpenModelica truncates the quotient of stop time and interval.
    """
    found = re.search(r"experiment\(StopTime = ([^,]+), Interval = ([^,]+), Tolerance = ([^)]+)\)", text)
    assert found is not None
    stop, interval, tolerance = map(float, found.groups())
    intervals = round(stop / interval)
    return f"stopTime = {number(stop)}, numberOfIntervals = {intervals}, tolerance = {number(tolerance)}"


def _script(what: str, calls: list[str]) -> str:
    return "\n".join([f"// {what}: {_WHERE}", _LOAD, *(f"{c}; getErrorString();" for c in calls), ""])


_PHYSICAL = re.compile(r"connect\(\w+\.(?:pin|flange)")  # connection of a model with physical ports


def generated(root: Path) -> dict[PurePath, str]:
    """Return the text of each generated file, by its path relative to `root`, the folder HystFMU.

    The result also contains files without the mark of `make generate` if they are stale: hand-written files to which
    lines of connections are added, and records of identified models.
    """
    shelf = Shelf(root)
    classes = {b.path: b.text(shelf) for b in base_classes()}
    classes |= {f"{b.package}.BaseClasses.package": package(b.package) for b in base_classes()}
    classes |= validation.models(shelf, classes)
    classes |= enumerations()
    classes |= _page_of_checks(root)
    every_text = nested({**shelf.texts, **classes})
    classes = {name: drawn(text, name, every_text) for name, text in classes.items()}
    by_hand = {name: drawn(text, name, every_text) for name, text in {**shelf.texts, **records(shelf)}.items()}
    classes |= {name: text for name, text in by_hand.items() if text != shelf.texts[name]}
    made = {_file(name): text for name, text in classes.items()}
    every = {*made, *map(_file, shelf.texts)}
    made |= orders(
        every, {_file(n) for n, text in every_text.items() if n.startswith("Examples.") and _PHYSICAL.search(text)}
    )
    made |= pictures({**shelf.texts, **classes})
    made |= scripts({**shelf.texts, **classes})
    return made


def _file(name: str) -> PurePath:
    return PurePath(*name.split(".")).with_suffix(".mo")


def _on_disk(root: Path) -> dict[PurePath, str]:
    """Return the text of each file on disk that is marked as generated, a package.order, a script or a picture."""
    found = {}
    for pattern in ("*.mo", "package.order", "*.mos", "Resources/Images/*.svg"):
        for file in root.rglob(pattern):
            text = file.read_text("utf-8")
            if file.suffix != ".mo" or is_generated(text):
                found[PurePath(file.relative_to(root))] = text
    return found


def missing(root: Path) -> list[str]:
    """Return one message for each block whose hand-written file with equations is missing."""
    shelf = Shelf(root)
    return [
        f"write {b.wanted}: the equations of the block {b.block.name}, which extend BaseClasses.{b.name}"
        for b in base_classes()
        if b.equations not in shelf.texts
    ]


def stale(root: Path) -> list[PurePath]:
    """Return the paths of generated files that are missing on disk, differ from the new text, or are obsolete."""
    made, there = generated(root), _on_disk(root)
    return sorted(f for f in {*made, *there} if made.get(f) != there.get(f))


def write(root: Path) -> None:
    """Write all generated files, and remove obsolete generated files."""
    made = generated(root)
    for file in _on_disk(root):
        if file not in made:
            (root / file).unlink()
    for file, text in made.items():
        (root / file).parent.mkdir(parents=True, exist_ok=True)
        (root / file).write_text(text, "utf-8", newline="\n")


_RULES = "modelica/rules.toml"
_APART = {
    "conventions": "Modelica.UsersGuide.Conventions",
    "compiler": "silent errors of one compiler",
    "house": "of this library",
}


def _page_of_checks(root: Path) -> dict[str, str]:
    """Return the page by its name inside HystFMU.

    `root` is the folder of the library. The table of rules, ``rules.toml``, is next to this folder.
    """
    table = tomllib.loads((root.parent / "rules.toml").read_text("utf-8"))
    rows = sorted(table.items(), key=lambda row: _by_section(row[1]["section"]))
    listed = "\n".join(
        f"<tr><td>{_APART.get(row['section'], row['section'])}</td><td>{name}</td>"
        f"<td>{escape(row['text'], quote=False)}.</td></tr>"
        for name, row in rows
    )
    info = f'''"<html>
<p>Different tools detect different faults. <code>make modelica-strict</code> checks every class by these rules, the
tests every exported package; numbers are sections of the Modelica Language Specification 3.6. Each rule has a test that
inserts a fault and checks that the lint reports it.</p>
<table>
<tr><th>Section</th><th>Rule</th><th>What it asks for</th></tr>
{listed}
</table>
</html>"'''
    before, lines = 'preferredView = "info", DocumentationClass = true, ', ["  extends Icons.Information;"]
    page = class_text("package Checks", "Checks of every class", lines, info, "HystFMU.UsersGuide", before)
    return {"UsersGuide.Checks": f"{mark(_RULES)}\n{page}"}


def _by_section(section: str) -> tuple[bool, list[int], str]:
    numbers = [int(n) for n in section.split(".") if n.isdigit()]
    return not numbers, numbers, section
