"""Run a foreign FMU alone: inputs from a file, outputs to a file, without a scenario."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.base.files import MOST_BYTES, check_target
from hystfmu.base.printable import printable
from hystfmu.data.csv_file import write_csv
from hystfmu.data.reader.measures import TIME
from hystfmu.data.reader.reading import table_in
from hystfmu.data.reader.roles import NAMES
from hystfmu.scenario.engine.alone import Task, run_alone
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.foreign import Foreign, ForeignPort

MOST_STEPS, MOST_VALUES = 10_000_000, 100_000_000
_STEPS = 500  # of a run whose FMU states no step


@dataclass(frozen=True)
class FmuRun:
    """Outputs of a run by name, at the times `t` (s); `note` says why it ended before the stop time."""

    path: str
    t: Array
    values: dict[str, Array]
    note: str

    def summary(self) -> dict[str, Any]:
        """Return the facts of the run, for JSON."""
        final = {name: float(y[-1]) for name, y in self.values.items()}
        return {"file": self.path, "rows": len(self.t), "final": final, "note": self.note}

    def lines(self) -> list[str]:
        """Return lines for the terminal: least, greatest and last value of each output."""
        span = f"{self.t[0]:g} to {self.t[-1]:g} s"
        lines = [f"{self.path}: {len(self.t)} rows, {span}" + (f"; {self.note}" if self.note else "")]
        named = [(printable(name), y) for name, y in self.values.items()]
        width = max((len(name) for name, _ in named), default=0)
        for name, y in named:
            lines.append(f"{name:<{width}}  min {y.min():.6g}  max {y.max():.6g}  end {y[-1]:.6g}")
        return lines


def run_fmu(
    path: str | Path,
    given: str | Path | None = None,
    settings: Mapping[str, Any] | None = None,
    step: float | None = None,
    stop: float | None = None,
    seconds: float = 600.0,
    confined: bool = True,
) -> FmuRun:
    """Run an FMU of FMI 1.0, 2.0 or 3.0 by itself, in a child process.

    Co-Simulation is preferred; Model Exchange runs with an adaptive integrator whose local error is 1e-8.  Inputs are
    set at the beginning of a step and held.  Between the rows of the file continuous inputs are interpolated; all
    others keep the value of the last row.

    Parameters
    ----------
    path : str or Path
        The FMU.
    given : str or Path, optional
        Table with a column of time and a column for each driven input with its name (`u`, or `u_1`, `u_2` of an array).
        Inputs without a column keep their start values.
    settings : mapping, optional
        Values of parameters by name.
    step : float, optional
        Step (s); by default that of the default experiment.
    stop : float, optional
        Stop time (s); by default that of the default experiment, or the last time in the table.
    seconds : float
        Time limit (s).
    confined : bool
        Keep its native code from the network and from files that are not its own, as far as the system can.

    Returns
    -------
    FmuRun

    Raises
    ------
    InputError
        The FMU or the table cannot be read, a column or a parameter is unknown, or the times are invalid.
    Stopped
        The FMU refuses a call, dies, or exceeds the time limit.
    """
    foreign = Foreign.load(Path(path))
    if settings:
        try:
            foreign = foreign.with_settings(settings)
        except InputError as e:
            raise InputError(f"{path}: {e}") from None
    t, driven, signals = (np.zeros(1), (), np.empty((1, 0))) if given is None else _table(given, foreign)
    task = _task(str(path), foreign, t, driven, signals, step, stop, given is not None)
    times, values, note = run_alone(task, seconds, confined)
    names = [n for p in foreign.ports if p.kind == "output" for n in p.scalar_names]
    return FmuRun(str(path), times, {n: values[:, k] for k, n in enumerate(names)}, note)


def _table(given: str | Path, foreign: Foreign) -> tuple[Array, tuple[ForeignPort, ...], Array]:
    """Read the times (s), the inputs that have columns, and the columns in the order of their elements."""
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
        raise InputError(f"{given}: the times must not decrease, and there must be a row")
    return t, driven, numbers[:, 1:]


def _listed(columns: tuple[Any, ...]) -> str:
    return ", ".join(repr(c.label) for c in columns[:20])


def _task(
    path: str,
    foreign: Foreign,
    t: Array,
    driven: tuple[ForeignPort, ...],
    signals: Array,
    step: float | None,
    stop: float | None,
    from_table: bool,
) -> Task:
    stated = foreign.description.defaultExperiment
    start = float((stated and stated.startTime) or 0.0)
    end = stop if stop is not None else stated and stated.stopTime
    if end is None:
        if not from_table:
            raise InputError(f"{path}: states no stop time; give --stop")
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


def run_fmu_file(
    path: str,
    given: str | None,
    settings: Mapping[str, Any],
    step: float | None,
    stop: float | None,
    seconds: float,
    out: str | None,
    confined: bool,
) -> FmuRun:
    """Run an FMU for the command line and write its outputs to the file `out`.

    Raises
    ------
    InputError
        As `run_fmu`; the FMU stops.
    """
    if out is not None:
        check_target(out)
    try:
        done = run_fmu(path, given, settings, step, stop, seconds, confined)
    except Stopped as e:
        raise InputError(f"{path}: stopped: {e}") from None
    if out is not None:
        write_csv(out, {"t": done.t, **done.values})
    return done
