"""Report of a study: share of variations inside the limits, distributions, effects of parameters, worst runs."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hystfmu.base import Array
from hystfmu.report.diagrams import Bars
from hystfmu.report.page import Diagram, Section, Table
from hystfmu.report.terminal import table as text_table
from hystfmu.scenario.outcome.metrics import label, unit_of
from hystfmu.scenario.outcome.result import grouped
from hystfmu.scenario.report.loops import loop_explorer
from hystfmu.scenario.report.page import write_report as write_page
from hystfmu.scenario.system.system import System
from hystfmu.studies import figures
from hystfmu.studies.spec import ObjectiveSpec, Study
from hystfmu.studies.summary import Row, Summary, command, facts, metric_unit, save_settings, worst_rows
from hystfmu.studies.task import OUTSIDE, LoopLimits

MOST_PLOTS = 24


class StudyCase:
    """Results of the successful runs of one case, for the report.

    Each row is the result of one run. `worst` contains the worst rows. `labels` contains the parameters with their
    units of measure.
    """

    def __init__(
        self, study: Study, labels: dict[str, str], system: System, rows: Sequence[Row], worst: Sequence[Row]
    ) -> None:
        self.study, self.system, self.worst = study, system, worst
        self.limits = study.limits(system.case)
        self.names, self.of = list(labels.values()), list(rows[0]["metrics"])
        self.x = np.array([[float(r["values"][k]) for k in labels] for r in rows])
        self.variations = [r["variation"] for r in rows]
        self.y = np.array([[r["metrics"][k] for k in self.of] for r in rows])
        fractions = [[p.fraction(r["values"][k]) for k, p in study.parameters.items()] for r in rows]
        self.found = figures.effects(np.array(fractions), self.y)
        limited = [k for k, name in enumerate(self.of) if name in self.limits]
        self.main = min(limited, key=self._within, default=0)

    def _within(self, column: int) -> float:
        limit = self.limits.get(self.of[column], math.inf)
        return float((self.y[:, column] <= limit).mean())

    def share(self) -> float:
        """Share of the runs that meet the strictest limit. The strictest limit is the one that the fewest runs meet."""
        return self._within(self.main)

    def decides(self) -> Bars | None:
        """Return a diagram of the total effects of the parameters on the metric with the strictest limit."""
        return figures.strongest(self.names, f"{self.system.case.name}: {self.of[self.main]}", self.found, self.main)

    def by_effect(self, labels: dict[str, str]) -> dict[str, str]:
        """Return the parameters, sorted by increasing effect on the metric with the strictest limit."""
        names = list(labels)
        return {names[k]: labels[names[k]] for k in np.argsort(self.found.total[:, self.main], kind="stable").tolist()}

    def objective(self) -> tuple[str, dict[int, float]]:
        """Return the metric with the strictest limit, with its unit of measure, and its value by variation."""
        name = label(self.of[self.main], metric_unit(self.system, self.of[self.main]))
        return name, dict(zip(self.variations, self.y[:, self.main].tolist(), strict=True))

    def section(self, summary: Summary | None, folder: Path) -> Section:
        """Return the section of this case: scatter plots, distributions, and collapsed tables."""
        units = [label(k, metric_unit(self.system, k)) for k in self.of]
        main, y = self.main, self.y
        limit = self.limits.get(self.of[main])
        plots = figures.scatter(self.of[main], units[main], self.names, self.x, y[:, main], self.found, main, limit)
        moving = [(j, k) for j, k in enumerate(self.of) if np.ptp(y[:, j]) > 0]
        plots += [figures.distribution(k, units[j], y[:, j], self.limits.get(k)) for j, k in moving]
        return Section(
            f"Case {self.system.case.name}", "", plots=plots[:MOST_PLOTS], folded=self._tables(units, summary, folder)
        )

    def _tables(self, units: Sequence[str], summary: Summary | None, folder: Path) -> list[Table]:
        of, found = self.of, self.found
        share = "share of the variance of a metric that a parameter explains"
        correlation = "rank correlation of parameter and metric (-1 to 1)"
        tables = [
            _effects(self.names, of, found.first, f"{share} alone (first-order Sobol index)", found.explained),
            _effects(self.names, of, found.total, f"{share} with its interactions (total Sobol index)"),
            _effects(self.names, of, sensitivity(self.x, self.y), correlation),
        ]
        if summary is not None:
            spreads = [s for s in summary.spreads if s.case == self.system.case.name]
            head = ["metric", *figures.HEAD[4:], "limit"]
            shown = [[s.metric, *s.percentiles, s.worst, "-" if s.limit is None else s.limit] for s in spreads]
            tables.insert(0, Table(head, shown, "percentiles over all variations, the failed ones as infinite"))
        rows = [[r["index"], *r["values"].values(), *(r["metrics"].get(k, "-") for k in of)] for r in self.worst]
        tables.append(Table(["row", *self.names, *units], rows, "worst cases, by the largest ratio to a limit"))
        again = [
            [r["index"], command(self.study, r), str(save_settings(self.study, r, folder).relative_to(folder))]
            for r in self.worst
        ]
        tables.append(Table(["row", "command", "settings, for --set @FILE"], again, "worst cases, to run again"))
        return tables


def _effects(
    names: Sequence[str], of: Sequence[str], shares: Array, text: str, explained: Array | None = None
) -> Table:
    rows: list[list[object]] = [[name, *np.round(shares[k], 3).tolist()] for k, name in enumerate(names)]
    if explained is not None:
        rows.append(["explained by the fitted polynomial, for a run left out", *np.round(explained, 3).tolist()])
    return Table(["parameter", *of], rows, text)


def sensitivity(x: Array, y: Array) -> Array:
    """Return Spearman's rank correlation of each column of x (n, p) with each column of y (n, m), shape (p, m).

    The correlation of a constant column is 0.
    """
    ranks = [_centred_ranks(a) for a in (x, y)]
    size = [np.sqrt((r**2).sum(axis=0)) for r in ranks]
    scale = np.outer(*size)
    return np.asarray(np.divide(ranks[0].T @ ranks[1], scale, out=np.zeros_like(scale), where=scale > 0))


def _centred_ranks(a: Array) -> Array:
    ranks = np.empty_like(a)
    # equal values get their mean rank; scipy.stats is not used because its import is slow
    for k, column in enumerate(a.T):
        _, place, count = np.unique(column, return_inverse=True, return_counts=True)
        ranks[:, k] = (np.cumsum(count) - 0.5 * (count - 1))[place]
    return np.asarray(ranks - ranks.mean(axis=0))


WORST = 10
DRAG = "A line is a variation. Drag along an axis to choose a range; with the keyboard, arrow keys on an axis."
DIVERGED = 1e100


def write_report(
    study: Study, systems: Sequence[System], rows: list[Row], summary: Summary | None, folder: Path
) -> Path:
    """Write report.html and report.json of a study into `folder`."""
    # diverged runs are omitted, because no axis can show metrics near the largest float
    good = [r for r in rows if r["status"] == "ok" and all(abs(v) < DIVERGED for v in r["metrics"].values())]
    labels = {k: _label(study, systems, k) for k in study.parameters}
    cases = [
        StudyCase(study, labels, system, of_case, worst_rows(rows, system.case.name, study.limits(system.case))[:WORST])
        for system in systems
        if (of_case := [r for r in good if r["case"] == system.case.name])
    ]
    least = min(cases, key=StudyCase.share, default=None)
    sections = [_answer(study, labels, least, rows, summary)]
    objective = least.objective() if least is not None else None
    if study.spec.objective is not None:
        objective = _objective(study.spec.objective), _scores(study, rows)
    draws = figures.all_draws(study, least.by_effect(labels) if least else labels, systems, rows, objective)
    if draws is not None:
        sections.append(Section("All variations", DRAG, plots=[draws]))
    sections += [case.section(summary, folder) for case in cases]
    explorer = loop_explorer(systems)
    sections += [explorer] if explorer is not None else []
    kept = {} if summary is None else facts(study, systems, labels, rows, summary)
    return write_page([], folder, sections, f"Study {study.spec.name} of {study.cases[0].scenario}", "", kept)


def _label(study: Study, systems: Sequence[System], parameter: str) -> str:
    """Return the label of a parameter with the unit of measure, or with a remark if the values are factors."""
    if parameter not in study.spec.parameters:
        return label(parameter, {"f_n": "Hz"}.get(parameter.rpartition(".")[2], ""))
    if study.parameters[parameter].scale is not None:
        return f"{parameter} as a factor"
    return label(parameter, next(filter(None, (unit_of(s, parameter) for s in systems)), ""))


def _answer(
    study: Study, labels: dict[str, str], least: StudyCase | None, rows: list[Row], summary: Summary | None
) -> Section:
    """Return the first section: result, shares inside the limits, strictest limits, and ranges of the parameters."""
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
        limited = [s for s in summary.spreads if s.limit is not None]
        if limited:
            text_of = "percentiles of the metrics with a limit, over all variations"
            tables.insert(0, Table(figures.HEAD, figures.spread_rows(limited), text_of))
    plots: list[Diagram | None] = [] if summary is None else [figures.shares(summary)]
    if study.spec.objective is not None:
        scores = _scores(study, rows)
        named = _objective(study.spec.objective)
        plots.append(figures.tuning(scores, named))
        if best is not None:
            at = ", ".join(f"{labels[k]} {v:.4g}" for k, v in best["values"].items())
            score = f"{named} = {scores[best['variation']]:.4g}"
            text = f"Variation {best['variation']} is the best: {score} at {at}. {text}".strip()
    if least is not None:
        plots.append(least.decides())
    return Section("", text, plots=[p for p in plots if p is not None], folded=tables)


def _objective(objective: ObjectiveSpec) -> str:
    """Return the name of the quantity that a study minimises."""
    return f"{objective.over_cases} of {objective.metric}" + (" / target" if objective.targets else "")


def best_variation(study: Study, rows: list[Row]) -> Row | None:
    """Return a row of the best variation: the one with the smallest objective among those inside the limits.

    Return None if no variation is inside the limits.
    """
    objective, scores = study.spec.objective, _scores(study, rows)
    loop = LoopLimits(study, objective.loop) if objective is not None and objective.loop else None
    first = {r["variation"]: r for r in reversed(rows)}
    for variation in sorted(scores, key=lambda v: (scores[v], v)):
        row = first[variation]
        if loop is None or max(loop.excess(study.settings(row["values"])).values()) <= 0:
            return row
    return None


def _scores(study: Study, rows: list[Row]) -> dict[int, float]:
    """Return the objective of each variation whose runs all meet the limits."""
    objective = study.spec.objective
    if objective is None:
        return {}
    scores = {}
    for variation, cases in grouped(rows, lambda r: int(r["variation"])).items():
        metrics = [r["metrics"] for r in cases]
        if any(r["status"] != "ok" for r in cases):
            continue
        if any(m[k] > limit for m in metrics for k, limit in objective.limits.items()):
            continue
        if any(r["metrics"][k] > v for r in cases for k, v in study.spec.limits.get(r["case"], {}).items()):
            continue
        scores[variation] = objective.score(cases)
    return scores


def spreads(summary: Summary, every: bool = False) -> str:
    """Return the result of a study for the terminal: a sentence, and a table of percentiles of the metrics.

    The table contains the metrics with a limit, or every metric if `every` is True.
    """
    shown = [s for s in summary.spreads if every or s.limit is not None]
    if not shown:
        return summary.sentence
    rows = [[v if isinstance(v, str) else f"{v:.3g}" for v in row] for row in figures.spread_rows(shown)]
    return f"{summary.sentence}\n{text_table(list(figures.HEAD), rows)}"
