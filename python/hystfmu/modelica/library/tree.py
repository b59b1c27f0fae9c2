"""Generated files of a library, among them package.order and scripts, and the search for stale files on disk."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path, PurePath

from hystfmu.modelica.library import checks, validation
from hystfmu.modelica.library.base_class import base_classes, enumerations, package
from hystfmu.modelica.library.declarations import number
from hystfmu.modelica.library.drawing import drawn, nested, pictures
from hystfmu.modelica.library.shelf import REALISATIONS, Shelf, is_generated

# packages, and pages of the guide, whose order means something
_FIRST = (
    *(
        "UsersGuide",
        "Operators",
        "Inverse",
        "Networks",
        "Dynamics",
        "Actuators",
        "Plants",
        "Control",
        "Loops",
        "Sources",
        "Functions",
    ),
    *("Data", "Examples", "Validation", "Interfaces", "Types", "Choices", "Icons"),
    *("BaseClasses", "Models", "Sampled", "Events", "Smooth"),
    *(
        "GettingStarted",
        "TutorialLoops",
        "TutorialRealisations",
        "TutorialExport",
        "TutorialActuator",
        "Realisations",
        "Conventions",
        "Checks",
        "ToolSupport",
        "References",
        "ReleaseNotes",
        "Contact",
        "License",
    ),
)


def orders(files: Iterable[PurePath], first: Collection[PurePath] = ()) -> dict[PurePath, str]:
    """Return every package.order for the .mo files of a library, relative to its folder; `first` files come first."""
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
    """Return every script by its path relative to the folder of a library, for classes by names below HystFMU."""
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
    """Return the experiment of a model with its number of intervals, because OpenModelica truncates the quotient."""
    found = re.search(r"experiment\(StopTime = ([^,]+), Interval = ([^,]+), Tolerance = ([^)]+)\)", text)
    assert found is not None
    stop, interval, tolerance = map(float, found.groups())
    intervals = round(stop / interval)
    return f"stopTime = {number(stop)}, numberOfIntervals = {intervals}, tolerance = {number(tolerance)}"


def _script(what: str, calls: list[str]) -> str:
    return "\n".join([f"// {what}: {_WHERE}", _LOAD, *(f"{c}; getErrorString();" for c in calls), ""])


_PHYSICAL = re.compile(r"connect\(\w+\.(?:pin|flange)")  # a model with physical ports


def generated(root: Path) -> dict[PurePath, str]:
    """Return the generated files, relative to the folder HystFMU `root`, and hand-written files with added lines."""
    shelf = Shelf(root)
    classes = {b.path: b.text(shelf) for b in base_classes()}
    classes |= {f"{b.package}.BaseClasses.package": package(b.package) for b in base_classes()}
    classes |= validation.models(shelf, classes)
    classes |= enumerations()
    classes |= checks.page(root)
    every_text = nested({**shelf.texts, **classes})
    classes = {name: drawn(text, name, every_text) for name, text in classes.items()}
    by_hand = {name: drawn(text, name, every_text) for name, text in shelf.texts.items()}
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
    """Return the files with the mark of generated files, and every package.order and script."""
    found = {}
    for pattern in ("*.mo", "package.order", "*.mos", "Resources/Images/*.svg"):
        for file in root.rglob(pattern):
            text = file.read_text("utf-8")
            if file.suffix != ".mo" or is_generated(text):
                found[PurePath(file.relative_to(root))] = text
    return found


def missing(root: Path) -> list[str]:
    """Return a message for each block whose file with equations is missing."""
    shelf = Shelf(root)
    return [
        f"write {b.wanted}: the equations of the block {b.block.name}, which extend BaseClasses.{b.name}"
        for b in base_classes()
        if b.equations not in shelf.texts
    ]


def stale(root: Path) -> list[PurePath]:
    """Return the generated files that are missing, differ or are obsolete."""
    made, there = generated(root), _on_disk(root)
    return sorted(f for f in {*made, *there} if made.get(f) != there.get(f))


def write(root: Path) -> None:
    """Write the generated files, and remove obsolete ones."""
    made = generated(root)
    for file in _on_disk(root):
        if file not in made:
            (root / file).unlink()
    for file, text in made.items():
        (root / file).parent.mkdir(parents=True, exist_ok=True)
        (root / file).write_text(text, "utf-8", newline="\n")
