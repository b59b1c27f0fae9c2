"""Mutation testing of five rooms: `make mutants`, or `run.py --seed 7 --each 110`.

A small change is made in one file of a copy of the repository; the tests that run the line must fail.  What does not
compile is invalid; what compiles to the same code or library, or is listed in equivalents.toml with a reason, is no
mutant: neither counts.  Each verdict is a line of the journal, so that an interrupted run goes on.

mutmut and cosmic-ray know Python only and draw no sample; universalmutator rewrites text, so that most of its mutants
of C are invalid; mull needs its own clang.  A fork that has loaded the libraries and runs the tests of one line takes a
second, a new process with the tests of a room a minute.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import pytest
from mutation import equivalents, python_operators, sample, summary
from mutation.choose import PATHS, Tests, group
from mutation.judge import Outcome, judge
from mutation.mutant import Mutant
from mutation.session import OPTIONS, Warm, run_cold
from mutation.swap import loaded_functions, swap_core, swap_python
from mutation.tree import LIBRARIES, Tree

ROOT = Path(__file__).parents[2]
WORK = ROOT / "build" / "mutants"
HEAVY = "numpy scipy.optimize scipy.signal scipy.linalg scipy.stats pydantic fmpy click hypothesis torch optuna control"
NEW_START = "needs a new start"
Judged = tuple[str, str]  # verdict, and who gave it


def map_python(target: Path) -> None:
    """Run the tests of the Python rooms once, to see which of them run which lines."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "mutation.cover", "-p", "no:cacheprovider", *PATHS["python"]]
    environment = {**os.environ, "HYSTFMU_COVER": str(target), "PYTHONPATH": str(Path(__file__).parents[1])}
    subprocess.run(command, cwd=ROOT, env=environment, check=False)


