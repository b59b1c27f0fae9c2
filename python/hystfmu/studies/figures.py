"""Diagrams of a study.

They show the shares of variations inside the limits, the total effects of the parameters, all variations in parallel
coordinates, and the distributions of the metrics.

In a notebook, the result of a study is shown as HTML, and the metrics are shown as a diagram.

First-order and total effects of the parameters on the metrics are computed from the existing runs of a study. A
polynomial chaos expansion is fitted to the runs by least squares. Its terms are products of polynomials that are
orthonormal under the distribution of each parameter. The square of each coefficient is a part of the variance of the
metric. The first-order Sobol index of a parameter is the sum over the terms with this parameter alone. The total index
is the sum over all terms with this parameter (Sudret 2008, Reliability Engineering & System Safety 93, 964-979). The
expansion has the degree with the smallest leave-one-out error.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base import Array, InputError, escape
from hystfmu.report.diagrams import Bar, Bars, Coordinate, Parallel
from hystfmu.report.page import Table, table
from hystfmu.report.plot import Figure, Line, Plot
from hystfmu.scenario.system.system import System
from hystfmu.studies.spec import Study
from hystfmu.studies.summary import PERCENTILES, Row, Spread, Summary, excess, interval, outcomes

MOST_DEGREE = 12
RUNS_PER_TERM = 2  # smallest number of runs for each term of the expansion
MOST_TERMS = 300
MOST_LEVELS = 64  # largest number of listed values of a parameter
EXACT = 0.9999  # explained share of the variance from which on no higher degree is tried


@dataclass(frozen=True)
class Effects:
    """Sobol indices of p parameters on m metrics.

    Attributes
    ----------
    first, total : array, shape (p, m)
        Share of the variance that a parameter explains alone (`first`), and with all its interactions (`total`). The
        shares are in [0, 1].
    explained : array, shape (m,)
        Share of the variance that the expansion predicts for runs that are not used in the fit. Below about 0.9, the
        indices are inaccurate.
    """

    first: Array
    total: Array
    explained: Array


def effects(x: Array, y: Array) -> Effects:
    """Estimate the Sobol indices of independent parameters.

    Parameters
    ----------
    x : array, shape (n, p)
        Parameter values: uniformly distributed in [0, 1], or at most 64 values with equal probability.
    y : array, shape (n, m)
        Metrics.
    """
    n, p = x.shape
    spread = np.ptp(x, axis=0) > 0
    variance = y.var(axis=0)
    moved = variance > 0
    best = Effects(np.zeros((p, y.shape[1])), np.zeros((p, y.shape[1])), np.zeros(y.shape[1]))
    bases = [_orthonormal(column) for column in x.T]
    for degree in range(1, MOST_DEGREE + 1):
        if not np.any(best.explained[moved] < EXACT):
            break
        width = math.comb(int(spread.sum()) + degree, degree)
        if RUNS_PER_TERM * width > n or width > MOST_TERMS:
            break
        powers = _powers([b.shape[1] - 1 for b in bases], degree)
        A = np.prod([b[:, k] for b, k in zip(bases, powers.T, strict=True)], axis=0)
        Q, R = np.linalg.qr(A)
        along = Q.T @ y
        left_out = (y - Q @ along) / np.maximum(1 - (Q**2).sum(axis=1), 1e-9)[:, None]
        explained = 1 - np.divide((left_out**2).mean(axis=0), variance, out=np.ones_like(variance), where=moved)
        squares = np.linalg.lstsq(R, along, rcond=1e-10)[0] ** 2
        total = squares[1:].sum(axis=0)
        share = np.divide(squares, total, out=np.zeros_like(squares), where=moved & (total > 0))
        better = moved & (explained > best.explained)
        best.explained[better] = explained[better]
        for k in range(p):
            has, others = powers[:, k] > 0, np.delete(powers, k, axis=1).any(axis=1)
            best.total[k, better] = share[has][:, better].sum(axis=0)
            best.first[k, better] = share[has & ~others][:, better].sum(axis=0)
    return best


def _orthonormal(column: Array) -> Array:
    """Return the orthonormal polynomials of degree 0, 1, ... at the values, shape (n, degrees + 1)."""
    at = 2 * column - 1
    levels = np.unique(at)
    if len(levels) > MOST_LEVELS:
        scale = np.sqrt(2 * np.arange(MOST_DEGREE + 1) + 1)
        return np.asarray(np.polynomial.legendre.legvander(at, MOST_DEGREE) * scale)
    # no more polynomials than levels
    Q, _ = np.linalg.qr(np.polynomial.legendre.legvander(levels, MOST_DEGREE))
    return np.asarray(np.sqrt(len(levels)) * Q[np.searchsorted(levels, at)])


def _powers(most: list[int], degree: int) -> Array:
    """Return the degree of each term of the expansion in each parameter, shape (terms, p).

    The total degree is at most `degree`. All degrees of the first term are 0.
    """
    rows: list[tuple[int, ...]] = [()]
    for m in most:
        rows = [(*r, k) for r in rows for k in range(min(m, degree - sum(r)) + 1)]
    return np.array(rows)


MOST_BARS, MOST_DRAWS, MOST_DOTS = 8, 300, 1000
MOST_RATIO = 10.0  # largest ratio of a metric to its limit on an axis
STRONGEST = 3  # number of parameters in the scatter plots of a metric
LONGEST = 3.0  # a limit above this multiple of the worst value is not plotted, because the curve would be too narrow


def shares(summary: Summary) -> Bars | None:
    """Plot the shares of variations inside all limits and inside each limit. Return None if there is no limit."""
    limited = sorted((s.within, f"{s.case}: {s.metric}") for s in summary.spreads if s.within is not None)
    if not limited:
        return None
    named = [(summary.inside / summary.draws, "all limits of all cases"), *limited][:MOST_BARS]
    return share_bars([share_bar(name, share, summary.draws, summary.interval is not None) for share, name in named])


def share_bar(name: str, share: float, draws: int, random: bool) -> Bar:
    """Return the bar of a share of `draws` variations, with its confidence interval if the variations are random."""
    text, ends = f"{100 * share:.3g} %", None
    if random:
        lo, hi = interval(round(share * draws), draws)
        ends = 100 * lo, 100 * hi
        text += f" ({ends[0]:.3g} to {ends[1]:.3g})"
    return Bar(name, 100 * share, text, ends)


def share_bars(bars: Sequence[Bar]) -> Bars:
    """Return the diagram of shares inside limits."""
    intervals = any(b.interval is not None for b in bars)
    return Bars(
        "variations inside the limits" + (", with 95 % intervals" if intervals else ""), "% of the variations", bars
    )


def strongest(names: Sequence[str], metric: str, found: Effects, column: int) -> Bars | None:
    """Plot the total effects of the parameters on a metric, the largest first.

    `names` contains the names of the parameters, and `column` is the column of the metric in the effects `found`.
    Return None if no parameter has an effect.
    """
    order = _order(found, column)
    if not order:
        return None
    bars = [
        Bar(names[k], 100 * total, f"{100 * total:.3g} %", part=100 * float(found.first[k, column]))
        for k in order[:MOST_BARS]
        for total in [float(found.total[k, column])]
    ]
    return Bars(f"what decides {metric}: total effect, in full colour what it does alone", "% of the variance", bars)


def _order(found: Effects, column: int) -> list[int]:
    """Return the parameters that affect a metric, the strongest first."""
    return [k for k in np.argsort(-found.total[:, column], kind="stable").tolist() if found.total[k, column] > 0]


def all_draws(
    study: Study,
    labels: Mapping[str, str],
    systems: Sequence[System],
    rows: Sequence[Row],
    objective: tuple[str, Mapping[int, float]] | None = None,
) -> Parallel | None:
    """Plot the variations of a study in parallel coordinates.

    The axes are the parameters and, as the last axis, the largest ratio of a metric to its limit. A large study is
    reduced to evenly selected variations. Return None if there are fewer than two variations. `labels` contains the
    labels of the parameters in the order of the axes. If there are no limits, `objective` replaces the ratio.
    `objective` contains a name and one value for each variation.
    """
    kinds = outcomes(study, systems, rows)
    limits = {s.case.name: study.limits(s.case) for s in systems}
    worst: dict[int, float] = {}
    for r in rows:
        worst[r["variation"]] = max(worst.get(r["variation"], -math.inf), excess(r, limits[r["case"]]))
    values = {r["variation"]: r["values"] for r in rows}
    if len(values) < 2:
        return None
    names = list(values)
    picked = [names[k] for k in np.unique(np.linspace(0, len(names) - 1, MOST_DRAWS).round().astype(int))]
    axes = [coordinate(name, np.array([float(values[v][k]) for v in picked])) for k, name in labels.items()]
    good, words = np.array([kinds[v] == "inside" for v in picked]), ("inside the limits", "outside")
    if any(limits.values()):
        ratios = np.array([worst[v] for v in picked])
        most = float(np.clip(np.max(ratios), 1.0, MOST_RATIO))
        name = "largest metric over its limit" + (" (at the end: or more)" if np.max(ratios) > most else "")
        axes.append(Coordinate(name, 0.0, most, np.clip(ratios, 0.0, most) / most, 1 / most))
    elif objective is not None and objective[1]:
        name, found = objective
        reached = np.array([found.get(v, max(found.values())) for v in picked])
        axes.append(coordinate(name, reached))
        good, words = reached <= np.median(reached), (f"lower half of {name}", "upper half")
    title = f"{len(picked)} of {len(names)} variations" if len(picked) < len(names) else f"all {len(names)} variations"
    return Parallel(f"{title}, each a line across its values", axes, good, words)


def coordinate(name: str, values: Array) -> Coordinate:
    """Return an axis of parallel coordinates that spans the values."""
    lo, hi = float(values.min()), float(values.max())
    return Coordinate(name, lo, hi, (values - lo) / (hi - lo) if hi > lo else np.full(len(values), 0.5))


def scatter(
    metric: str,
    y_label: str,
    names: Sequence[str],
    x: Array,
    y: Array,
    found: Effects,
    column: int,
    limit: float | None,
) -> list[Plot]:
    """Plot a metric over the parameters with the largest effects.

    `y_label` and the `names` of the p parameters include units of measure. x has the shape (n, p), and y has the shape
    (n,). `column` is the column of the metric in the effects.
    """
    order = _order(found, column) or [k for k in range(len(names)) if np.ptp(x[:, k]) > 0]
    plots = []
    for k in order[:STRONGEST] if np.ptp(y) > 0 else ():
        good = y <= limit if limit is not None else np.ones(len(y), dtype=bool)
        kinds = [("within the limit" if limit is not None else "variations", good), ("above it", ~good)]
        lines = [Line(name, x[m, k], y[m], dots=True) for name, m in kinds if m.any()]
        if limit is not None:
            lines.append(Line("limit", np.array([x[:, k].min(), x[:, k].max()]), np.array([limit, limit])))
        plots.append(Plot(f"{metric} over {names[k]}", names[k], y_label, lines, points=MOST_DOTS))
    return plots


def distribution(metric: str, label: str, values: Array, limit: float | None) -> Plot:
    """Plot the empirical distribution function of a metric, and the limit."""
    at = np.sort(values)
    lines = [Line("share of the variations", at, 100 * np.arange(1, len(at) + 1) / len(at))]
    if limit is not None and limit < LONGEST * at[-1]:
        lines.append(Line("limit", np.array([limit, limit]), np.array([0.0, 100.0])))
    return Plot(f"distribution of {metric}", label, "% of the variations at or below", lines)


def tuning(scores: Mapping[int, float], label: str) -> Plot | None:
    """Plot the objective in `scores` of each variation inside the limits, and the best value so far.

    Return None if no variation is inside the limits.
    """
    if not scores:
        return None
    x = np.array(sorted(scores), dtype=np.float64)
    y = np.array([scores[int(v)] for v in x])
    best = Line("best so far", np.repeat(x, 2)[1:], np.repeat(np.minimum.accumulate(y), 2)[:-1])
    return Plot("objective of the variations", "variation", label, [best, Line("variations", x, y, dots=True)])


MOST_FAILED, MOST_PLOTS = 5, 6
HEAD = ("case", "metric", "limit", "% within", *(f"{p} %" for p in PERCENTILES), "worst")


def outcome_html(summary: Summary | None, failed: Sequence[Row], files: Sequence[Path]) -> str:
    """Return the result of a study as escaped HTML without scripts."""
    parts = []
    if summary is not None:
        parts.append(f"<p>{escape(summary.sentence)}</p>")
        parts.append(table(Table(HEAD, spread_rows(summary.spreads))))
    if failed:
        shown = [(r["index"], r["case"], r["status"], r["reason"]) for r in failed[:MOST_FAILED]]
        parts.append(table(Table(("row", "case", "status", "reason"), shown, f"{len(failed)} runs failed")))
    return "".join([*parts, *(f"<p>{escape(str(f))}</p>" for f in files)])


def spread_rows(spreads: Sequence[Spread]) -> list[list[Any]]:
    """Return the rows of a table of percentiles with the head `HEAD`; a missing limit is empty."""
    limits = [["" if v is None else k * v for k, v in ((1, s.limit), (100, s.within))] for s in spreads]
    return [[s.case, s.metric, *of, *s.percentiles, s.worst] for s, of in zip(spreads, limits, strict=True)]


def distributions(rows: Sequence[Row], summary: Summary | None) -> Figure:
    """Plot the distributions of the metrics with a limit, or of all metrics if no metric has a limit.

    Failed runs are not used. An InputError is raised if all runs failed.
    """
    good = [r for r in rows if r["status"] == "ok"]
    limits = {(s.case, s.metric): s.limit for s in summary.spreads} if summary is not None else {}
    all_of = dict.fromkeys((r["case"], name) for r in good for name in r["metrics"])
    wanted = [key for key in all_of if limits.get(key) is not None] or list(all_of)
    plots = []
    for case, name in wanted[:MOST_PLOTS]:
        values = np.array([r["metrics"][name] for r in good if r["case"] == case and name in r["metrics"]])
        if (values := values[np.isfinite(values)]).size:
            plots.append(distribution(f"{name}, {case}", name, values, limits.get((case, name))))
    if not plots:
        raise InputError("A study must have a run that succeeded to plot. Got none.")
    return Figure(plots)
