"""Numbers of a run and the two verdicts on them: against the limit (requirement) and against the baseline (change).

With e = signal - against, over the rows at or after `after`, in percent of the stroke:
rms_percent              root mean square of e, between samples included (fine grid)
max_percent              largest |e|, between samples included
between_samples_percent  largest |e| beyond the straight line between its values at the samples: the ripple
variation_ratio          total variation of the signal / that of `against`, at the samples: 1 means no chattering
peak                     largest |signal|
final                    |e| at the end (|signal| without `against`)
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pydantic

from hystfmu.core import Array
from hystfmu.errors import InputError
from hystfmu.files import read_bytes, read_toml, write_text, write_toml
from hystfmu.scenario.spec import Case, MetricSpec
from hystfmu.scenario.trace import Trace

ROUNDING = 1e-9  # percent of stroke, or unit of the signal: an error that is rounding alone may change by as much
BASELINE_ROWS = 24  # of every case in baseline.csv


def measure(m: MetricSpec, trace: Trace) -> float:
    """One metric of a run.

    Raises
    ------
    InputError
        If the metric needs `against`, or the stroke is zero.
    """
    if m.kind != "peak" and m.kind != "final" and m.against is None:
        raise InputError(f"{m.kind} needs 'against'")
    window = trace.t >= m.after * (1 - 1e-12)
    signal = trace[m.signal][window]
    against = trace[m.against][window] if m.against is not None else np.zeros_like(signal)
    e = signal - against
    if m.kind == "peak":
        return float(np.abs(signal).max())
    if m.kind == "final":
        return float(abs(e[-1]))
    if m.kind == "variation_ratio":
        at = _samples(trace)[window]
        return float(_ratio(np.abs(np.diff(signal[at])).sum(), np.abs(np.diff(against[at])).sum()))
    stroke = m.stroke if m.stroke is not None else float(np.ptp(against))
    if stroke == 0:
        raise InputError(f"the stroke is zero: {m.against} does not move; give 'stroke'")
    if m.kind == "rms_percent":
        return float(100 * np.sqrt(np.mean(e**2)) / stroke)
    if m.kind == "max_percent":
        return float(100 * np.abs(e).max() / stroke)
    at = _samples(trace)[window]
    t = trace.t[window]
    return float(100 * np.abs(e - np.interp(t, t[at], e[at])).max() / stroke)


def _samples(trace: Trace) -> Array:
    return np.asarray(np.arange(len(trace.t)) % trace.ripple == 0)


def _ratio(a: float, b: float) -> float:
    return a / b if b else (1.0 if a == 0 else np.inf)


@dataclass(frozen=True)
class Verdict:
    """One metric of one case with both verdicts.  `same` is None when there is no baseline to compare with."""

    metric: str
    kind: str
    value: float
    limit: float | None
    baseline: float | None
    within: bool
    same: bool | None


# ---- baseline -------------------------------------------------------------------------------------------------------
class _BaselineCase(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", strict=True)
    metrics: dict[str, float]


class _BaselineFile(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", strict=True)
    case: dict[str, _BaselineCase] = {}


@dataclass(frozen=True)
class Baseline:
    """What an earlier run gave: metrics per case, and some rows of the recorded signals."""

    metrics: dict[str, dict[str, float]]
    rows: dict[str, Array]
    signals: tuple[str, ...]

    @classmethod
    def load(cls, folder: Path) -> Baseline | None:
        """The baseline of a scenario; None if none was recorded.

        Raises
        ------
        InputError
            A file that cannot be read as what it should be.
        """
        file = folder / "baseline.toml"
        if not file.exists():
            return None
        metrics = {n: c.metrics for n, c in read_toml(file, _BaselineFile).case.items()}
        rows: dict[str, list[list[float]]] = {}
        table = folder / "baseline.csv"
        lines = list(csv.reader(io.StringIO(read_bytes(table).decode()))) if table.exists() else []
        if not lines or lines[0][:2] != ["case", "t"]:
            raise InputError(f"{table}: row 1: must begin with case,t; record the baseline again with --record")
        for i, line in enumerate(lines[1:], 2):
            try:
                if len(line) != len(lines[0]):
                    raise ValueError
                rows.setdefault(line[0], []).append([float(v) for v in line[1:]])
            except ValueError:
                raise InputError(f"{table}: row {i}: must have {len(lines[0]) - 1} numbers; got {line[1:]}") from None
        return cls(metrics, {n: np.array(r) for n, r in rows.items()}, tuple(lines[0][2:]))


def sample_rows(case: Case, trace: Trace) -> Array:
    """The rows of a run that a baseline keeps: shape (at most BASELINE_ROWS, 1 + number of recorded signals)."""
    n = len(trace.t)
    picked = np.unique(np.linspace(0, n - 1, min(BASELINE_ROWS, n)).round().astype(int))
    return np.column_stack([trace.t[picked], *[trace[s][picked] for s in case.record]])


def save_baseline(folder: Path, signals: tuple[str, ...], runs: dict[str, tuple[dict[str, float], Array]]) -> None:
    """Write baseline.toml and baseline.csv, each as a whole; only ever called for an explicit `--record`."""
    heading = "generated from scenario.toml by 'hystfmu run --record' - do not edit"
    data: dict[str, Any] = {"case": {name: {"metrics": metrics} for name, (metrics, _) in runs.items()}}
    lines = [",".join(["case", "t", *signals])]
    for name, (_, rows) in runs.items():
        lines += [",".join([name, *[repr(float(v)) for v in row]]) for row in rows]
    write_text(folder / "baseline.csv", "\n".join(lines) + "\n")
    write_toml(folder / "baseline.toml", data, heading)


def judge(case: Case, trace: Trace, baseline: Baseline | None, compare: bool = True) -> tuple[list[Verdict], list[str]]:
    """Both verdicts on every metric, and one line per failure: scenario/case, metric, value, limit.

    Without `compare` the limits alone decide; otherwise a missing baseline is a failure.
    """
    known = baseline.metrics.get(case.name) if baseline is not None else None
    verdicts: list[Verdict] = []
    failures: list[str] = []
    for name, m in case.metrics.items():
        try:
            with np.errstate(over="ignore", invalid="ignore"):  # a diverged run: the verdict says so
                value = measure(m, trace)
        except InputError as e:
            raise InputError(f"{case.file}: case {case.name}: metrics.{name}: {e}") from None
        within = bool(np.isfinite(value)) and (m.limit is None or value <= m.limit)
        old = known.get(name) if known is not None else None
        same = None
        if old is not None:
            same = abs(value - old) <= max(case.tolerance * max(abs(old), m.limit or 0.0), ROUNDING)
        verdicts.append(Verdict(name, m.kind, value, m.limit, old, within, same))
        if not within:
            rule = "is not finite" if m.limit is None else f"exceeds the limit {m.limit:g}"
            failures.append(f"{case.title}: {name} ({m.kind} of {m.signal}) = {value:.6g} {rule}")
        if same is False:
            failures.append(
                f"{case.title}: {name} = {value:.9g} changed against the baseline {old:.9g} "
                f"(tolerance {case.tolerance:g}); if that is meant, run with --record"
            )
    if not compare:
        return verdicts, failures
    if known is None or set(known) != set(case.metrics):
        failures.append(f"{case.title}: no baseline: run with --record")
    elif baseline is not None:
        failures += _compare_rows(case, trace, baseline)
    return verdicts, failures


def _compare_rows(case: Case, trace: Trace, baseline: Baseline) -> list[str]:
    now, old = sample_rows(case, trace), baseline.rows.get(case.name)
    if old is None or old.shape != now.shape or baseline.signals != case.record:
        return [f"{case.title}: baseline.csv has other rows or signals than the scenario: run with --record"]
    lines = []
    for k, signal in enumerate(case.record, 1):
        gap = np.abs(now[:, k] - old[:, k])
        allowed = case.tolerance * max(float(np.abs(old[:, k]).max()), 1e-300)
        if gap.max() > allowed:
            worst = int(gap.argmax())
            lines.append(
                f"{case.title}: {signal} = {now[worst, k]:.9g} at t = {now[worst, 0]:g} s changed against the baseline "
                f"{old[worst, k]:.9g} (tolerance {case.tolerance:g} of its largest value)"
            )
    return lines
