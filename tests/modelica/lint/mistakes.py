"""Mistakes to seed into sound classes, from the table mistakes.txt: what is changed, who finds it, in which words."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path


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


MISTAKES = {m.kind: m for m in _rows(Path(__file__).with_suffix(".txt").read_text())}
