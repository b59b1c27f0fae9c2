"""Figures and page of a study by the numbers they show: bars, axes, dots, curves, tables, the answer for a terminal."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import spearmanr

from hystfmu.report.page import Section
from hystfmu.studies import figures, report
from hystfmu.studies.figures import Effects
from hystfmu.studies.report import sensitivity
from hystfmu.studies.spec import ObjectiveSpec, ParameterSpec
from hystfmu.studies.summary import Spread, Summary, interval

PERCENT = (1.0, 2.0, 3.0, 4.0)


def spread(metric: str, within: float | None, case: str = "a", limit: float | None = 2.0) -> Spread:
    return Spread(case, metric, PERCENT, 5.0, limit if within is not None else None, within)


def summary(*spreads: Spread, between: bool = True, inside: int = 30, draws: int = 40) -> Summary:
    return Summary(draws, inside, 0, 0, interval(inside, draws) if between else None, spreads, ())


# ---- shares ---------------------------------------------------------------------------------------------------------
def test_shares_with_intervals_the_least_first() -> None:
    found = figures.shares(summary(spread("m", 0.9), spread("n", 0.8, "b"), spread("free", None)))
    assert found is not None
    assert [b.name for b in found.bars] == ["all limits of all cases", "b: n", "a: m"]
    assert [b.share for b in found.bars] == pytest.approx([75.0, 80.0, 90.0])
    for bar, count in zip(found.bars, (30, 32, 36), strict=True):
        lo, hi = interval(count, 40)
        assert bar.interval == pytest.approx((100 * lo, 100 * hi))
        assert bar.text == f"{100 * count / 40:.3g} % ({100 * lo:.3g} to {100 * hi:.3g})"
    assert found.title == "draws inside the limits, with 95 % intervals"
    grid = figures.shares(summary(spread("m", 0.9), between=False))
    assert grid is not None
    assert [(b.interval, b.text) for b in grid.bars] == [(None, "75 %"), (None, "90 %")]
    assert grid.title == "draws inside the limits"
    assert figures.shares(summary(spread("free", None))) is None
    many = figures.shares(summary(*(spread(f"m{k}", 0.5 + k / 100) for k in range(9))))
    assert many is not None
    assert len(many.bars) == 8


# ---- effects --------------------------------------------------------------------------------------------------------
def found(*total: float) -> Effects:
    t = np.array(total)[:, None] * [[1.0, 0.0]]
    return Effects(t / 4, t, np.ones(2))


def test_the_strongest_parameters_first() -> None:
    bars = figures.strongest(["p", "q", "r"], "a: m", found(0.2, 0.0, 0.8), 0)
    assert bars is not None
    assert [(b.name, b.share, b.text, b.part) for b in bars.bars] == [
        ("r", pytest.approx(80), "80 %", pytest.approx(20)), ("p", pytest.approx(20), "20 %", pytest.approx(5)),
    ]  # fmt: skip
    assert figures.strongest(["p", "q", "r"], "m", found(0.2, 0.0, 0.8), 1) is None
    many = figures.strongest([str(k) for k in range(9)], "m", found(*np.arange(1, 10) / 10), 0)
    assert many is not None
    assert [b.name for b in many.bars] == ["8", "7", "6", "5", "4", "3", "2", "1"]


@pytest.mark.parametrize("limit", [None, 3.0])
def test_dots_over_the_three_strongest(limit: float | None) -> None:
    x, y = np.random.default_rng(1).random((20, 5)), np.arange(20.0)
    plots = figures.scatter("m", "m (um)", list("pqrst"), x, y, found(0.1, 0.4, 0.0, 0.3, 0.2), 0, limit)
    assert [p.x_label for p in plots] == ["q", "s", "t"]
    assert all((p.y_label, p.points) == ("m (um)", 1000) for p in plots)
    lines = plots[0].lines
    if limit is None:
        assert [line.name for line in lines] == ["draws"]
        assert lines[0].x == pytest.approx(x[:, 1])
    else:
        assert [line.name for line in lines] == ["within the limit", "above it", "limit"]
        assert lines[0].y.tolist() == [0, 1, 2, 3]
        assert lines[1].y.tolist() == list(range(4, 20))
        assert (lines[2].x.tolist(), lines[2].y.tolist()) == ([x[:, 1].min(), x[:, 1].max()], [3.0, 3.0])
        assert [line.dots for line in lines] == [True, True, False]


def test_dots_without_effects_or_without_change() -> None:
    x = np.column_stack([np.arange(4.0), np.ones(4)])
    plots = figures.scatter("m", "m", ["p", "q"], x, np.array([1.0, 2, 1, 2]), found(0.0, 0.0), 0, 9.0)
    assert [p.x_label for p in plots] == ["p"]
    assert [line.name for line in plots[0].lines] == ["within the limit", "limit"]
    assert figures.scatter("m", "m", ["p", "q"], x, np.ones(4), found(0.0, 0.0), 0, None) == []


@pytest.mark.parametrize(("limit", "drawn"), [(None, False), (8.99, True), (9.0, False)])
def test_the_distribution_and_a_limit_that_is_not_far_off(limit: float | None, drawn: bool) -> None:
    plot = figures.distribution("m", "m (um)", np.array([3.0, 1.0, 2.0, 2.5]), limit)
    curve, *others = plot.lines
    assert (curve.x.tolist(), curve.y.tolist()) == ([1.0, 2.0, 2.5, 3.0], [25.0, 50.0, 75.0, 100.0])
    assert len(others) == drawn
    for line in others:
        assert (line.x.tolist(), line.y.tolist()) == ([limit, limit], [0.0, 100.0])


def test_the_best_so_far_is_a_staircase() -> None:
    plot = figures.tuning({4: 3.0, 1: 5.0, 7: 4.0}, "score")
    assert plot is not None
    best, all_ = plot.lines
    assert (best.x.tolist(), best.y.tolist()) == ([1, 4, 4, 7, 7], [5, 5, 3, 3, 3])
    assert (all_.x.tolist(), all_.y.tolist(), all_.dots) == ([1, 4, 7], [5, 3, 4], True)
    assert figures.tuning({}, "score") is None


# ---- all draws ------------------------------------------------------------------------------------------------------
def row(k: int, m: float, case: str = "a", status: str = "ok", **values: float) -> dict[str, Any]:
    return {
        "index": k, "variation": k, "case": case, "status": status, "reason": "", "id": str(k),
        "metrics": {"m": m} if status == "ok" else {}, "values": values or {"p": float(k), "q": 1.0},
    }  # fmt: skip


def case(name: str = "a") -> Any:
    return SimpleNamespace(case=SimpleNamespace(name=name, metrics={}))


def study(limits: Any = None, **spec: Any) -> Any:
    given = {
        "method": "random",
        "objective": None,
        "limits": {},
        "text": "Text.",
        "parameters": {"p": 1, "q": 1},
    } | spec
    return SimpleNamespace(
        limits=lambda of: (limits or {}).get(of.name, {}),
        spec=SimpleNamespace(**given),
        parameters={k: ParameterSpec.model_validate({"range": [0.0, 10.0]}) for k in "pq"},
        seed=3,
        settings=lambda values: values,
    )


LABELS = {"p": "p (V)", "q": "q"}


def test_a_line_for_each_draw_across_its_values() -> None:
    rows = [row(k, m) for k, m in enumerate((1.0, 2.0, 4.0, 6.0))]
    drawn = figures.all_draws(study({"a": {"m": 2.0}}), LABELS, [case()], rows)
    assert drawn is not None
    p, q, ratio = drawn.axes
    assert (p.name, p.lo, p.hi, p.at.tolist()) == ("p (V)", 0.0, 3.0, pytest.approx([0, 1 / 3, 2 / 3, 1]))
    assert (q.lo, q.hi, q.at.tolist()) == (1.0, 1.0, [0.5] * 4)
    assert (ratio.name, ratio.lo, ratio.hi) == ("largest metric over its limit", 0.0, 3.0)
    assert ratio.at.tolist() == pytest.approx([1 / 6, 1 / 3, 2 / 3, 1])
    assert ratio.limit == pytest.approx(1 / 3)
    assert drawn.good.tolist() == [True, True, False, False]
    assert drawn.title == "all 4 draws, each a line across its values"
    free = figures.all_draws(study(), LABELS, [case()], rows)
    assert free is not None
    assert len(free.axes) == 2
    scores = {r["variation"]: float(r["variation"]) for r in rows[1:]}
    tuned = figures.all_draws(study(), LABELS, [case()], rows, ("score", scores))
    assert tuned is not None
    reached = np.array([scores.get(r["variation"], max(scores.values())) for r in rows])  # a failed one is the worst
    assert tuned.axes[-1].at.tolist() == pytest.approx((reached - reached.min()) / np.ptp(reached))
    assert tuned.good.tolist() == (reached <= np.median(reached)).tolist()
    assert tuned.words == ("lower half of score", "upper half")
    assert figures.all_draws(study(), LABELS, [case()], rows[:1]) is None


def test_an_axis_ends_at_ten_times_the_limit_and_begins_at_one() -> None:
    limits = study({"a": {"m": 2.0}})
    far = figures.all_draws(limits, LABELS, [case()], [row(0, 1.0), row(1, 50.0)])
    near = figures.all_draws(limits, LABELS, [case()], [row(0, 0.2), row(1, 0.4)])
    assert far is not None
    assert near is not None
    assert (far.axes[2].hi, far.axes[2].at.tolist()) == (10.0, pytest.approx([0.05, 1.0]))
    assert far.axes[2].name.endswith(" (at the end: or more)")
    assert (near.axes[2].hi, near.axes[2].limit, near.axes[2].at.tolist()) == (1.0, 1.0, pytest.approx([0.1, 0.2]))
    both = [row(0, 1.0), row(0, 3.0, "b"), row(1, 1.0), row(1, 0.5, "b")]
    worst = figures.all_draws(study({"a": {"m": 2.0}, "b": {"m": 1.0}}), LABELS, [case(), case("b")], both)
    assert worst is not None
    assert (worst.axes[2].at * worst.axes[2].hi).tolist() == pytest.approx([3.0, 0.5])


def test_three_hundred_of_many_draws() -> None:
    drawn = figures.all_draws(study(), LABELS, [case()], [row(k, 1.0) for k in range(301)])
    assert drawn is not None
    assert len(drawn.good) == 300
    assert drawn.title == "300 of 301 draws, each a line across its values"
    assert (drawn.axes[0].lo, drawn.axes[0].hi) == (0.0, 300.0)


# ---- a case of the page ---------------------------------------------------------------------------------------------


def test_rank_correlations_with_ties_are_spearmans() -> None:
    rng = np.random.default_rng(4)
    x, y = rng.integers(0, 4, (30, 2)).astype(float), rng.integers(0, 5, (30, 3)).astype(float)
    y[:, 2] = 1.0
    want = [[spearmanr(x[:, i], y[:, j]).statistic for j in range(2)] for i in range(2)]
    assert sensitivity(x, y)[:, :2] == pytest.approx(np.array(want))
    assert sensitivity(x, y)[:, 2].tolist() == [0.0, 0.0]


# ---- the answer -----------------------------------------------------------------------------------------------------
def objective(**more: Any) -> Any:
    return ObjectiveSpec.model_validate({"metric": "m", **more})


def test_scores_of_variations_within_all_limits() -> None:
    rows = [row(0, 2.0), row(0, 3.0, "b"), row(1, 1.0), row(1, 9.0, "b"), row(2, 1.0), row(2, 0.0, "b", "timeout")]
    rows += [row(3, 0.6), row(3, 0.5, "b"), row(4, 5.0), row(4, 5.0, "b")]
    of = study(objective=objective(limits={"m": 5.0}), limits={"a": {"m": 4.0}})
    of.spec.limits = {"a": {"m": 4.0}}
    assert report._scores(of, rows) == {0: 3.0, 3: 0.6}
    best = report.best_variation(of, rows)
    assert best is not None
    assert (best["variation"], best["case"]) == (3, "a")
    assert report._scores(study(), rows) == {}
    assert report.best_variation(study(), rows) is None


def test_the_answer_comes_first() -> None:
    rows = [row(0, 2.0), row(1, 1.0), row(2, 1.0, status="timeout"), row(3, 1.0, status="outside")]
    rows += [row(k, 1.0, status="refused") for k in range(4, 16)]
    told = summary(spread("m", 0.5), spread("n", None), spread("none", 0.0))
    section: Section = report._answer(study(), LABELS, None, rows, told)
    assert section.text == f"{told.sentence} Text."
    limits, ranges, failed = section.folded
    assert limits.rows == [["a", "m", 2.0, 50.0, *PERCENT, 5.0], ["a", "none", 2.0, 0.0, *PERCENT, 5.0]]
    assert ranges.rows == [["p (V)", 0.0, 10.0], ["q", 0.0, 10.0]]
    assert ranges.caption == "16 runs by random, seed 3; 13 failed, 1 left out by the limits of the loop"
    assert [r[0] for r in failed.rows] == [2, *range(4, 13)]
    assert len(section.plots) == 1
    tuned = report._answer(study(objective=objective()), LABELS, None, rows[:2], None)
    assert tuned.text == "Variation 1 is the best: max of m = 1 at p (V) 1, q 1. Text."
    assert tuned.folded[1].rows == [["p (V)", 1.0], ["q", 1.0]]
    assert tuned.folded[0].caption == "2 runs by random, seed 3; 0 failed"
    assert len(tuned.plots) == 1


def test_percentiles_for_the_terminal() -> None:
    limited = summary(spread("m", 0.123456), spread("free", None))
    lines = report.spreads(limited).splitlines()
    assert lines[0] == limited.sentence
    assert [line.split() for line in lines if line.split()[:2] == ["a", "m"]] == [["a", "m", "2", "12.3", *"12345"]]
    assert "free" not in report.spreads(limited)
    every = report.spreads(limited, every=True)
    assert [line.split() for line in every.splitlines() if "free" in line] == [["a", "free", *"12345"]]
    assert report.spreads(summary(spread("free", None))) == summary(spread("free", None)).sentence
    assert math.isclose(report.DIVERGED, 1e100)
