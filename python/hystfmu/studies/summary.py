"""Result of a study: the share of variations inside the limits with a 95 % interval, and the failures.

Two studies are compared by the summary and verdicts in report.json, and by the rows in results.parquet.
"""

import json
import math
import os
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pydantic
from pydantic import Field
from scipy.special import betaincinv

from hystfmu.base import Array, InputError, extras, read_bytes, write_text
from hystfmu.graph.tables import Number, Share
from hystfmu.scenario.outcome.metrics import unit_of_metric
from hystfmu.scenario.outcome.result import grouped
from hystfmu.scenario.report.compare import MOST_BYTES, read_report, report_file
from hystfmu.scenario.system.system import System
from hystfmu.studies.spec import Study

CONFIDENCE = 0.95
PERCENTILES = (5, 50, 95, 99)
LOST = {"rms_percent": 25.0, "max_percent": 50.0}  # errors in percent of the stroke that a constant output also has

Row = dict[str, Any]


@dataclass(frozen=True)
class Spread:
    """Distribution of one metric in one case: percentiles, worst value, limit, and share inside the limit."""

    case: str
    metric: str
    percentiles: tuple[float, ...]
    worst: float
    limit: float | None
    within: float | None


@dataclass(frozen=True)
class Summary:
    """Share of the variations inside the limits of all cases.

    Parameters
    ----------
    draws, inside, unstable, failed : int
        Numbers of all variations and of variations inside the limits, unstable and failed ones. Unstable and failed
        variations are outside the limits. A run is unstable if its values grow without bound, if its linearised loop
        has a pole outside the unit circle, or if its error is as large as for a constant output and is not within its
        limits.
    interval : (float, float) or None
        95 % confidence interval of the share (Clopper and Pearson). It is None for a grid, whose points are not random.
    spreads : tuple of Spread
    worst : tuple of dict
        The worst row of each case.
    """

    draws: int
    inside: int
    unstable: int
    failed: int
    interval: tuple[float, float] | None
    spreads: tuple[Spread, ...]
    worst: tuple[Row, ...]

    @property
    def sentence(self) -> str:
        """The result in one sentence."""
        unstable = "none is" if self.unstable == 0 else f"{self.unstable} {'is' if self.unstable == 1 else 'are'}"
        failed = f"; {self.failed} could not be run" if self.failed else ""
        if all(s.limit is None for s in self.spreads):
            return f"{self.draws} variations without limits; {unstable} unstable{failed}."
        share = (
            f"{self.inside} of {self.draws} variations are inside the limits ({100 * self.inside / self.draws:.3g} %"
        )
        if self.interval is not None:
            lo, hi = self.interval
            share += f"; 95 % interval {100 * lo:.3g} to {100 * hi:.3g} %, Clopper-Pearson"
        return f"{share}); {unstable} unstable{failed}."


def interval(inside: int, draws: int) -> tuple[float, float]:
    """Return the 95 % confidence interval of a share (Clopper and Pearson 1934, Biometrika 26, 404-413).

    For independent random variations, the interval contains the true share with a probability of at least 95 %. For
    more evenly spread variations, the interval is conservative.
    """
    tail = (1 - CONFIDENCE) / 2
    lo = betaincinv(inside, draws - inside + 1, tail) if inside else 0.0
    hi = betaincinv(inside + 1, draws - inside, 1 - tail) if inside < draws else 1.0
    return float(lo), float(hi)


def summarise(study: Study, systems: Sequence[System], rows: Sequence[Row]) -> Summary | None:
    """Return the summary of the rows of a study, or None for the method 'optuna'."""
    if study.spec.method == "optuna":
        return None
    limits = {s.case.name: study.limits(s.case) for s in systems}
    found = list(outcomes(study, systems, rows).values())
    inside = found.count("inside")
    return Summary(
        len(found),
        inside,
        found.count("unstable"),
        found.count("failed"),
        interval(inside, len(found)) if study.spec.method != "grid" else None,
        tuple(s for name in limits for s in _spreads(name, limits[name], rows)),
        tuple(w for name in limits for w in worst_rows(rows, name, limits[name])[:1]),
    )


