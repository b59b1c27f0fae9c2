"""File package.order: content of a folder of the library. Packages are in reading order, all else is sorted by name."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from pathlib import PurePath

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
