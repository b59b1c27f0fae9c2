"""The report of a study: sensitivities of the metrics, worst cases, failed runs with their reasons."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.report.page import Section, Table
from hystfmu.report.plot import Line, Plot
from hystfmu.scenario.report.page import write_report as write_page
from hystfmu.scenario.system.measures import label, unit_of, unit_of_metric
from hystfmu.scenario.system.system import System
from hystfmu.studies.loop_limits import LoopLimits
from hystfmu.studies.spec import Study

WORST, BINS, MOST_PLOTS = 10, 12, 24
DIVERGED = 1e100


def write_report(study: Study, systems: Sequence[System], rows: list[dict[str, Any]], folder: Path) -> Path:
    """Write report.html and report.json into `folder`; `systems` are the cases of the study."""
    # omit diverged runs: no axis can show metrics near the largest float
    good = [r for r in rows if r["status"] == "ok" and all(abs(v) < DIVERGED for v in r["metrics"].values())]
    labels = {k: _label(study, systems, k) for k in study.parameters}
    sections = [_summary(study, labels, rows)]
    for system in systems:
        of_case = [r for r in good if r["case"] == system.case.name]
        if of_case:
            sections.append(_case(labels, system, of_case))
    return write_page([], folder, sections, f"Study {study.spec.name}")


def _label(study: Study, systems: Sequence[System], parameter: str) -> str:
    """Label a parameter with its unit of measure, or as a factor."""
    if study.parameters[parameter].scale is not None:
        return f"{parameter} as a factor"
    return label(parameter, next(filter(None, (unit_of(s, parameter) for s in systems)), ""))


def _summary(study: Study, labels: dict[str, str], rows: list[dict[str, Any]]) -> Section:
    failed = [r for r in rows if r["status"] != "ok"]
    tables = [
        Table(
            ["parameter", "from", "to"],
            [
                [labels[k], *(p.bounds if p.values is None else (min(p.values), max(p.values)))]
                for k, p in study.parameters.items()
            ],
            f"{len(rows)} runs by {study.spec.method}, seed {study.spec.seed}; {len(failed)} failed",
        )
    ]
    if failed:
        shown = [[r["index"], r["case"], r["status"], r["reason"]] for r in failed[:WORST]]
        tables.append(Table(["row", "case", "status", "reason"], shown, "failed runs"))
    best = best_variation(study, rows)
    if best is not None:
        values = [[labels[k], v] for k, v in best["values"].items()]
        tables.append(Table(["parameter", "value"], values, f"best variation: {best['variation']}"))
    return Section("Overview", study.spec.text, tables)


def best_variation(study: Study, rows: list[dict[str, Any]]) -> dict[str, Any] | None:
    """Return a row of the variation with the smallest objective among those within the limits, or None."""
    objective = study.spec.objective
    if objective is None:
        return None
    by_variation: dict[int, list[dict[str, Any]]] = {}
    for r in rows:
        by_variation.setdefault(r["variation"], []).append(r)
    scores = {}
    for variation, cases in by_variation.items():
        metrics = [r["metrics"] for r in cases]
        if any(r["status"] != "ok" for r in cases):
            continue
        if any(m[k] > limit for m in metrics for k, limit in objective.limits.items()):
            continue
        scores[variation] = objective.score(cases)
    loop = LoopLimits(study, objective.loop) if objective.loop else None
    for variation in sorted(scores, key=lambda v: (scores[v], v)):
        row = by_variation[variation][0]
        if loop is None or max(loop.excess(study.settings(row["values"])).values()) <= 0:
            return row
    return None


def _case(labels: dict[str, str], system: System, rows: list[dict[str, Any]]) -> Section:
    of = system.case.metrics
    x = np.array([[r["values"][k] for k in labels] for r in rows])
    y = np.array([[r["metrics"][k] for k in of] for r in rows])
    names, metrics = list(labels.values()), [label(k, unit_of_metric(system, m)) for k, m in of.items()]
    tables = [
        Table(
            ["parameter", *of],
            [[name, *np.round(measure[k], 3).tolist()] for k, name in enumerate(labels)],
            text,
        )
        for measure, text in (
            (
                main_effect(x, y),
                "share of the variance of a metric that one parameter explains (0 to 1)",
            ),
            (sensitivity(x, y), "rank correlation of parameter and metric (-1 to 1)"),
        )
    ]
    worst = np.argsort(-y[:, 0], kind="stable")[:WORST]
    tables.append(
        Table(
            ["row", *names, *metrics],
            [[rows[k]["index"], *x[k].tolist(), *y[k].tolist()] for k in worst],
            f"worst cases by {next(iter(of))}",
        )
    )
    plots = [
        Plot(f"{next(iter(of))} over {name}", names[k], metrics[0], _spread(x[:, k], y[:, 0]))
        for k, name in enumerate(labels)
        if np.ptp(x[:, k]) > 0 and np.ptp(y[:, 0]) > 0
    ]
    return Section(f"Case {system.case.name}", "", tables, plots[:MOST_PLOTS])


def sensitivity(x: Array, y: Array) -> Array:
    """Return Spearman's rank correlation of every column of x (n, p) with every column of y (n, m), shape (p, m).

    Constant columns have 0.
    """
    ranks = [_centred_ranks(a) for a in (x, y)]
    size = [np.sqrt((r**2).sum(axis=0)) for r in ranks]
    scale = np.outer(*size)
    return np.asarray(np.divide(ranks[0].T @ ranks[1], scale, out=np.zeros_like(scale), where=scale > 0))


def main_effect(x: Array, y: Array) -> Array:
    """Return the correlation ratio (first-order sensitivity) of y (n, m) on every column of x (n, p), shape (p, m).

    The ratio is the variance of the means of y in bins of equal count along x, over the variance of y (Pearson 1905).
    It shows non-monotonic effects, which a rank correlation misses.  Constant columns have 0.  Without any effect the
    expected value is about bins / n for n runs.
    """
    total = y.var(axis=0)
    shares = np.zeros((x.shape[1], y.shape[1]))
    for k, column in enumerate(x.T):
        values = np.unique(column)
        if len(values) <= BINS:
            groups = [np.flatnonzero(column == v) for v in values]
        else:
            groups = np.array_split(np.argsort(column, kind="stable"), BINS)
        means = np.array([y[g].mean(axis=0) for g in groups])
        weights = np.array([len(g) for g in groups]) / len(column)
        between = (weights[:, None] * (means - y.mean(axis=0)) ** 2).sum(axis=0)
        shares[k] = np.divide(between, total, out=np.zeros_like(total), where=total > 0)
    return shares


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
