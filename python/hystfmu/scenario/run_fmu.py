"""Simulate a single foreign FMU without a scenario, with inputs from a file and outputs to a file."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from hystfmu.base import MOST_BYTES, Array, InputError, check_target
from hystfmu.base.printable import printable
from hystfmu.data.columns import write_csv
from hystfmu.data.reader.reading import table_in
from hystfmu.data.reader.roles import NAMES
from hystfmu.data.reader.table import TIME
from hystfmu.fmu.foreign.instance import REAL, Ended, Finding
from hystfmu.fmu.foreign.simulated import Simulated
from hystfmu.scenario.engine.simulation import Run, child, one_line
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.foreign import Foreign, ForeignPort

MOST_STEPS, MOST_VALUES = 10_000_000, 100_000_000
_STEPS = 500  # number of steps in a run if the FMU states no step
_CHUNK = 4096  # number of rows in a chunk


@dataclass(frozen=True)
class FmuRun:
    """Outputs of a run by name, at the times `t` (s).

    If the run ended before the stop time, `note` states the reason.
    """

    path: str
    t: Array
    values: dict[str, Array]
    note: str

    def summary(self) -> dict[str, Any]:
        """Return the results of the run as JSON types."""
        final = {name: float(y[-1]) for name, y in self.values.items()}
        return {"file": self.path, "rows": len(self.t), "final": final, "note": self.note}

    def lines(self) -> list[str]:
        """Return lines for the terminal: smallest, largest and last value of each output."""
        span = f"{self.t[0]:g} to {self.t[-1]:g} s"
        lines = [f"{self.path}: {len(self.t)} rows, {span}" + (f"; {self.note}" if self.note else "")]
        named = [(printable(name), y) for name, y in self.values.items()]
        width = max((len(name) for name, _ in named), default=0)
        for name, y in named:
            lines.append(f"{name:<{width}}  min {y.min():.6g}  max {y.max():.6g}  end {y[-1]:.6g}")
        return lines


@dataclass(frozen=True)
class Task:
    """Inputs of a run. `signals` has one column for each element of the inputs `driven`, at the times `t` (s)."""

    foreign: Foreign
    driven: tuple[ForeignPort, ...]
    t: Array
    signals: Array
    start: float
    step: float
    n_steps: int


def run_fmu(
    path: str | Path,
    given: str | Path | None = None,
    settings: Mapping[str, Any] | None = None,
    step: float | None = None,
    stop: float | None = None,
    seconds: float = 600.0,
    out: str | Path | None = None,
    confined: bool = True,
) -> FmuRun:
    """Run an FMU of FMI 1.0, 2.0 or 3.0 without a scenario, in a child process.

    If the FMU supports Co-Simulation, this interface is used. Otherwise Model Exchange is used with an adaptive
    integrator, whose local error is 1e-8. Inputs are set at the beginning of each step and are constant during the
    step. Continuous inputs are interpolated between the rows of the file `given`. All other inputs have the value of
    the previous row.

    Parameters
    ----------
    path : path
        The FMU.
    given : path, optional
        CSV file with a time column and one column for each input to set. The heading of a column is the name of the
        input: `u`, or `u_1` and `u_2` for an array. An input without a column keeps the start value.
    settings : mapping, optional
        New values of parameters.
    step : float, optional
        Communication step (s). The default is the step that the FMU states, or else a fixed fraction of the duration.
    stop : float, optional
        Stop time (s). The default is the stop time that the FMU states, or else the last time in the table of inputs.
    out : path, optional
        CSV file to write, with all outputs.
    seconds, confined
        See `Run`.

    Raises
    ------
    InputError
        The FMU or the file `given` cannot be read, a column or a parameter is unknown, or the times are invalid. The
        FMU refuses a call, crashes, or exceeds the time limit.
    """
    if out is not None:
        check_target(out)
    foreign = Foreign.load(Path(path))
    if settings:
        try:
            foreign = foreign.with_settings(settings)
        except InputError as e:
            raise InputError(f"{path}: {e}") from None
    task = _task(str(path), foreign, None if given is None else _table(given, foreign), step, stop)
    names = [n for p in foreign.ports if p.kind == "output" for n in p.scalar_names]
    try:
        with child(_steps, task, Run(seconds=seconds, confined=confined), [foreign], "the FMU") as (ended, f):
            rows, note = min(max(int(ended["rows"]), 0), task.n_steps + 1), one_line(ended["note"])
            values = np.fromfile(f, count=rows * len(names)).reshape(rows, len(names))
    except Stopped as e:
        raise InputError(f"{path}: stopped: {e}") from None
    times = np.asarray(task.start + np.arange(rows) * task.step, dtype=np.float64)
    done = FmuRun(str(path), times, {n: values[:, k] for k, n in enumerate(names)}, note)
    if out is not None:
        write_csv(out, {"t": done.t, **done.values})
    return done


_Given = tuple[Array, tuple[ForeignPort, ...], Array]


def _table(given: str | Path, foreign: Foreign) -> _Given:
    """Return the times (s), the inputs that have columns, and the columns in the order of the elements."""
    table = table_in(given, None, MOST_BYTES)
    names = [name for group in NAMES["time"] for name in group]
    found = [k for k, c in enumerate(table.columns) if c.name.lower() in names]
    if not found:
        raise InputError(f"{given}: a column of time is needed, named t or time; there are {_listed(table.columns)}")
    time = found[0]
    unit = table.columns[time].unit or "s"
    if unit not in TIME:
        raise InputError(f"{given}: the time must be in {', '.join(TIME)}; got [{unit}]")
    inputs = [p for p in foreign.ports if p.kind == "input"]
    elements = {n: p for p in inputs for n in p.scalar_names}
    place: dict[str, int] = {}
    for k, column in enumerate(table.columns):
        if k == time:
            continue
        name = next((n for n in (column.label, column.name) if n in elements), None)
        if name is None:
            listed = ", ".join(list(elements)[:20]) or "none"
            raise InputError(f"{given}: {column.label!r} is no input of {foreign.path}; there are {listed}")
        place[name] = k
    driven = tuple(p for p in inputs if any(n in place for n in p.scalar_names))
    for p in driven:
        if missing := [n for n in p.scalar_names if n not in place]:
            raise InputError(f"{given}: the input {p.name!r} needs columns for all elements; {missing[0]!r} is missing")
    order = [place[n] for p in driven for n in p.scalar_names]
    numbers = table.source.numbers([time, *order])
    per_second, length = TIME[unit]
    t = numbers[:, 0] / per_second * length
    if len(t) == 0 or (np.diff(t) < 0).any():
        raise InputError(f"{given}: the times must not decrease, and the table must have a row")
    return t, driven, numbers[:, 1:]


def _listed(columns: tuple[Any, ...]) -> str:
    return ", ".join(repr(c.label) for c in columns[:20])


def _task(path: str, foreign: Foreign, given: _Given | None, step: float | None, stop: float | None) -> Task:
    t, driven, signals = given or (np.zeros(1), (), np.empty((1, 0)))
    stated = foreign.description.defaultExperiment
    start = float((stated and stated.startTime) or 0.0)
    end = stop if stop is not None else stated and stated.stopTime
    if end is None:
        if given is None:
            raise InputError(f"{path}: The FMU states no stop time. Give it with --stop")
        end = t[-1]
    end = float(end)
    if not (math.isfinite(end) and end > start):
        raise InputError(f"{path}: the stop time must be finite and after the start at {start:g} s; got {end:g}")
    fixed = getattr(foreign.description.coSimulation, "fixedInternalStepSize", None)
    h = float(step if step is not None else (stated and stated.stepSize) or fixed or (end - start) / _STEPS)
    if not (math.isfinite(h) and h > 0):
        raise InputError(f"{path}: the step must be finite and greater than 0; got {h:g}")
    n = round((end - start) / h)
    width = sum(p.size for p in foreign.ports if p.kind == "output")
    if not 1 <= n <= min(MOST_STEPS, MOST_VALUES // max(width, 1)):
        raise InputError(f"{path}: {(end - start) / h:g} steps of {h:g} s; at least 1 and at most {MOST_STEPS} can run")
    return Task(foreign, driven, t, signals, start, h, n)


# ---- in the child ------------------------------------------------------------------------------------------------
def _inputs(task: Task, times: Array) -> Array:
    """Return the inputs at the given times.

    Continuous inputs are interpolated between two rows. All other inputs have the value of the previous row.
    """
    columns = [p.variable for p in task.driven for _ in range(p.size)]
    found = np.empty((len(times), len(columns)))
    near = 1e-9 * task.step  # a row at a communication point is used in spite of rounding errors
    before = np.maximum(np.searchsorted(task.t, times + near, side="right") - 1, 0)
    for k, v in enumerate(columns):
        held = v.type not in REAL or v.variability == "discrete"
        found[:, k] = task.signals[before, k] if held else np.interp(times, task.t, task.signals[:, k])
    return found


def _steps(task: Task, file: IO[bytes]) -> dict[str, Any]:
    """Simulate the FMU and write one row of outputs per step.

    Return the number of rows, and the reason if the run ended before the stop time.
    """
    said: list[str] = []
    outputs = [(p.variable, p.size) for p in task.foreign.ports if p.kind == "output"]
    inputs = [(p.variable, p.size) for p in task.driven]
    rows, note = 0, ""
    chunk: list[list[float]] = []
    try:
        unit = Simulated(task.foreign.folder, task.foreign.description, inputs, outputs, "alone", said.append)
        unit.set_parameters(task.foreign.settings)
        for first in range(0, task.n_steps + 1, _CHUNK):
            times = np.asarray(task.start + np.arange(first, min(first + _CHUNK, task.n_steps + 1)) * task.step)
            table, chunk = _inputs(task, times).tolist(), []
            for k, t in enumerate(times.tolist(), first):
                if k:
                    unit.step(task.start + (k - 1) * task.step, task.step)
                    chunk.append(unit.get())
                    unit.put(table[k - first])
                else:
                    unit.start(t, table[0])
                    chunk.append(unit.get())
                rows += 1
            np.array(chunk, dtype=np.float64).tofile(file)
    except Ended as e:
        np.array(chunk, dtype=np.float64).tofile(file)
        note = str(e)
    except Finding as e:
        raise Stopped(f"{e}{f' ({said[-1]})' if said else ''}") from None
    return {"rows": rows, "note": note}
