"""Simulate a model of the library with rumoca in another process, and read its trajectory at sample instants.

Another process with a time limit, because a panic of the compiler is a BaseException and a solver may hang.
"""

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import library
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
INSTANT = 1e-9  # s
SCRIPT = [sys.executable, Path(__file__).with_name("run_model.py")]
# against a solver that hangs: far above what a busy machine needs
TIME_LIMIT = 900.0  # of one model
LOAD_LIMIT = 1800.0  # all classes together


@dataclass(frozen=True)
class Trajectory:
    """Rows of a simulation; an event has two rows of the same time, its left and its right limit."""

    values: dict[str, Array]
    seconds: float = 0.0  # that compiling and simulating took

    def instants(self) -> dict[str, Array]:
        """The last row of each instant: rows closer than 1 ns belong to the events of one.

        An extremum that is flat has two crossings of the rate there and six rows, whose values differ by rounding.
        """
        last = np.diff(self.values["time"], append=np.inf) > INSTANT
        return {k: v[last] for k, v in self.values.items()}

    @property
    def events(self) -> int:
        """Number of instants with an event."""
        apart = np.diff(self.values["time"], prepend=-np.inf, append=np.inf) > INSTANT
        return int(np.count_nonzero(apart[:-1] & ~apart[1:]))

    def at(self, h: float, side: str = "right") -> dict[str, Array]:
        """Values at 0, h, 2 h, ...: the right limit (after the event) or the left one (before it)."""
        t = self.values["time"]
        n = int(np.floor(t[-1] / h * (1 + 1e-9)))  # the last instant may lack its event: leave it out
        instants = h * np.arange(n)
        near = 1e-6 * h
        rows = np.searchsorted(t, instants + near) - 1 if side == "right" else np.searchsorted(t, instants - near)
        assert np.abs(t[rows] - instants).max() < near, "the simulation has no row at a sample instant"
        return {k: v[rows] for k, v in self.values.items()}


class Compiler:
    """A process of `run_model.py --serve`, started at the first request and anew after a crash, a panic or a hang."""

    def __init__(self) -> None:
        self.process: subprocess.Popen[str] | None = None

    def ask(self, *request: str | Path) -> str:
        """What the compiler or the solver complains about, or ""."""
        if self.process is None:
            self.said = tempfile.TemporaryFile("w+")  # noqa: SIM115
            pipe = subprocess.PIPE
            self.process = subprocess.Popen([*SCRIPT, "--serve"], stdin=pipe, stdout=pipe, stderr=self.said, text=True)
        process = self.process
        assert process.stdin is not None
        assert process.stdout is not None
        watch = threading.Timer(TIME_LIMIT, process.kill)
        watch.start()
        with contextlib.suppress(BrokenPipeError):
            print(json.dumps([str(a) for a in request]), file=process.stdin, flush=True)
        answer = process.stdout.readline()
        watch.cancel()
        complaint, ends = json.loads(answer) if answer else (f"exit status {process.wait()}", True)
        if ends:
            complaint += self.end()
        return str(complaint)[:2000]

    def end(self) -> str:
        """Wait for the process, if there is one; what it said beside its answers."""
        if self.process is None:
            return ""
        with contextlib.suppress(BrokenPipeError):
            self.process.communicate()
        self.process = None
        with self.said as file:
            file.seek(0)
            return file.read()


COMPILER = Compiler()


def rumoca(*arguments: str | Path, packages: Sequence[Path] = (library.ROOT,)) -> str:
    """Simulate a model that uses `packages`; the complaint, or "".

    Arguments: FILE MODEL STOP STEP TOLERANCE OUT.npz [START [SOLVER]].
    """
    return COMPILER.ask(os.pathsep.join(map(str, packages)), *arguments)


def solve(file: Path, name: str, *settings: float | str, packages: Sequence[Path] = (library.ROOT,)) -> Trajectory:
    """Simulate the class `name` of a file, which must succeed; settings: STOP STEP TOLERANCE [START [SOLVER]]."""
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "result.npz"
        stop, step, tolerance, *more = (s if isinstance(s, str) else repr(float(s)) for s in settings)
        complaint = rumoca(file, name, stop, step, tolerance, out, *more, packages=packages)
        assert not complaint, f"{name}: rumoca says: {complaint}"
        with np.load(out) as stored:
            return Trajectory({k: stored[k] for k in stored.files}, time.perf_counter() - began)


def solve_text(text: str, *settings: float | str, packages: Sequence[Path] = (library.ROOT,)) -> Trajectory:
    """Simulate the last class of a text, as `solve` does."""
    name = text.rstrip().rpartition("end ")[2].rstrip(";")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{name}.mo"
        file.write_text(text)
        return solve(file, name, *settings, packages=packages)


def as_stated(file: Path, name: str, packages: Sequence[Path] = (library.ROOT,), of: Path | None = None) -> Trajectory:
    """Simulate over the experiment that the file states, or another one."""
    e = library.experiment_of((of or file).read_text())
    return solve(file, name, *(e[k] for k in ("StopTime", "Interval", "Tolerance")), packages=packages)


def load(names: list[str]) -> dict[str, str]:
    """Compile classes; what rumoca complains about each, "" for none."""
    done = _process("--load", *names, limit=LOAD_LIMIT)
    rows = dict(line.split("\t") for line in done.stdout.splitlines())
    return {n: rows.get(n, f"the compiler ended before it: {done.stderr.strip()[-500:]}") for n in names}


def can_load(c: library.Class) -> bool:
    """Is it a class that the compiler takes as a model? Functions, types and partial classes are loaded by those."""
    return c.tree.type in ("block", "model") and not c.tree.partial


def load_changed(copy: Path, changed: list[tuple[Path, str]]) -> list[str]:
    """Compile classes of a copy of the library, each with another file in its place; complaints in this order."""
    pairs = [str(x) for pair in changed for x in pair]
    done = _process("--load-changed", *pairs, limit=LOAD_LIMIT, root=copy)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def _process(*arguments: str, limit: float, root: Path = library.ROOT) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*SCRIPT, root, *arguments], capture_output=True, text=True, timeout=limit, check=False)


_EXAMPLES: dict[str, Trajectory] = {}  # two tests look at each: simulated once


def run(name: str) -> Trajectory:
    """Simulate the class `name` of the library over its own experiment."""
    if name in _EXAMPLES:
        return _EXAMPLES[name]
    found = as_stated(library.classes()[name].file, name)
    if name.startswith("HystFMU.Examples."):
        _EXAMPLES[name] = found
    return found


def port(values: dict[str, Array], prefix: str, name: str, size: int) -> Array:
    """The columns of a port: shape (n, size)."""
    names = [f"{prefix}.{name}"] if f"{prefix}.{name}" in values else [f"{prefix}.{name}[{i + 1}]" for i in range(size)]
    return np.column_stack([values[n] for n in names])
