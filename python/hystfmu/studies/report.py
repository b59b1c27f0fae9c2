"""The report of a study: share inside the limits, distributions, effects of the parameters, worst cases, failures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.report.page import Section, Table
from hystfmu.report.plot import Line, Plot
from hystfmu.report.terminal import table as text_table
from hystfmu.scenario.report.page import write_report as write_page
from hystfmu.scenario.system.measures import label, unit_of, unit_of_metric
from hystfmu.scenario.system.system import System
from hystfmu.studies.effects import effects
from hystfmu.studies.loop_limits import LoopLimits
from hystfmu.studies.spec import Study
from hystfmu.studies.summary import PERCENTILES, Row, Summary, command, save_settings, worst_rows
from hystfmu.studies.task import OUTSIDE

WORST, BINS, MOST_PLOTS = 10, 12, 24
DIVERGED = 1e100
LONGEST = 3.0  # a limit this many times the worst value is not drawn: the curve would be a stroke at the edge


def write_report(
    study: Study, systems: Sequence[System], rows: list[Row], summary: Summary | None, folder: Path
) -> Path:
    """Write report.html and report.json into `folder`; `systems` are the cases of the study."""
    # omit diverged runs: no axis can show metrics near the largest float
    good = [r for r in rows if r["status"] == "ok" and all(abs(v) < DIVERGED for v in r["metrics"].values())]
    labels = {k: _label(study, systems, k) for k in study.parameters}
    sections = [_summary(study, labels, rows, summary)]
    for system in systems:
        of_case = [r for r in good if r["case"] == system.case.name]
        if of_case:
            worst = worst_rows(rows, system.case.name, study.limits(system.case))[:WORST]
            sections.append(_case(study, labels, system, of_case, worst, summary, folder))
    return write_page([], folder, sections, f"Study {study.spec.name}")


def _label(study: Study, systems: Sequence[System], parameter: str) -> str:
    """Label a parameter with its unit of measure, or as a factor."""
    if parameter not in study.spec.parameters:
        return label(parameter, {"f_n": "Hz"}.get(parameter.rpartition(".")[2], ""))
    if study.parameters[parameter].scale is not None:
        return f"{parameter} as a factor"
    return label(parameter, next(filter(None, (unit_of(s, parameter) for s in systems)), ""))


def _summary(study: Study, labels: dict[str, str], rows: list[Row], summary: Summary | None) -> Section:
    failed = [r for r in rows if r["status"] not in ("ok", OUTSIDE)]
    left_out = sum(r["status"] == OUTSIDE for r in rows)
    tables = [
        Table(
            ["parameter", "from", "to"],
            [
                [labels[k], *(p.bounds if p.values is None else (min(p.values), max(p.values)))]
                for k, p in study.parameters.items()
            ],
            f"{len(rows)} runs by {study.spec.method}, seed {study.seed}; {len(failed)} failed"
            + (f", {left_out} left out by the limits of the loop" if left_out else ""),
        )
    ]
    if failed:
        shown = [[r["index"], r["case"], r["status"], r["reason"]] for r in failed[:WORST]]
        tables.append(Table(["row", "case", "status", "reason"], shown, "failed runs"))
    best = best_variation(study, rows)
    if best is not None:
        values = [[labels[k], v] for k, v in best["values"].items()]
        tables.append(Table(["parameter", "value"], values, f"best variation: {best['variation']}"))
    text = study.spec.text
    if summary is not None:
        text = f"{summary.sentence} {text}".strip()
        limited = [s for s in summary.spreads if s.limit is not None and s.within is not None]
        if limited:
            shown = [[s.case, s.metric, s.limit, 100 * (s.within or 0.0), *s.percentiles, s.worst] for s in limited]
            head = ["case", "metric", "limit", "% within", *(f"{p} %" for p in PERCENTILES), "worst"]
            tables.insert(0, Table(head, shown, "percentiles of the metrics with a limit, over all draws"))
    return Section("Overview", text, tables)


def best_variation(study: Study, rows: list[Row]) -> Row | None:
    """Return a row of the variation with the smallest objective among those within the limits, or None."""
    objective = study.spec.objective
    if objective is None:
        return None
    by_variation: dict[int, list[Row]] = {}
    for r in rows:
        by_variation.setdefault(r["variation"], []).append(r)
    scores = {}
    for variation, cases in by_variation.items():
        metrics = [r["metrics"] for r in cases]
        if any(r["status"] != "ok" for r in cases):
            continue
        if any(m[k] > limit for m in metrics for k, limit in objective.limits.items()):
            continue
        if any(r["metrics"][k] > v for r in cases for k, v in study.spec.limits.get(r["case"], {}).items()):
            continue
        scores[variation] = objective.score(cases)
    loop = LoopLimits(study, objective.loop) if objective.loop else None
    for variation in sorted(scores, key=lambda v: (scores[v], v)):
        row = by_variation[variation][0]
        if loop is None or max(loop.excess(study.settings(row["values"])).values()) <= 0:
            return row
    return None


def _case(
    study: Study,
    labels: dict[str, str],
    system: System,
    rows: list[Row],
    worst: list[Row],
    summary: Summary | None,
    folder: Path,
) -> Section:
    x = np.array([[r["values"][k] for k in labels] for r in rows])
    of = list(rows[0]["metrics"])
    y = np.array([[r["metrics"][k] for k in of] for r in rows])
    names = list(labels.values())
    metrics = [label(k, _unit(system, k)) for k in of]
    found = effects(np.array([[p.fraction(r["values"][k]) for k, p in study.parameters.items()] for r in rows]), y)
    share = "share of the variance of a metric that a parameter explains"
    tables = [_effects(names, of, found.first, f"{share} alone (first-order Sobol index)", found.explained)]
    tables += [_effects(names, of, found.total, f"{share} with its interactions (total Sobol index)")]
    tables += [_effects(names, of, sensitivity(x, y), "rank correlation of parameter and metric (-1 to 1)")]
    if summary is not None:
        spreads = [s for s in summary.spreads if s.case == system.case.name]
        head = ["metric", *(f"{p} %" for p in PERCENTILES), "worst", "limit"]
        shown = [[s.metric, *s.percentiles, s.worst, "-" if s.limit is None else s.limit] for s in spreads]
        tables.insert(0, Table(head, shown, "percentiles over all draws, the failed ones as infinite"))
    shown = [[r["index"], *r["values"].values(), *(r["metrics"].get(k, "-") for k in of)] for r in worst]
    tables.append(Table(["row", *names, *metrics], shown, "worst cases, by the largest ratio to a limit"))
    again = [[r["index"], command(study, r), str(save_settings(study, r, folder).relative_to(folder))] for r in worst]
    tables.append(Table(["row", "command", "settings, for --set @FILE"], again, "worst cases, to run again"))
    limits = study.limits(system.case)
    plots = [_distribution(k, metrics[j], y[:, j], limits.get(k)) for j, k in enumerate(of) if np.ptp(y[:, j]) > 0]
    plots += [
        Plot(f"{of[0]} over {name}", names[k], metrics[0], _spread(x[:, k], y[:, 0]))
        for k, name in enumerate(labels)
        if np.ptp(x[:, k]) > 0 and np.ptp(y[:, 0]) > 0
    ]
    return Section(f"Case {system.case.name}", "", tables, plots[:MOST_PLOTS])


def _effects(
    names: Sequence[str], of: Sequence[str], shares: Array, text: str, explained: Array | None = None
) -> Table:
    rows: list[list[object]] = [[name, *np.round(shares[k], 3).tolist()] for k, name in enumerate(names)]
    if explained is not None:
        rows.append(["explained by the fitted polynomial, for a run left out", *np.round(explained, 3).tolist()])
    return Table(["parameter", *of], rows, text)


def _unit(system: System, metric: str) -> str:
    if metric in system.case.metrics:
        return unit_of_metric(system, system.case.metrics[metric])
    return "dB" if metric.endswith("_db") else ""


def _distribution(metric: str, name: str, values: Array, limit: float | None) -> Plot:
    """Draw the empirical distribution function, with the limit."""
    at = np.sort(values)
    lines = [Line("share of the draws", at, np.arange(1, len(at) + 1) / len(at))]
    if limit is not None and limit < LONGEST * at[-1]:
        lines.append(Line("limit", np.array([limit, limit]), np.array([0.0, 1.0])))
    return Plot(f"distribution of {metric}", name, "share at or below", lines)


def sensitivity(x: Array, y: Array) -> Array:
    """Return Spearman's rank correlation of every column of x (n, p) with every column of y (n, m), shape (p, m).

    Constant columns have 0.
    """
    ranks = [_centred_ranks(a) for a in (x, y)]
    size = [np.sqrt((r**2).sum(axis=0)) for r in ranks]
    scale = np.outer(*size)
    return np.asarray(np.divide(ranks[0].T @ ranks[1], scale, out=np.zeros_like(scale), where=scale > 0))


def _centred_ranks(a: Array) -> Array:
    ranks = np.empty_like(a)
    for k, column in enumerate(a.T):  # ties share their mean rank; scipy.stats is slow to import
        _, place, count = np.unique(column, return_inverse=True, return_counts=True)
        ranks[:, k] = (np.cumsum(count) - 0.5 * (count - 1))[place]
    return np.asarray(ranks - ranks.mean(axis=0))


def _spread(x: Array, y: Array) -> list[Line]:
    """Return the median and the largest y in bins of equal count along x."""
    order = np.argsort(x, kind="stable")
    groups = np.array_split(order, min(BINS, len(order)))
    at = np.array([x[g].mean() for g in groups])
    return [
        Line("worst", at, np.array([y[g].max() for g in groups])),
        Line("median", at, np.array([np.median(y[g]) for g in groups])),
    ]


def spreads(summary: Summary, every: bool = False) -> str:
    """Return the answer of a study for the terminal: its sentence, and the percentiles of metrics.

    Parameters
    ----------
    summary : Summary
    every : bool
        Also the metrics without a limit.
    """
    shown = [s for s in summary.spreads if every or s.limit is not None]
    if not shown:
        return summary.sentence
    rows = [
        [
            *(s.case, s.metric),
            *("" if v is None else f"{k * v:.4g}" for k, v in ((1, s.limit), (100, s.within))),
            *(f"{v:.4g}" for v in (*s.percentiles, s.worst)),
        ]
        for s in shown
    ]
    head = ["case", "metric", "limit", "% within", *(f"{p} %" for p in PERCENTILES), "worst"]
    return f"{summary.sentence}\n{text_table(head, rows)}"
