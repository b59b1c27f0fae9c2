"""Mutation testing of the rooms in `sample.ROOMS`: `make mutants`, or `run.py --seed 7 --each 110`.

A small change is made in one file of a copy of the repository; the tests that run the line must fail.  What does not
compile is invalid; what compiles to the same code or library, or is listed in equivalents.toml with a reason, is no
mutant: neither counts.  Each verdict is a line of the journal, so that an interrupted run goes on.

mutmut and cosmic-ray know Python only and draw no sample; universalmutator rewrites text, so that most of its mutants
of C are invalid; mull needs its own clang.  A fork that has loaded the libraries and runs the tests of one line takes a
second, a new process with the tests of a room a minute.
"""

import argparse
import contextlib
import fcntl
import json
import os
import shutil
import signal
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import pytest
from mutation import equivalents, python_operators, sample, summary
from mutation.calls import Calls
from mutation.children import unconfine
from mutation.choose import PATHS, Tests, group
from mutation.judge import Outcome, judge
from mutation.line_map import Table, covered, refresh
from mutation.mutant import Mutant
from mutation.session import OPTIONS, Warm, run_cold
from mutation.swap import loaded_functions, swap_core, swap_python
from mutation.tree import LIBRARIES, Tree

ROOT = Path(__file__).parents[2]
WORK = ROOT / "build" / "mutants"
HEAVY = "numpy scipy.optimize scipy.signal scipy.linalg scipy.stats pydantic fmpy click hypothesis torch optuna control"
NEW_START = "needs a new start"
Verdict = tuple[str, str]  # and who gave it
RunTests = Callable[[Mutant, str, list[str]], Outcome]


