"""Generated files of a library, and the check whether the files on disk are up to date."""

from __future__ import annotations

import re
from pathlib import Path, PurePath

from hystfmu.modelica.library import checks, enumerations, scripts, validation
from hystfmu.modelica.library.base_class import base_classes, package
from hystfmu.modelica.library.order import orders
from hystfmu.modelica.library.pictures import pictures
from hystfmu.modelica.library.shelf import Shelf, is_generated
from hystfmu.modelica.library.wires import drawn, nested

_PHYSICAL = re.compile(r"connect\(\w+\.(?:pin|flange)")  # a model with physical ports


def generated(root: Path) -> dict[PurePath, str]:
    """Return the generated files, relative to the folder HystFMU `root`, and hand-written files with added lines."""
    shelf = Shelf(root)
    classes = {b.path: b.text(shelf) for b in base_classes()}
    classes |= {f"{b.package}.BaseClasses.package": package(b.package) for b in base_classes()}
    classes |= validation.models(shelf, classes)
    classes |= enumerations.enumerations()
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
    made |= scripts.scripts({**shelf.texts, **classes})
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