class Run:
    """The mutants of one seed, run in one tree, written to one journal."""

    def __init__(self, seed: int, each: int, tree: Tree) -> None:
        self.seed, self.each, self.tree = seed, each, tree
        self.journal = WORK / f"seed-{seed}.jsonl"
        self.known = equivalents.listed()

    def room(self, room: str) -> None:
        """Judge the mutants of a room: in a process that has collected its tests, then those that need a new one."""
        child = os.fork()
        if child == 0:
            code = 1
            try:
                code = pytest.main([*OPTIONS, *PATHS[group(room)]], plugins=[Warm(lambda warm: self._warm(room, warm))])
            finally:
                os._exit(code)
        if code := os.waitpid(child, 0)[1]:
            raise SystemExit(f"{room}: ended with status {code}")
        self._all(room, lambda m, text, stage: run_cold(stage))

    def _warm(self, room: str, warm: Warm) -> None:
        table = WORK / f"{group(room)}.json"
        if not table.exists():  # of a C room: which tests pass, and how long they take
            tests = list(warm.items)
            outcome = judge(lambda: warm.run(tests, all_=True), self.tree.folder, 900)
            if not outcome.seconds:
                raise SystemExit(f"{room}: the tests do not run without a mutant: {outcome.failed}")
            seconds = {t: s for t, s in outcome.seconds.items() if t not in outcome.failures}
            table.write_text(json.dumps({"seconds": seconds, "lines": {}, "failed": outcome.failures}))

        loaded = loaded_functions(self.tree.folder / "python")

        def run(m: Mutant, text: str, stage: list[str]) -> Outcome:
            if room in LIBRARIES:
                swap_core(self.tree.library("_core"))
            elif not swap_python(self.tree.folder / m.file, text, m.apply(text), loaded):
                return Outcome(NEW_START)
            return warm.run(stage)

        self._all(room, run)

    def _all(self, room: str, run: Callable[[Mutant, str, list[str]], Outcome]) -> None:
        tests = Tests(ROOT, WORK / f"{group(room)}.json")
        with self.journal.open("a") as out:
            for m in self._open(room):
                before, text = time.monotonic(), (ROOT / m.file).read_text()
                said = self._before(m, text, room) or self._judged(m, text, tests, run)
                if said[1] == NEW_START:
                    continue
                old, new = m.change(text)
                row = {
                    "room": room, "file": m.file, "line": m.line(text), "kind": m.kind, "old": old, "new": new,
                    "verdict": said[0], "by": said[1], "seconds": round(time.monotonic() - before, 2),
                    "start": m.start, "end": m.end, "replaced_by": m.new,
                }  # fmt: skip
                out.write(json.dumps(row) + "\n")
                out.flush()

    def _open(self, room: str) -> Iterator[Mutant]:
        """Yield the mutants without a row, file by file, until enough are decided."""
        order = sample.sequence(ROOT, room, self.seed)
        place = decided = 0
        while decided < self.each and place < len(order):
            some = order[place : place + self.each - decided]
            place += len(some)
            for m in sorted(some, key=lambda m: (m.file, m.start)):
                if self._row(m) is None:
                    yield m
                decided += (self._row(m) or {"verdict": NEW_START})["verdict"] in ("killed", "survived", NEW_START)

    def _row(self, m: Mutant) -> dict[str, str] | None:
        return self._rows().get((m.file, m.start, m.end, m.new))

    def _rows(self) -> dict[tuple[str, int, int, str], dict[str, str]]:
        return {(r["file"], r["start"], r["end"], r["replaced_by"]): r for r in summary.rows(self.journal)}

    def _before(self, m: Mutant, text: str, room: str) -> Judged | None:
        """Return the verdict that needs no test, or None with the mutant in the tree, built."""
        new = m.apply(text)
        if room not in LIBRARIES and not python_operators.valid(new):
            return "invalid", "syntax"
        if room not in LIBRARIES and python_operators.same(text, new):
            return "equivalent", "same code"
        if reason := self.known.get((m.file, *m.change(text))):
            return "listed", reason
        self.tree.apply(m)
        if room in LIBRARIES:
            library = LIBRARIES[room]
            if not self.tree.build(library):
                return "invalid", "compiler"
            if self.tree.hash(library) == self.tree.original[library]:
                return "equivalent", "same library"
        return None

    def _judged(self, m: Mutant, text: str, tests: Tests, run: Callable[[Mutant, str, list[str]], Outcome]) -> Judged:
        for stage in tests.for_mutant(m, text):
            seconds = 10 + 4 * sum(tests.seconds[t] for t in stage)
            outcome = judge(lambda stage=stage: run(m, text, stage), self.tree.folder, seconds)  # type: ignore[misc]
            if outcome.failed:
                tests.killed(m, outcome.failed)
                return "killed", outcome.failed
        return "survived", ""


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    parser.add_argument("--each", type=int, default=110, help="decided mutants per room")
    parser.add_argument("--rooms", nargs="+", default=list(sample.ROOMS), choices=list(sample.ROOMS))
    given = parser.parse_args()
    WORK.mkdir(parents=True, exist_ok=True)
    os.environ.setdefault("HYSTFMU_DATA", str(ROOT.parent / "shared" / "data"))
    table = WORK / "python.json"
    if not table.exists() and not set(given.rooms) <= LIBRARIES.keys():
        map_python(table)
    tree = Tree(ROOT, WORK / "tree")
    os.chdir(tree.folder)
    sys.dont_write_bytecode = True  # a mutant may have the size and the second of its file
    os.environ.update(tree.environment)
    sys.path.insert(0, str(tree.folder / "python"))
    sys.meta_path[:] = [f for f in sys.meta_path if "editable" not in type(f).__module__]
    for name in () if set(given.rooms) <= LIBRARIES.keys() else HEAVY.split():
        __import__(name)
    run = Run(given.seed, given.each, tree)
    try:
        for room in given.rooms:
            run.room(room)
    finally:
        tree.restore()
    some = summary.rows(run.journal)
    print(summary.table(some), summary.survivors(some), sep="\n\n")


if __name__ == "__main__":
    main()
