"""Result of one case of a scenario: verdicts against limits and baseline, failures, signals for plots.

The baseline of a run is stored in baseline.toml (metrics, memories) and baseline.csv (rows of the recorded signals). By
default, a run is compared row by row with `tolerance`. If the scenario has a table `[tube]`, it states tolerances in
time and value. A row of the baseline then agrees if the signal of the run passes through a box around this row. The
tube is computed around the run, because the run has all rows and the baseline has only some rows.
"""

import json
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pydantic

from hystfmu.base import MOST_BYTES, Array, InputError, check, load_toml, own, write_text
from hystfmu.data.columns import read_header
from hystfmu.scenario.outcome.metrics import Measure
from hystfmu.scenario.outcome.trace import Excerpt, Sweeps, Trace
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.spec import TubeSpec
from hystfmu.scenario.system.system import System

# text in every line on a change, so that the terminal output can count changes
CHANGED = "changed against the baseline"
BASELINE_ROWS = 24  # number of rows of each case in baseline.csv


class _BaselineCase(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", strict=True)
    metrics: dict[str, float]
    final_states: dict[str, str] = {}


class _BaselineFile(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", strict=True)
    case: dict[str, _BaselineCase] = {}


@dataclass(frozen=True)
class Record:
    """Data of one case in a baseline file.

    `metrics` contains the value of each metric by name. `rows` contains the time in the first column and one column for
    each recorded signal. `final_states` contains the hash of the final states of each unit by name.
    """

    metrics: dict[str, float]
    rows: Array
    final_states: dict[str, str]


@dataclass(frozen=True)
class Baseline:
    """A recorded result: metrics of each case, some rows of the recorded signals, and hashes of the final states."""

    metrics: dict[str, dict[str, float]]
    rows: dict[str, Array]
    signals: tuple[str, ...]
    final_states: dict[str, dict[str, str]]

    @classmethod
    def load(cls, folder: Path) -> "Baseline | None":
        """Return the baseline of a scenario, or None if there is none. Invalid files raise an InputError."""
        file = folder / "baseline.toml"
        if not file.exists():
            return None
        cases = check(load_toml(file), _BaselineFile, file).case
        rows: dict[str, list[list[float]]] = {}
        table = folder / "baseline.csv"
        header, separator, body = read_header(table, MOST_BYTES)
        if header[:2] != ["case", "t"]:
            raise InputError(f"{table}: line 1: must begin with case,t; record the baseline again with --record")
        for i, line in enumerate(body.splitlines(), 2):
            name, *cells = line.split(separator)
            try:
                numbers = [float(v) for v in cells]
            except ValueError:
                numbers = []
            # a comparison with NaN would never find a change
            if len(numbers) != len(header) - 1 or not np.isfinite(numbers).all():
                raise InputError(f"{table}: line {i}: must have {len(header) - 1} numbers; got {cells}")
            rows.setdefault(name, []).append(numbers)
        metrics, states = {n: c.metrics for n, c in cases.items()}, {n: c.final_states for n, c in cases.items()}
        return cls(metrics, {n: np.array(r) for n, r in rows.items()}, tuple(header[2:]), states)


class Kept:
    """Rows of a run for a new baseline or for the comparison with a baseline.

    If there is a tube, the rows around each row of the baseline are also stored.
    """

    def __init__(self, system: System, baseline: Baseline | None) -> None:
        case, n = system.case, system.n_steps + 1
        picked = np.unique(np.linspace(0, n - 1, min(BASELINE_ROWS, n)).round().astype(np.int64))
        rows, self.h = picked, system.h
        if case.tube is not None and baseline is not None and case.name in baseline.rows:
            room = 2 + int(np.ceil(case.tube.time / system.h))
            t = baseline.rows[case.name][:, 0]
            around = system.rows(np.clip(np.concatenate([[0.0, case.stop], t]), 0.0, case.stop))
            windows = [np.arange(max(r - room, 0), min(r + room + 1, n)) for r in around.tolist()]
            rows = np.unique(np.concatenate([picked, *windows]))
        self._at, self._record = np.searchsorted(rows, picked), case.record
        self._excerpt = Excerpt(case.record, rows)
        self.add = self._excerpt.add

    @property
    def trace(self) -> Trace:
        """All stored rows."""
        return self._excerpt.trace()

    def rows(self) -> Array:
        """Rows for baseline.csv, shape (at most BASELINE_ROWS, 1 + number of recorded signals)."""
        trace = self.trace
        return np.column_stack([trace.t[self._at], *[trace[s][self._at] for s in self._record]])


def save_baseline(folder: Path, signals: tuple[str, ...], runs: dict[str, Record]) -> None:
    """Write baseline.toml and baseline.csv atomically. Only an explicit `--record` calls this function."""
    cases = ["# generated from scenario.toml by 'hystfmu run --record' - do not edit", "[case]"]
    lines = [",".join(["case", "t", *signals])]
    for name, r in runs.items():
        tables = [("metrics", r.metrics)] + ([("final_states", r.final_states)] if r.final_states else [])
        cases += [f"{name if '.' not in name else json.dumps(name)}.{key} = {_inline(table)}" for key, table in tables]
        lines += [",".join([name, *[repr(float(v)) for v in row]]) for row in r.rows]
    own(folder / "baseline.csv", folder / "baseline.toml")
    write_text(folder / "baseline.csv", "\n".join(lines) + "\n")
    write_text(folder / "baseline.toml", "\n".join(cases) + "\n")


def _inline(table: dict[str, float] | dict[str, str]) -> str:
    """Return a table as one line of TOML."""
    return f"{{ {', '.join(f'{name} = {json.dumps(value)}' for name, value in table.items())} }}"


@dataclass(frozen=True)
class Change:
    """One change of a baseline by a new recording. `what` is the changed value in the case `title` (scenario/case).

    `old` and `new` are numbers, or text for a hash of final states. A missing value is None.
    """

    title: str
    what: str
    old: float | str | None
    new: float | str | None

    @property
    def relative(self) -> float | None:
        """Relative change (new - old) / |old| of two numbers."""
        if isinstance(self.old, float) and isinstance(self.new, float) and self.old != 0:
            return (self.new - self.old) / abs(self.old)
        return None


def changes(scenario: str, old: Baseline | None, runs: dict[str, Record]) -> list[Change]:
    """Return the changes by a new recording: metrics, largest change of each signal, final states, removed cases."""
    if old is None:
        old = Baseline({}, {}, (), {})
    found = []
    for case in dict.fromkeys([*old.metrics, *runs]):
        title, r = f"{scenario}/{case}", runs.get(case, Record({}, np.zeros((0, 1)), {}))
        pairs = [(n, old.metrics.get(case, {}), r.metrics) for n in {**old.metrics.get(case, {}), **r.metrics}]
        found += [Change(title, n, a.get(n), b.get(n)) for n, a, b in pairs if a.get(n) != b.get(n)]
        before = old.rows.get(case)
        if before is not None and before.shape == r.rows.shape:
            for k, signal in enumerate(old.signals, 1):
                worst = int(np.abs(r.rows[:, k] - before[:, k]).argmax())
                a, b = float(before[worst, k]), float(r.rows[worst, k])
                if a != b:
                    found.append(Change(title, f"{signal} at {before[worst, 0]:g} s", a, b))
        hashes = old.final_states.get(case, {})
        found += [
            Change(title, f"final states of {unit}", hashes.get(unit), r.final_states.get(unit))
            for unit in {**hashes, **r.final_states}
            if hashes.get(unit) != r.final_states.get(unit)
        ]
    return found


def compare(case: Case, kept: Kept, baseline: Baseline) -> list[str]:
    """Return one line for each recorded signal or final state that differs from the baseline."""
    old, trace, rows = baseline.rows.get(case.name), kept.trace, kept.rows()
    if old is None or old.shape != rows.shape or baseline.signals != case.record:
        return [f"{case.title}: baseline.csv has other rows or signals than the scenario: run with --record"]
    lines = []
    for k, signal in enumerate(case.record, 1):
        size = max(float(np.abs(old[:, k]).max()), 1e-300)
        if case.tube is not None:
            gap = _outside(case.tube, kept, signal, old[:, 0], old[:, k], case.tube.value * size)
            allowed = f"the tube of {case.tube.time:g} s and {case.tube.value:g} of its largest value"
        else:
            gap = np.abs(rows[:, k] - old[:, k]) - case.tolerance * size
            allowed = f"tolerance {case.tolerance:g} of its largest value"
        if gap.max() > 0:
            t, was = old[int(gap.argmax()), [0, k]]
            now = float(np.interp(t, trace.t, trace[signal]))
            lines.append(f"{case.title}: {signal} = {now:.9g} at t = {t:g} s {CHANGED} {was:.9g} ({allowed})")
    known = baseline.final_states.get(case.name, {})
    for unit, found in trace.final_states.items():
        if unit not in known:
            lines.append(f"{case.title}: no baseline of the final states of {unit}: run with --record")
        elif found != known[unit]:
            lines.append(f"{case.title}: the final states of {unit} ({found}) {CHANGED} {known[unit]}")
    return lines


def _outside(tube: TubeSpec, kept: Kept, signal: str, at: Array, was: Array, room: float) -> Array:
    """Return the distance of each baseline value from the tube around the signal; inside, it is at most 0.

    Beyond its two ends, the signal is extended by point reflection. The reason is that a delayed signal has not yet
    reached the last value.
    """
    trace, h = kept.trace, kept.h  # all rows near the two ends and near `at` are stored
    n = min(int(np.ceil(tube.time / h)), len(trace.t) - 1)
    now = np.pad(trace[signal], n, "reflect", reflect_type="odd") if n else trace[signal]
    t = np.concatenate([trace.t[0] - h * np.arange(n, 0, -1), trace.t, trace.t[-1] + h * np.arange(1, n + 1)])
    ends = np.stack([at - tube.time, at + tube.time])
    edges = np.interp(ends, t, now)
    low, high = edges.min(axis=0), edges.max(axis=0)
    for k, (a, b) in enumerate(np.searchsorted(t, ends).T.tolist()):
        if a < b:
            low[k], high[k] = min(low[k], now[a:b].min()), max(high[k], now[a:b].max())
    return np.asarray(np.maximum(low - was, was - high) - room)


@dataclass(frozen=True)
class Verdict:
    """One metric of one case, with the verdicts against limit and baseline.

    Parameters
    ----------
    metric, kind : str
        Name of the metric, and kind of metric (``"rms_percent"``, ...).
    value : float
        Value of the metric, in the unit of measure of its kind.
    limit, baseline : float, optional
        `limit` is the largest allowed value, that is, the smaller one of the limit and the guard of the scenario.
        `baseline` is the recorded value. None means that there is no such value.
    within : bool
        Whether the value is finite and not above the limit.
    same : bool, optional
        Whether the value is unchanged from the baseline; None if there is no baseline.
    """

    metric: str
    kind: str
    value: float
    limit: float | None
    baseline: float | None
    within: bool
    same: bool | None


def judge(
    case: Case, measured: Mapping[str, Measure], kept: Kept, baseline: Baseline | None, strict: bool = True
) -> tuple[list[Verdict], list[str], list[str]]:
    """Return a verdict on every metric, one line per failure (scenario/case, metric, value, limit), and notes.

    If `strict` is True, a missing baseline or a change is a failure. If it is False, only the limits are tested, and
    changes are reported as notes.
    """
    known = baseline.metrics.get(case.name) if baseline is not None else None
    verdicts: list[Verdict] = []
    failures: list[str] = []
    changed: list[str] = []
    for name, m in case.metrics.items():
        try:
            value = measured[name].value()
        except InputError as e:
            raise InputError(f"{case.where}: metrics.{name}: {e}") from None
        old = known.get(name) if known is not None else None
        limit, stated = _allowed(case.guard, m.limit, old, measured[name].rounding)
        within = bool(np.isfinite(value)) and (limit is None or value <= limit)
        same = None
        if old is not None:
            same = abs(value - old) <= max(case.tolerance * max(abs(old), m.limit or 0.0), measured[name].rounding)
        verdicts.append(Verdict(name, m.kind, value, limit, old, within, same))
        if not within:
            rule = "is not finite" if limit is None else f"exceeds the limit {limit:.6g}{stated}"
            failures.append(f"{case.title}: {name} ({m.kind} of {m.signal}) = {value:.6g} {rule}")
        if same is False:
            advice = "; if this change is intended, run with --record" if strict else ""
            changed.append(
                f"{case.title}: {name} = {value:.9g} {CHANGED} {old:.9g} (tolerance {case.tolerance:g}){advice}"
            )
    if known is not None and set(known) == set(case.metrics) and baseline is not None:
        changed += compare(case, kept, baseline)
    elif strict:
        changed.append(f"{case.title}: no baseline: run with --record")
    return (verdicts, failures + changed, []) if strict else (verdicts, failures, changed)


def _allowed(
    guard: float | None, limit: float | None, recorded: float | None, rounding: float
) -> tuple[float | None, str]:
    """Return the largest allowed value of a metric, and a remark for error messages.

    The value is the smaller one of `limit` and `guard` times the recorded value. The remark is empty if it is `limit`.
    """
    if guard is None or recorded is None:
        return limit, ""
    most = max(guard * abs(recorded), rounding)
    return (limit, "") if limit is not None and limit <= most else (most, f", {guard:g} times the recorded value")


T = TypeVar("T")
K = TypeVar("K")


def grouped(items: Iterable[T], key: Callable[[T], K]) -> dict[K, list[T]]:
    """Return the items by their `key`, both in the order in which they occur."""
    found: dict[K, list[T]] = {}
    for item in items:
        found.setdefault(key(item), []).append(item)
    return found


MOST_SAID = 3  # number of metrics in the repr


@dataclass(frozen=True)
class LoopFigures:
    """Margins of the linearised loop of a case for the nominal incremental gain.

    The margins are None if the loop is unstable.

    Attributes
    ----------
    stable : bool
    Ms_db : float or None
        Peak of the sensitivity (dB).
    delay_steps : float or None
        Delay margin in addition to the delay of the case (steps). It may be infinite.
    """

    stable: bool
    Ms_db: float | None
    delay_steps: float | None

    def summary(self) -> dict[str, bool | float | None]:
        """Return the margins as JSON types. An infinite delay margin is None, because JSON has no infinity."""
        return vars(self) | {"delay_steps": None if self.delay_steps == math.inf else self.delay_steps}

    def cells(self) -> list[str]:
        """Return the peak of the sensitivity and the delay margin as text."""
        return ["unstable" if x is None else f"{x:.3g}" for x in (self.Ms_db, self.delay_steps)]


@dataclass(frozen=True)
class CaseResult:
    """Verdicts, failures and signals of one case after its run; `hystfmu.scenario.Result` states the fields."""

    system: System
    verdicts: tuple[Verdict, ...]
    lines: tuple[str, ...]
    trace: Trace | None
    seconds: float
    notes: tuple[str, ...] = ()
    counted: Sweeps = field(default_factory=Sweeps)
    loop: LoopFigures | None = None

    def __repr__(self) -> str:
        if not self.verdicts:
            return f"Result({self.system.case.title!r}, stopped: {self.lines[0]})"
        return (
            f"Result({', '.join([repr(self.system.case.title), 'passed' if self.passed else 'failed', *self._said()])})"
        )

    def _said(self) -> list[str]:
        """Return one line with the first metrics and their limits."""
        said = []
        for v in self.verdicts[:MOST_SAID]:
            percent = " %" if v.kind.endswith("_percent") else ""
            limit = "" if v.limit is None else f" {'<=' if v.within else '>'} {v.limit:g}"
            said.append(f"{v.metric} = {v.value:.4g}{percent}{limit}")
        return [*said, "..."] if len(self.verdicts) > MOST_SAID else said

    @property
    def scenario(self) -> str:
        """Name of the scenario."""
        return self.system.case.scenario

    @property
    def case(self) -> str:
        """Name of the case."""
        return self.system.case.name

    def value(self, metric: str | None = None) -> float:
        """Return the value of a metric, by default of the first one. It is infinite if the run stopped."""
        return next((v.value for v in self.verdicts if metric in (None, v.metric)), math.inf)

    @property
    def passed(self) -> bool:
        """True if all limits are met and nothing differs from the baseline."""
        return not self.lines

    def failures(self) -> list[str]:
        """Return one line per failure."""
        return list(self.lines)

    @property
    def sweeps(self) -> dict[str, Any]:
        """Method, mean and largest number of sweeps in a step for an iterative coupling; otherwise empty."""
        s = self.counted
        if not s.steps:
            return {}
        method = "newton" if self.system.newton else "relaxation"
        return {"method": method, "mean": s.all / s.steps, "most": s.most}

    def summary(self) -> dict[str, Any]:
        """Return verdicts, failures, seconds, and sweeps of an iterative coupling as JSON types."""
        return {
            "scenario": self.scenario,
            "case": self.case,
            "passed": self.passed,
            "seconds": round(self.seconds, 4),
            "metrics": [vars(v) for v in self.verdicts],
            "failures": list(self.lines),
            "notes": list(self.notes),
            "margins": None if self.loop is None else self.loop.summary(),
        } | ({"sweeps": self.sweeps} if self.sweeps else {})
