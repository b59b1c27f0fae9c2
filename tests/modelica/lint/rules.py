"""`make modelica-strict`: every rule of the lint with its section, and what it finds in the library; 1 if anything.

`make check` calls it with -q: complaints alone.

What OpenModelica and Dymola refuse or mark, and the compiler of the tests does not notice.
"""

import sys
import tomllib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

sys.path += [str(Path(__file__).parent), str(Path(__file__).parent / "reading"), str(Path(__file__).parents[1])]

import form
import library
import lint

TABLE = library.ROOT.parent / "rules.toml"


@dataclass(frozen=True)
class Rule:
    """A row of the table: section of the Modelica Language Specification 3.6, and what is checked."""

    name: str
    section: str
    text: str


def table() -> list[Rule]:
    """The rules in the order of the file."""
    return [Rule(name, **row) for name, row in tomllib.loads(TABLE.read_text()).items()]


def found() -> list[str]:
    """Every complaint about the library, beginning with the name of its rule."""
    messages = [m for c in library.classes().values() for m in lint.complaints(c)]
    for file in library.files():
        messages += [f"place_of_file: {m}" for m in form.place_complaints(file, library.ROOT.parent)]
        messages += [f"encoding: {m}" for m in form.encoding_complaints(file)]
    for folder in folders():
        messages += [f"package_order: {m}" for m in form.order_complaints(folder)]
    return messages


def folders() -> list[Path]:
    """Every package of the library that is a folder."""
    return [library.ROOT, *(d for d in library.ROOT.rglob("*") if d.is_dir() and "Resources" not in d.parts)]


def main(quiet: bool = False) -> int:
    messages = found()
    if quiet:
        print(*messages, sep="\n", end="\n" if messages else "")
        return 1 if messages else 0
    count = Counter(m.split(":")[0] for m in messages)
    for rule in sorted(
        table(), key=lambda r: (not r.section[0].isdigit(), [int(x) for x in r.section.split(".") if x.isdigit()])
    ):
        print(f"{rule.section:9} {rule.name:22} {count[rule.name]:4}  {rule.text}")
    print("", *messages, f"{len(library.classes())} classes, {len(messages)} complaints", sep="\n")
    return 1 if messages else 0


if __name__ == "__main__":
    sys.exit(main(quiet="-q" in sys.argv))