def outcomes(study: Study, systems: Sequence[System], rows: Sequence[Row]) -> dict[int, str]:
    """Return the outcome of each variation: inside the limits of all cases, outside, unstable, or failed."""
    of_case = {s.case.name: s for s in systems}
    limits = {name: study.limits(s.case) for name, s in of_case.items()}

    def outcome(group: list[Row]) -> str:
        if any(is_unstable(of_case[r["case"]], r, limits[r["case"]]) for r in group):
            return "unstable"
        if any(r["status"] != "ok" for r in group):
            return "failed"
        good = all(not limits[r["case"]] or excess(r, limits[r["case"]]) <= 1 for r in group)
        return "inside" if good else "outside"

    return {v: outcome(group) for v, group in grouped(rows, lambda r: int(r["variation"])).items()}


def is_unstable(system: System, row: Row, limits: Mapping[str, float]) -> bool:
    """Return whether a run is unstable.

    A run is unstable if it diverged, or if its linearised loop has a pole outside the unit circle. It is also unstable
    if its error is as large as for a constant output, unless its errors have limits in `limits` and are within them. A
    reference that jumps, for example, causes such errors in every stable loop.
    """
    if row["status"] == "stopped":
        return True
    metrics = row["metrics"]
    if not metrics.get("radius", 0.0) < 1:
        return True
    lost = {name: LOST[m.kind] for name, m in system.case.metrics.items() if m.kind in LOST}
    asked = {name: limits[name] for name in lost if name in limits}
    return any(not metrics.get(k, 0.0) <= most for k, most in lost.items()) and not (
        asked and all(metrics.get(k, math.inf) <= most for k, most in asked.items())
    )


def worst_rows(rows: Sequence[Row], case: str, limits: Mapping[str, float]) -> list[Row]:
    """Return the rows of a case, sorted from the worst to the best.

    Failed runs come first. The other rows are sorted by the largest ratio of a metric to its limit, or by the first
    metric if there are no limits.
    """
    mine = [r for r in rows if r["case"] == case]
    return sorted(mine, key=lambda r: (-excess(r, limits), r["index"]))


def excess(row: Row, limits: Mapping[str, float]) -> float:
    """Return the largest ratio of a metric to its limit, or infinity for a failed run.

    If there are no limits, return the first metric.
    """
    if row["status"] != "ok":
        return math.inf
    if not limits:
        return float(next(iter(row["metrics"].values())))
    return max(_ratio(row["metrics"][k], limit) for k, limit in limits.items())


def _ratio(value: float, limit: float) -> float:
    if limit > 0:
        return math.inf if math.isnan(value) else value / limit
    return 1.0 if value <= limit else math.inf


def _spreads(case: str, limits: Mapping[str, float], rows: Sequence[Row]) -> list[Spread]:
    mine = [r["metrics"] for r in rows if r["case"] == case]
    found = []
    for metric in dict.fromkeys([*(k for m in mine for k in m), *limits]):
        values = np.array([m.get(metric, math.inf) for m in mine])
        values = np.where(np.isnan(values), math.inf, values)
        limit = limits.get(metric)
        at = np.quantile(values, [p / 100 for p in PERCENTILES], method="inverted_cdf")
        within = None if limit is None else float((values <= limit).mean())
        found.append(Spread(case, metric, tuple(map(float, at)), float(values.max()), limit, within))
    return found


def command(study: Study, row: Row) -> str:
    """Return the text of the command that runs a row again."""
    where = os.path.normpath(study.file.parent / study.spec.scenario)
    given = [f"{k}={v if isinstance(v, str) else json.dumps(v)}" for k, v in study.settings(row["values"]).items()]
    return shlex.join(["hystfmu", "run", where, "--case", row["case"], *(w for g in given for w in ("--set", g))])


def save_settings(study: Study, row: Row, folder: Path) -> Path:
    """Write the settings of a row to a file for `hystfmu run --set @FILE`, and return the path of the file."""
    path = folder / "worst" / f"{row['case']}-{row['variation']}.json"
    write_text(path, json.dumps(study.settings(row["values"]), indent=1) + "\n")
    return path


def metric_unit(system: System, metric: str) -> str:
    """Return the unit of measure of a metric of a case or of its linearised loop, or "" for a ratio."""
    if metric in system.case.metrics:
        return unit_of_metric(system, system.case.metrics[metric])
    return "dB" if metric.endswith("_db") else ""


