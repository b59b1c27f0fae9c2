"""Which tests judge a mutant, and in which order.

Those that run its line (Python) or its function (C); for a line outside functions, or of a process that is killed,
those that run anything of the file.  Rows of a table are data, read when a module is imported, before any test: those
that read all tables see them too.  A module that compiles headers by itself runs them where no call is counted: it
judges every line of them.
"""

import json
from collections import Counter, defaultdict
from pathlib import Path

from mutation import python_operators
from mutation.mutant import Mutant

BUDGET = 8.0  # CPU s of tests for one mutant, as measured when the map was made
MOST_LINES = 12  # of a statement
CHOICE = "tests/identify/choice"
TABLES = {
    "fmu_build/core/blocks/": tuple(
        f"tests/contract/test_{n}.py" for n in ("block_table", "generated", "limits_that_meet")
    ),
    "python/hystfmu/identify/": (f"{CHOICE}/test_option_tables.py", f"{CHOICE}/test_results_are_frozen.py"),
    "python/hystfmu/studies/": (f"{CHOICE}/test_results_are_frozen.py", "tests/study/test_study_spec.py"),
}
_CONFINED = tuple(f"tests/base/test_{n}.py" for n in ("child", "confined", "escapes", "kernel_numbers"))
UNCOUNTED = {
    "fmu_build/core/elementary/": ("tests/c/test_elementary.py", "tests/c/test_numerics.py"),
    "python/hystfmu/base/confine.py": _CONFINED,
    "python/hystfmu/base/supervisor.py": _CONFINED,
}
OWN = {  # the tests that are about a room; others run its lines for their own sake
    "studies": "tests/study/", "scenario": "tests/scenarios/", "inverse": "tests/graph/test_inverse",
    "identify": "tests/identify/", "design": "tests/design/", "start": "tests/start/", "base": "tests/base/",
    "data": "tests/data/",
}  # fmt: skip
MASTER = [
    *(f"tests/scenarios/test_{name}.py" for name in ("engines", "newton", "chunks", "substeps")),
    "tests/scenarios/foreign/test_members.py",  # units that are FMUs
]
PATHS = {  # what may judge the rooms of one library or language; the rest of tests/c compiles everything anew
    "python": [
        *(f"tests/{name}" for name in ("study", "scenarios", "identify", "design", "data", "face", "start", "base")),
        "tests/graph/test_inverse.py", "tests/graph/test_inverse_dynamics.py"],
    "core": [
        *(f"tests/{name}" for name in ("contract", "blocks", "graph")), "tests/identify/estimate/test_sensitivities.py",
        "tests/c/test_turning_points.py", "tests/c/test_elementary.py", "tests/c/test_numerics.py", *MASTER],
    "fmi": ["tests/fmu", "--ignore=tests/fmu/importers"],
    "container": [f"tests/scenarios/test_{name}.py" for name in ("container", "drawn_units")],
}  # fmt: skip


def group(room: str) -> str:
    """Return the key of `PATHS` for a room."""
    return room if room in PATHS else "python"


class Tests:
    """The map of tests, and which of them killed."""

    def __init__(self, table: Path) -> None:
        told = json.loads(table.read_text())
        self.seconds: dict[str, float] = told["seconds"]
        self.lines: dict[str, dict[str, list[str]]] = told["lines"]
        self.kills: dict[str, Counter[str]] = defaultdict(Counter)  # by file: modules and tests

    def for_mutant(self, mutant: Mutant, text: str) -> list[str]:
        """Return the tests in their order, as many as the budget holds: what killed, what is about the file, the rest.

        One that alone is longer than the budget comes after the others, unless it has killed before.
        """
        kills, stem = self.kills[mutant.file], Path(mutant.file).stem
        own = OWN.get(mutant.file.removeprefix("python/hystfmu/").partition("/")[0], "?")

        def rank(test: str) -> tuple[int, bool, bool, float]:
            module, seconds = test.partition("::")[0], self.seconds[test]
            alike = stem in test or Path(module).stem.removeprefix("test_") in mutant.file or test.startswith(own)
            return -kills[test] - min(kills[module], 2), seconds > BUDGET, not alike, seconds

        chosen: list[str] = []
        spent = 0.0
        for t in sorted(self._found(mutant, text) | self._uncounted(mutant), key=rank):
            if spent == 0 or spent + self.seconds[t] <= BUDGET:
                chosen.append(t)
                spent += self.seconds[t]
        return chosen

    def killed(self, mutant: Mutant, test: str) -> None:
        """Remember who killed: it comes first for the next mutant of the file."""
        self.kills[mutant.file].update((test, test.partition("::")[0]))

    def _uncounted(self, mutant: Mutant) -> set[str]:
        modules = {module for folder, some in UNCOUNTED.items() if mutant.file.startswith(folder) for module in some}
        return {t for t in self.seconds if t.partition("::")[0] in modules}

    def _found(self, mutant: Mutant, text: str) -> set[str]:
        lines = self.lines.get(mutant.file, {})
        at = mutant.line(text)
        if mutant.file.endswith((".c", ".h")) and str(at) in lines and _in_c_function(at, text):
            return set(lines[str(at)])
        if mutant.file.endswith(".py") and (first := _function(at, text)):
            for line in range(at, max(at - MOST_LINES, first - 1), -1):  # a statement is counted at its first line
                if some := lines.get(str(line)):
                    return set(some)
        every = set().union(*lines.values())
        readers = {module for folder, some in TABLES.items() if mutant.file.startswith(folder) for module in some}
        every |= {t for t in self.seconds if t.partition("::")[0] in readers}
        return every or (set() if mutant.file.endswith(".py") else set(self.seconds))


def _in_c_function(line: int, text: str) -> bool:
    """Whether a line lies between the margin line of a function and its last brace; rows of a table do not."""
    inside = False
    for k, row in enumerate(text.splitlines(), 1):
        opens = row[:1].isalpha() and "{" in row
        inside = inside or opens
        if k == line:
            return inside
        if row.startswith("}") or (opens and row.rstrip().endswith("}")):
            inside = False
    return False


def _function(line: int, text: str) -> int:
    """Return the first line of the innermost function that contains a line; 0 if there is none."""
    return max((a for a, b in python_operators.functions(text) if a <= line <= b), default=0)
