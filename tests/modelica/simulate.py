"""Simulate a model of the library with rumoca in a process of its own, and read its trajectory at sample instants.

A process of its own with a time limit, because a panic of the compiler is a BaseException and a solver may hang.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import library
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
INSTANT = 1e-9  # s
TIME_LIMIT = 60.0
LOAD_LIMIT = 180.0  # all classes together


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


def rumoca(*arguments: str | Path, beside: Path | None = None) -> str:
    """Run `run_model.py`; returns what the compiler or the solver complains about, or "".

    `beside`: another package that the model uses.
    """
    done = _process(*arguments, limit=TIME_LIMIT, beside=beside)
    return "" if done.returncode == 0 else done.stderr.strip()[:2000] or f"exit status {done.returncode}"


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


def _process(
    *arguments: str | Path, limit: float, beside: Path | None = None, root: Path = library.ROOT
) -> subprocess.CompletedProcess[str]:
    script = Path(__file__).with_name("run_model.py")
    libraries = os.pathsep.join(str(p) for p in (root, beside) if p is not None)
    command = [sys.executable, str(script), libraries, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=limit, check=False)


_EXAMPLES: dict[str, Trajectory] = {}  # two tests look at each: simulated once


def run(name: str, out: Path) -> Trajectory:
    """Simulate the class `name` of the library over its own experiment."""
    if name in _EXAMPLES:
        return _EXAMPLES[name]
    c = library.classes()[name]
    e = library.experiment(c)
    began = time.perf_counter()
    complaint = rumoca(c.file, name, *(repr(e[k]) for k in ("StopTime", "Interval", "Tolerance")), out)
    seconds = time.perf_counter() - began
    assert not complaint, f"{name}: rumoca says: {complaint}"
    with np.load(out) as file:
        found = Trajectory({k: file[k] for k in file.files}, seconds)
    if name.startswith("HystFMU.Examples."):
        _EXAMPLES[name] = found
    return found


def port(values: dict[str, Array], prefix: str, name: str, size: int) -> Array:
    """The columns of a port: shape (n, size)."""
    names = [f"{prefix}.{name}"] if f"{prefix}.{name}" in values else [f"{prefix}.{name}[{i + 1}]" for i in range(size)]
    return np.column_stack([values[n] for n in names])