KEY = "study"
WORDS = {"i": "inside", "o": "outside", "u": "unstable", "f": "failed"}


class Facts(pydantic.BaseModel):
    """Data of a study that report.json contains.

    `outcomes` contains one letter of `WORDS` for each variation, in the order of the variations.
    """

    model_config = pydantic.ConfigDict(strict=True)
    name: str
    scenario: str
    inside: Annotated[int, Field(ge=0)]
    interval: Annotated[list[Share], Field(min_length=2, max_length=2)] | None
    limits: dict[str, dict[str, Number]]
    units: dict[str, str]
    parameters: dict[str, str]
    outcomes: Annotated[str, Field(pattern=f"^[{''.join(WORDS)}]+$")]


def facts(
    study: Study, systems: Sequence[System], labels: Mapping[str, str], rows: Sequence[Row], summary: Summary
) -> dict[str, Any]:
    """Return the data of a study for report.json. `labels` contains the parameters with their units of measure."""
    letters, kinds = {word: letter for letter, word in WORDS.items()}, outcomes(study, systems, rows)
    metrics = {k: metric_unit(s, k) for s in reversed(systems) for k in s.case.metrics}
    found = Facts(
        name=study.spec.name,
        scenario=study.cases[0].scenario,
        inside=summary.inside,
        interval=None if summary.interval is None else list(summary.interval),
        limits={s.case.name: dict(study.limits(s.case)) for s in systems},
        units={k: unit for k, unit in metrics.items() if unit},
        parameters=dict(labels),
        outcomes="".join(letters[kinds[v]] for v in sorted(kinds)),
    )
    return {KEY: found.model_dump()}


@dataclass(frozen=True)
class Read:
    """Data of a study, read from its files.

    `values` contains the parameters, shape (n, p). `metrics` contains each metric with a limit, shape (n,). A metric of
    a failed run is infinite.
    """

    facts: Facts
    values: Array
    metrics: Mapping[tuple[str, str], Array]


def is_study(path: str | Path) -> bool:
    """Return whether a path is the folder or the report.json of a study."""
    try:
        content = json.loads(read_bytes(report_file(path), MOST_BYTES))
    except (ValueError, RecursionError):  # the function that reads the file next reports the error
        return False
    return isinstance(content, dict) and KEY in content


def read_study(path: str | Path) -> Read:
    """Read a study for a comparison. The path is the folder of the study, or the report.json in this folder.

    An InputError is raised if a file is missing or damaged, or belongs to another study.
    """
    found, file = read_report(path, Facts, "hystfmu study", "no study", KEY), report_file(path)
    table = file.with_name("results.parquet")
    rows = _rows(table)
    try:
        return _in_order(found, rows)
    except (KeyError, TypeError, ValueError):
        raise InputError(f"{table}: not the table of the study in {file.name} beside it") from None


def _rows(table: Path) -> list[dict[str, Any]]:
    with extras("a comparison of studies"):
        import pyarrow as pa
        import pyarrow.parquet as pq
    try:
        found: list[dict[str, Any]] = pq.read_table(pa.BufferReader(read_bytes(table, MOST_BYTES))).to_pylist()
    except (pa.ArrowException, OSError):
        raise InputError(f"{table}: not a table of 'hystfmu study'") from None
    return found


def _in_order(found: Facts, rows: Sequence[Mapping[str, Any]]) -> Read:
    """Return the rows sorted by variation. A KeyError or a ValueError means that the rows belong to another study."""
    place = {v: k for k, v in enumerate(sorted({r["variation"] for r in rows}))}
    if len(place) != len(found.outcomes):
        raise ValueError
    values = np.full((len(place), len(found.parameters)), np.nan)
    pairs = [(case, metric) for case, limits in found.limits.items() for metric in limits]
    metrics: dict[tuple[str, str], Array] = {pair: np.full(len(place), np.inf) for pair in pairs}
    for r in rows:
        k = place[r["variation"]]
        values[k] = [r[name] for name in found.parameters]
        for metric in found.limits[r["case"]]:
            v = r[f"metric:{metric}"]
            metrics[r["case"], metric][k] = np.inf if v is None or np.isnan(v) else v
    return Read(found, values, metrics)
