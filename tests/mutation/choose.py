"""Which tests judge a mutant, and in which order.

Python: the tests that run its line; for lines of a module body and of killed processes, the tests that run the file.
C: the tests of the folders below; for a block, or a header of some blocks, those that name one of these blocks.
"""

from __future__ import annotations

import functools
import json
import re
from collections import Counter, defaultdict
from pathlib import Path

from mutation import python_operators
from mutation.mutant import Mutant

BUDGET = 4.0  # CPU s of tests for one mutant, as measured when the map was made
MOST_BLOCKS = 12
MASTER = [f"tests/scenarios/test_{name}.py" for name in ("engines", "newton", "chunks", "substeps", "coupling")]
PATHS = {  # what may judge the rooms of one library or language; the rest of tests/c compiles everything anew
    "python": [f"tests/{name}" for name in ("study", "scenarios", "identify", "design", "data", "face")],
    "core": [*(f"tests/{name}" for name in ("contract", "blocks", "graph")), "tests/c/test_turning_points.py", *MASTER],
    "fmi": ["tests/fmu", "--ignore=tests/fmu/importers"],
}


def group(room: str) -> str:
    """Return the key of `PATHS` for a room."""
    return room if room in PATHS else "python"


class Tests:
    """The map of tests, and which of them killed."""

    def __init__(self, root: Path, table: Path) -> None:
        self.root = root
        told = json.loads(table.read_text())
        self.seconds: dict[str, float] = told["seconds"]
        self.lines: dict[str, dict[str, list[str]]] = told["lines"]
        self.size = Counter(t.partition("::")[0] for t in self.seconds)
        self.kills: dict[str, Counter[str]] = defaultdict(Counter)  # by file: modules and tests
        self.text = functools.cache(lambda module: (root / module).read_text())

    def for_mutant(self, mutant: Mutant, text: str) -> list[list[str]]:
        """Return the tests in three stages, each a run of its own: the likely ones, more of them, the rest."""
        found = self._python(mutant, text) if mutant.file.endswith(".py") else self._c(mutant.file)
        modules: dict[str, list[str]] = defaultdict(list)
        for t in found:
            modules[t.partition("::")[0]].append(t)
        kills = self.kills[mutant.file]
        stem = Path(mutant.file).stem

        def rank(module: str) -> float:
            tests = modules[module]
            alike = stem in module or Path(module).stem.removeprefix("test_") in mutant.file
            cost = sum(self.seconds[t] for t in tests)
            return -(3 * min(kills[module], 5) + 3 * alike + len(tests) / self.size[module] - 2 * min(cost / BUDGET, 1))

        stages: list[list[str]] = [[], [], []]
        spent = 0.0
        for k, module in enumerate(sorted(modules, key=rank)):
            stage = 0 if k < 2 else 1 if k < 6 else 2
            for t in sorted(modules[module], key=lambda t: (-kills[t], self.seconds[t])):
                if spent == 0 or spent + self.seconds[t] <= BUDGET:
                    stages[stage].append(t)
                    spent += self.seconds[t]
        return [s for s in stages if s]

    def killed(self, mutant: Mutant, test: str) -> None:
        """Remember who killed: it comes first for the next mutant of the file."""
        self.kills[mutant.file].update((test, test.partition("::")[0]))

    def _python(self, mutant: Mutant, text: str) -> set[str]:
        lines = self.lines.get(mutant.file, {})
        at = mutant.line(text)
        if any(first <= at <= last for first, last in python_operators.functions(text)):
            # a statement over several lines is counted at its first
            for line in range(at, max(at - 12, 0), -1):
                if line_tests := lines.get(str(line)):
                    return set(line_tests)
        return set().union(*lines.values())

    def _c(self, file: str) -> list[str]:
        found = list(self.seconds)
        if "/master/" in file:
            return [t for t in found if t.startswith(tuple(MASTER))]
        blocks = self._blocks(file)
        if not 0 < len(blocks) <= MOST_BLOCKS:
            return found
        words = re.compile("|".join({w for b in blocks for w in (b, b.title().replace("_", ""))}))
        return [t for t in found if words.search(t) or words.search(self.text(t.partition("::")[0]))]

    @functools.cache  # noqa: B019
    def _blocks(self, file: str) -> frozenset[str]:
        """Blocks whose C file is this file or includes it."""
        if file.endswith(".c"):
            return frozenset({Path(file).stem} if "core/blocks/" in file else ())
        return frozenset(s.stem for s in (self.root / "fmu_build/core/blocks").rglob("*/*.c") if file in self._seen(s))

    @functools.cache  # noqa: B019
    def _seen(self, source: Path) -> frozenset[str]:
        """Files of the repository that a C file includes, directly or not."""
        found = set()
        for name in re.findall(r'^#include "(.*)"', source.read_text(), re.MULTILINE):
            if (header := self.root / "fmu_build" / name).exists():
                found |= {f"fmu_build/{name}"} | self._seen(header)
        return frozenset(found)