class Run:
    """The mutants of one seed, run in one tree, written to one journal."""

    def __init__(self, seed: int, each: int, tree: Tree) -> None:
        self.seed, self.each, self.tree = seed, each, tree
        self.journal = WORK / f"seed-{seed}.jsonl"
        self.known = equivalents.listed()
        # files may have changed since: their rows are of other mutants
        rows = [r for r in summary.rows(self.journal) if r["code"] == tree.code(r["file"])]
        self.journal.write_text("".join(json.dumps(r) + "\n" for r in rows))

    def room(self, room: str) -> None:
        """Judge the mutants of a room: in a process that has collected its tests, then those that need a new one."""
        for library in LIBRARIES.values():  # the last mutant of another room is still built
            self.tree.build(library)
        child = os.fork()
        if child == 0:
            code = 1
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            try:
                code = pytest.main([*OPTIONS, *PATHS[group(room)]], plugins=[Warm(lambda warm: self._warm(room, warm))])
            finally:
                os._exit(code)
        try:
            if code := os.waitpid(child, 0)[1]:
                raise SystemExit(f"{room}: ended with status {code}")
        except BaseException:
            with contextlib.suppress(ProcessLookupError):
                os.kill(child, signal.SIGTERM)
            raise
        self._all(room, lambda m, text, chosen: run_cold(chosen))

    def _warm(self, room: str, warm: Warm) -> None:
        if room in LIBRARIES:
            self._map_calls(room, warm)
        loaded = loaded_functions(self.tree.folder / "python")

        def run(m: Mutant, text: str, chosen: list[str]) -> Outcome:
            if room in LIBRARIES:
                swap_core(self.tree.library("_core"))
            elif not swap_python(self.tree.folder / m.file, text, m.apply(text), loaded):
                return Outcome(NEW_START)
            return warm.run(chosen)

        try:
            self._all(room, run)
        finally:
            self.tree.restore()  # the process that goes on does not know of the last mutant

    def _map_calls(self, room: str, warm: Warm) -> None:
        """Bring the map of a C room up to date with its tests, by a fork that runs them on an instrumented library."""
        by_module: dict[str, list[str]] = {}
        for test in warm.items:
            by_module.setdefault(test.partition("::")[0], []).append(test)

        def make(stale: list[str]) -> Table:
            tests, library = [t for m in stale for t in by_module[m]], LIBRARIES[room]
            calls = Calls(self.tree.folder, library, WORK / "calls")

            def work() -> Outcome:
                target = self.tree.library(library)
                target.unlink()
                shutil.copyfile(calls.library, target)
                calls.begin(-1)  # a library asks for the folder when it is loaded
                swap_core(self.tree.library("_core"))
                unconfine(lambda: False)
                return warm.run(tests, calls.begin)

            try:
                outcome = judge(work, self.tree.folder, 1200)
            finally:
                self.tree.build(library)
            if not outcome.seconds:
                raise SystemExit(f"{room}: the tests do not run without a mutant: {outcome.failed}")
            good = {t: s for t, s in outcome.seconds.items() if t not in outcome.failures}
            lines = {
                f: {k: [t for t in some if t in good] for k, some in d.items()} for f, d in calls.lines(tests).items()
            }
            if not any(map(any, (d.values() for d in lines.values()))):
                raise SystemExit(f"{room}: no call of a function was seen")
            return {"seconds": good, "lines": lines, "codes": {f: self.tree.code(f) for f in lines}}

        refresh(ROOT, list(by_module), WORK / f"{room}.json", make)

    def _all(self, room: str, run: RunTests) -> None:
        tests = Tests(WORK / f"{group(room)}.json")
        with self.journal.open("a") as out:
            for m in self._open(room):
                before, text = time.monotonic(), self.tree.texts[m.file]
                said = self._before(m, text, room) or self._by_tests(m, text, tests, run)
                if said[1] == NEW_START:
                    continue
                old, new = m.change(text)
                row = {
                    "room": room, "file": m.file, "line": m.line(text), "kind": m.kind, "old": old, "new": new,
                    "verdict": said[0], "by": said[1], "seconds": round(time.monotonic() - before, 2),
                    "start": m.start, "end": m.end, "replaced_by": m.new,
                    "code": self.tree.code(m.file),
                }  # fmt: skip
                out.write(json.dumps(row) + "\n")
                out.flush()

    def _open(self, room: str) -> Iterator[Mutant]:
        """Yield the mutants without a row, file by file, until enough are decided."""
        order = sample.sequence(self.tree.texts, room, self.seed)
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

    def _before(self, m: Mutant, text: str, room: str) -> Verdict | None:
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

    def _by_tests(self, m: Mutant, text: str, tests: Tests, run: RunTests) -> Verdict:
        chosen = tests.for_mutant(m, text)
        seconds = 10 + 4 * sum(tests.seconds[t] for t in chosen)
        outcome = judge(lambda: run(m, text, chosen), self.tree.folder, seconds) if chosen else Outcome()
        if outcome.failed:
            tests.killed(m, outcome.failed)
        return ("killed", outcome.failed) if outcome.failed else ("survived", "" if chosen else "no test runs it")


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    parser.add_argument("--each", type=int, default=110, help="decided mutants per room")
    parser.add_argument("--rooms", nargs="+", default=list(sample.ROOMS), choices=list(sample.ROOMS))
    given = parser.parse_args()
    WORK.mkdir(parents=True, exist_ok=True)
    os.environ.setdefault("HYSTFMU_DATA", str(ROOT.parent / "shared" / "data"))
    lock = (WORK / "lock").open("w")  # also held by the processes of an interrupted run that have not ended yet
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise SystemExit(f"another run uses {WORK}") from None
    python = not set(given.rooms) <= LIBRARIES.keys()
    if python:
        folders = [ROOT / f for f in PATHS["python"]]
        found = [p for f in folders for p in (sorted(f.rglob("test_*.py")) if f.is_dir() else [f])]
        modules = [str(p.relative_to(ROOT)) for p in found]
        refresh(ROOT, modules, WORK / "python.json", lambda stale: covered(ROOT, stale, WORK / "part.json"))
    tree = Tree(ROOT, WORK / "tree")
    os.chdir(tree.folder)
    sys.dont_write_bytecode = True  # a mutant may have the size and the second of its file
    os.environ.update(tree.environment)
    sys.path.insert(0, str(tree.folder / "python"))
    sys.meta_path[:] = [f for f in sys.meta_path if "editable" not in type(f).__module__]
    for name in HEAVY.split() if python else ():
        __import__(name)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
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
