"""A case of a study: its rows as arrays, the effects of the parameters, and its part of the page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.report.bars import Bars
from hystfmu.report.page import Section, Table
from hystfmu.scenario.system.measures import label, unit_of_metric
from hystfmu.scenario.system.system import System
from hystfmu.studies.effects import effects
from hystfmu.studies.figures import distribution, scatter, strongest
from hystfmu.studies.spec import Study
from hystfmu.studies.summary import PERCENTILES, Row, Summary, command, save_settings

MOST_PLOTS = 24


class StudyCase:
    """The rows of a case that ran, and its worst rows.

    Parameters
    ----------
    study : Study
    labels : dict of str to str
        The parameters with their units of measure.
    system : System
    rows, worst : sequence of dict
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
        self.found = effects(np.array(fractions), self.y)
        limited = [k for k, name in enumerate(self.of) if name in self.limits]
        self.main = min(limited, key=self._within, default=0)

    def _within(self, column: int) -> float:
        limit = self.limits.get(self.of[column], math.inf)
        return float((self.y[:, column] <= limit).mean())

    def share(self) -> float:
        """Share of the runs within the limit that the fewest runs meet."""
        return self._within(self.main)

    def decides(self) -> Bars | None:
        """Return the diagram of the total effects on the metric whose limit the fewest runs meet."""
        return strongest(self.names, f"{self.system.case.name}: {self.of[self.main]}", self.found, self.main)

    def by_effect(self, labels: dict[str, str]) -> dict[str, str]:
        """Return the parameters, with the one that affects this metric most at the end."""
        names = list(labels)
        return {names[k]: labels[names[k]] for k in np.argsort(self.found.total[:, self.main], kind="stable").tolist()}

    def objective(self) -> tuple[str, dict[int, float]]:
        """Return that metric with its unit of measure, and its value by variation."""
        name = label(self.of[self.main], metric_unit(self.system, self.of[self.main]))
        return name, dict(zip(self.variations, self.y[:, self.main].tolist(), strict=True))

    def section(self, summary: Summary | None, folder: Path) -> Section:
        """Return the part of the page: scatter, distributions, and folded tables."""
        units = [label(k, metric_unit(self.system, k)) for k in self.of]
        main, y = self.main, self.y
        limit = self.limits.get(self.of[main])
        plots = scatter(self.of[main], units[main], self.names, self.x, y[:, main], self.found, main, limit)
        plots += [
            distribution(k, units[j], y[:, j], self.limits.get(k)) for j, k in enumerate(self.of) if np.ptp(y[:, j]) > 0
        ]
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
            head = ["metric", *(f"{p} %" for p in PERCENTILES), "worst", "limit"]
            shown = [[s.metric, *s.percentiles, s.worst, "-" if s.limit is None else s.limit] for s in spreads]
            tables.insert(0, Table(head, shown, "percentiles over all draws, the failed ones as infinite"))
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


def metric_unit(system: System, metric: str) -> str:
    """Return the unit of measure of a metric of a case, or of its linearised loop; empty for a ratio."""
    if metric in system.case.metrics:
        return unit_of_metric(system, system.case.metrics[metric])
    return "dB" if metric.endswith("_db") else ""


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
