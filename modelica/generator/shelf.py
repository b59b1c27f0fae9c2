"""Hand-written files of the library, indexed by class name, and its types, indexed by unit of measure."""

import functools
import re
from collections.abc import Iterator
from pathlib import Path

_MARKED = re.compile(r"// generated from .* by `make generate` - do not edit\n")
REALISATIONS = ("Sampled", "Events", "Smooth")
_UNIT = re.compile(r'type (\w+) = Real\([^)]*final unit = "([^"]+)"')


def mark(source: str) -> str:
    """Return the first line of a generated file."""
    return f"// generated from {source} by `make generate` - do not edit"


def is_generated(text: str) -> bool:
    """Return whether the first line marks a generated file."""
    return _MARKED.match(text) is not None


class Shelf:
    """Index of the hand-written files of a library.

    Parameters
    ----------
    root : Path
        Folder HystFMU of the library.
    """

    def __init__(self, root: Path) -> None:
        self.root = root

    @functools.cached_property
    def texts(self) -> dict[str, str]:
        """Text of each hand-written file by its class name inside HystFMU, such as ``Operators.Sampled.PlayBank``."""
        found = {}
        for file in sorted(self.root.rglob("*.mo")):
            text = file.read_text("utf-8")
            if not is_generated(text):
                found[".".join(file.relative_to(self.root).with_suffix("").parts)] = text
        return found

    @functools.cached_property
    def types(self) -> dict[str, str]:
        """Name of the Modelica type for each unit of measure, for example ``Types.Time`` for ``s``."""
        return {unit: f"Types.{name}" for name, unit in _UNIT.findall(self.texts["Types"])}

    def classes(self, name: str) -> list[str]:
        """Return the full names of the classes `name`: one name, or one name for each realisation."""
        single = [n for n in self.texts if re.fullmatch(rf"(?!Validation|Examples|Functions)\w+\.{name}", n)]
        realised = [f"{package}.{r}.{name}" for package in ("Operators", "Inverse") for r in REALISATIONS]
        return single + [n for n in realised if n in self.texts]

    def examples(self, classes: list[str]) -> Iterator[str]:
        """Return the names of the Examples that use at least one of these classes."""
        for name, text in self.texts.items():
            if name.startswith("Examples.") and any(re.search(rf"\b{re.escape(c)}\b", text) for c in classes):
                yield name
