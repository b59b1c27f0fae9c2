"""Figures, page and answer of a study by numbers: shares, ratios to limits, spreads, Sobol indices."""

import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.report.page import Section
from hystfmu.studies import figures, report, summary
from hystfmu.studies.figures import Effects
from hystfmu.studies.spec import ObjectiveSpec, ParameterSpec
from hystfmu.studies.summary import Spread, Summary, interval

PERCENT = (1.0, 2.0, 3.0, 4.0)


def spread(metric: str, within: float | None, case: str = "a", limit: float | None = 2.0) -> Spread:
    return Spread(case, metric, PERCENT, 5.0, limit if within is not None else None, within)


def summed(*spreads: Spread, between: bool = True, inside: int = 30, draws: int = 40) -> Summary:
    return Summary(draws, inside, 0, 0, interval(inside, draws) if between else None, spreads, ())


# ---- shares ---------------------------------------------------------------------------------------------------------
def test_shares_with_intervals_the_least_first() -> None:
    found = figures.shares(summed(spread("m", 0.9), spread("n", 0.8, "b"), spread("free", None)))
    assert found is not None
    assert [b.name for b in found.bars] == ["all limits of all cases", "b: n", "a: m"]
    assert [b.share for b in found.bars] == pytest.approx([75.0, 80.0, 90.0])
    for bar, count in zip(found.bars, (30, 32, 36), strict=True):
        lo, hi = interval(count, 40)
        assert bar.interval == pytest.approx((100 * lo, 100 * hi))
        assert bar.text == f"{100 * count / 40:.3g} % ({100 * lo:.3g} to {100 * hi:.3g})"
    assert found.title == "variations inside the limits, with 95 % intervals"
    grid = figures.shares(summed(spread("m", 0.9), between=False))
    assert grid is not None
    assert [(b.interval, b.text) for b in grid.bars] == [(None, "75 %"), (None, "90 %")]
    assert grid.title == "variations inside the limits"
    assert figures.shares(summed(spread("free", None))) is None
    many = figures.shares(summed(*(spread(f"m{k}", 0.5 + k / 100) for k in range(9))))
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
        assert [line.name for line in lines] == ["variations"]
        assert lines[0].x == pytest.approx(x[:, 1])
    else:
        assert [line.name for line in lines] == ["within the limit", "above it", "limit"]
        assert lines[0].y.tolist() == [0, 1, 2, 3]
        assert lines[1].y.tolist() == list(range(4, 20))
        assert (lines[2].x.tolist(), lines[2].y.tolist()) == ([x[:, 1].min(), x[:, 1].max()], [3.0, 3.0])
        assert [line.dots for line in lines] == [True, True, False]


def test_dots_without_effects_or_without_change() -> None:
    x = np.column_stack([np.arange(4.0) / 4, np.ones(4)])
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
        "method": "random", "objective": None, "limits": {}, "text": "Text.", "parameters": {"p": 1, "q": 1},
        "scenario": "x",
    } | spec  # fmt: skip
    return SimpleNamespace(
        limits=lambda of: (limits or {}).get(of.name, {}),
        spec=SimpleNamespace(**given),
        parameters={k: ParameterSpec.model_validate({"range": [0.0, 10.0]}) for k in "pq"},
        seed=3,
        file=Path("studies/s.toml"),
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
    assert drawn.title == "all 4 variations, each a line across its values"
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
    many = figures.all_draws(study(), LABELS, [case()], [row(k, 1.0) for k in range(400)])
    assert many is not None
    assert many.title.startswith("300 of 400 variations, ")
    assert (many.axes[0].hi * many.axes[0].at)[[0, 1, 150, 299]] == pytest.approx([0, 1, 200, 399])


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


# ---- the answer -----------------------------------------------------------------------------------------------------
def objective(**more: Any) -> Any:
    return ObjectiveSpec.model_validate({"metric": "m", **more})


def test_scores_of_variations_within_all_limits() -> None:
    rows = [row(0, 2.0), row(0, 3.0, "b"), row(1, 1.0), row(1, 9.0, "b"), row(2, 1.0), row(2, 0.0, "b", "timeout")]
    rows += [row(3, 0.6), row(3, 0.5, "b"), row(4, 5.0), row(4, 5.0, "b")]
    rows += [row(5, 4.0), row(5, 5.0, "b")]  # both at their limits
    of = study(objective=objective(limits={"m": 5.0}), limits={"a": {"m": 4.0}})
    of.spec.limits = {"a": {"m": 4.0}}
    assert report._scores(of, rows) == {0: 3.0, 3: 0.6, 5: 5.0}
    best = report.best_variation(of, rows)
    assert best is not None
    assert (best["variation"], best["case"]) == (3, "a")
    assert report._scores(study(), rows) == {}
    assert report.best_variation(study(), rows) is None


def test_the_answer_comes_first() -> None:
    rows = [row(0, 2.0), row(1, 1.0), row(2, 1.0, status="timeout"), row(3, 1.0, status="outside")]
    rows += [row(k, 1.0, status="refused") for k in range(4, 16)]
    told = summed(spread("m", 0.5), spread("n", None), spread("none", 0.0))
    of = study()
    of.parameters["q"] = ParameterSpec.model_validate({"values": [3.0, 1.0, 2.0]})
    section: Section = report._answer(of, LABELS, None, rows, told)
    assert section.text == f"{told.sentence} Text."
    limits, ranges, failed = section.folded
    assert limits.rows == [["a", "m", 2.0, 50.0, *PERCENT, 5.0], ["a", "none", 2.0, 0.0, *PERCENT, 5.0]]
    assert ranges.rows == [["p (V)", 0.0, 10.0], ["q", 1.0, 3.0]]
    assert ranges.caption == "16 runs by random, seed 3; 13 failed, 1 left out by the limits of the loop"
    assert [r[0] for r in failed.rows] == [2, *range(4, 13)]
    assert [plot.title for plot in section.plots] == ["variations inside the limits, with 95 % intervals"]
    tuned = report._answer(study(objective=objective(targets={"a": 0.5})), LABELS, None, rows[:2], None)
    assert tuned.text == "Variation 1 is the best: max of m / target = 2 at p (V) 1, q 1. Text."
    assert tuned.folded[1].rows == [["p (V)", 1.0], ["q", 1.0]]
    assert tuned.folded[0].caption == "2 runs by random, seed 3; 0 failed"
    assert [plot.title for plot in tuned.plots] == ["objective of the variations"]


def test_the_section_of_a_case_has_its_plots_and_tables(tmp_path: Path) -> None:
    rows = [row(k, 0.0, p=float(k % 8), q=float(k // 8)) for k in range(64)]
    for r in rows:
        p, q = r["values"].values()
        r["metrics"] = {"free": q / 10, "m": p, "n_db": p + q / 2, "still": 1.0} | {f"x{k}": p + k for k in range(25)}
    lost = row(64, 0.0, status="timeout", p=1.0, q=2.0)
    of, worst = study({"a": {"m": 7.0, "n_db": 3.0}}), [lost, rows[5]]
    made = report.StudyCase(of, LABELS, case(), rows, worst)
    assert made.share() == np.mean(made.y[:, 2] <= 3.0)
    assert list(made.by_effect(LABELS)) == ["q", "p"]
    bars = made.decides()
    assert bars is not None
    assert bars.title == "what decides a: n_db: total effect, in full colour what it does alone"
    assert made.objective() == ("n_db in dB", {r["variation"]: r["metrics"]["n_db"] for r in rows})
    assert report.StudyCase(study(), LABELS, case(), rows, worst).share() == 1.0
    told = summed(spread("m", 0.5), spread("free", None), spread("other", 0.5, "b"))
    section = made.section(told, tmp_path)
    assert section.title == "Case a"
    names = ["free", "m", "n_db", *(f"x{k}" for k in range(25))]  # what does not change has no distribution
    assert [plot.title for plot in section.plots] == [
        "n_db over p (V)", "n_db over q", *(f"distribution of {k}" for k in names[:22])
    ]  # fmt: skip
    assert [line.name for line in section.plots[3].lines] == ["share of the variations", "limit"]
    spreads, first, total, ranks, listed, again = section.folded
    assert spreads.head == ["metric", "5 %", "50 %", "95 %", "99 %", "worst", "limit"]
    assert spreads.rows == [["m", *PERCENT, 5.0, 2.0], ["free", *PERCENT, 5.0, "-"]]
    assert [r[:5] for r in first.rows] == [
        ["p (V)", 0.0, 1.0, 0.8, 0.0], ["q", 1.0, 0.0, 0.2, 0.0],
        ["explained by the fitted polynomial, for a run left out", 1.0, 1.0, 1.0, 0.0],
    ]  # fmt: skip
    assert [r[:5] for r in total.rows] == [r[:5] for r in first.rows[:2]]
    assert [r[1:3] for r in ranks.rows] == [[0.0, 1.0], [1.0, 0.0]]
    assert list(listed.head[:5]) == ["row", "p (V)", "q", "free", "m"]
    assert [r[:5] for r in listed.rows] == [[64, 1.0, 2.0, "-", "-"], [5, 5.0, 0.0, 0.0, 5.0]]
    assert again.rows[1] == [5, "hystfmu run studies/x --case a --set p=5.0 --set q=0.0", "worst/a-5.json"]
    assert len(made.section(None, tmp_path).folded) == 5


def test_distributions_and_html_of_few_metrics_and_failures() -> None:
    rows = [{**row(k, 0.0), "metrics": {f"m{j}": float(j + k) for j in range(7)}} for k in range(3)]
    rows += [{**row(3, 0.0, "b"), "metrics": {"m0": 4.0, "m1": math.inf}}, row(4, 0.0, status="timeout")]
    plots = figures.distributions(rows, None).plots
    assert [plot.title for plot in plots] == [f"distribution of m{j}, a" for j in range(6)]
    limited = summed(spread("m1", 0.5), spread("m0", 0.5, "b"), spread("m1", 0.5, "b"), spread("m3", None))
    first, second = figures.distributions(rows, limited).plots
    assert (first.title, first.lines[0].x.tolist(), len(first.lines)) == ("distribution of m1, a", [1.0, 2.0, 3.0], 2)
    assert (second.title, second.x_label) == ("distribution of m0, b", "m0")
    with pytest.raises(InputError, match="must have a run that succeeded to plot"):
        figures.distributions(rows[4:], limited)
    html = figures.outcome_html(limited, [row(k, 0.0, status="stopped") for k in range(7)], [Path("<a>"), Path("b")])
    assert html.count("stopped") == 5
    assert [word in html for word in ("7 runs failed", limited.sentence, "<p>&lt;a&gt;</p><p>b</p>")] == [True] * 3
    assert figures.outcome_html(None, [], [Path("b")]) == "<p>b</p>"


def test_percentiles_for_the_terminal() -> None:
    limited = summed(spread("m", 0.123456), spread("free", None))
    lines = report.spreads(limited).splitlines()
    assert lines[0] == limited.sentence
    assert [line.split() for line in lines if line.split()[:2] == ["a", "m"]] == [["a", "m", "2", "12.3", *"12345"]]
    assert "free" not in report.spreads(limited)
    every = report.spreads(limited, every=True)
    assert [line.split() for line in every.splitlines() if "free" in line] == [["a", "free", *"12345"]]
    assert report.spreads(summed(spread("free", None))) == summed(spread("free", None)).sentence
    assert math.isclose(report.DIVERGED, 1e100)


# ---- outcomes --------------------------------------------------------------------------------------------------------
def outcome(variation=0, case="a", status="ok", index=0, **metrics):
    return {"variation": variation, "case": case, "status": status, "index": index, "metrics": metrics, "values": {}}


def system(name="a", **kinds):
    metrics = {k: SimpleNamespace(kind=kind) for k, kind in kinds.items()}
    return SimpleNamespace(case=SimpleNamespace(name=name, metrics=metrics))


def limited(limits=None, method="random"):
    limits = limits or {}
    return SimpleNamespace(limits=lambda case: limits.get(case.name, {}), spec=SimpleNamespace(method=method))


# ---- ratios to limits -----------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("metrics", "limits", "ratio"), [
    ({"m": 3.0}, {"m": 2.0}, 1.5), ({"m": 3.0, "n": 8.0}, {"m": 2.0, "n": 2.0}, 4.0),
    ({"m": math.nan}, {"m": 2.0}, math.inf), ({"m": -1.0}, {"m": 0.0}, 1.0), ({"m": 0.0}, {"m": 0.0}, 1.0),
    ({"m": 1e-9}, {"m": 0.0}, math.inf), ({"m": -3.0}, {"m": -2.0}, 1.0), ({"m": -1.0}, {"m": -2.0}, math.inf),
    ({"m": 7.0, "n": 9.0}, {}, 7.0),
])  # fmt: skip
def test_the_largest_ratio_of_a_metric_to_its_limit(metrics, limits, ratio):
    assert summary.excess(outcome(**metrics), limits) == ratio
    assert summary.excess(outcome(status="timeout", **metrics), limits) == math.inf


def test_the_worst_rows_of_a_case_come_first():
    rows = [outcome(0, "a", index=3, m=1.0), outcome(1, "b", index=0, m=9.0), outcome(2, "a", index=1, m=2.0)]
    rows += [outcome(3, "a", "timeout", index=7), outcome(4, "a", index=0, m=1.0)]
    assert [r["variation"] for r in summary.worst_rows(rows, "a", {"m": 1.0})] == [3, 2, 4, 0]


@pytest.mark.parametrize(("status", "metrics", "limits", "unstable"), [
    ("stopped", {}, {}, True),
    ("timeout", {}, {}, False),
    ("ok", {"r": 25.0, "x": 50.0, "radius": 0.999}, {}, False),
    ("ok", {"r": 25.1}, {}, True),
    ("ok", {"x": 50.1}, {}, True),
    ("ok", {"r": math.nan}, {}, True),
    ("ok", {"radius": 1.0}, {}, True),
    ("ok", {"radius": math.nan}, {}, True),
    ("ok", {"other": 99.0}, {}, False),
    ("ok", {}, {}, False),
    ("ok", {"r": 83.0, "x": 100.0}, {"r": 90.0}, False),  # a jump
    ("ok", {"r": 91.0, "x": 100.0}, {"r": 90.0}, True),
    ("ok", {"r": 20.0, "x": 51.0}, {"r": 10.0}, True),
    ("ok", {"r": math.nan}, {"r": 90.0}, True),
    ("ok", {"r": 30.0}, {"other": 1.0}, True),  # no limit of an error
    ("ok", {"r": 30.0, "radius": 1.0}, {"r": 90.0}, True),
])  # fmt: skip
def test_a_lost_reference_or_a_pole_outside_is_unstable(status, metrics, limits, unstable):
    of = system(r="rms_percent", x="max_percent", other="peak")
    assert summary.is_unstable(of, outcome(status=status, **metrics), limits) is unstable


def test_the_outcome_of_a_variation_over_its_cases():
    systems = [system("a", m="peak"), system("b", m="peak")]
    rows = [
        *(outcome(0, c, m=1.0) for c in "ab"),
        *(outcome(1, c, m=v) for c, v in (("a", 1.0), ("b", 2.01))),
        outcome(2, "a", m=1.0), outcome(2, "b", "timeout"),
        outcome(3, "a", "timeout"), outcome(3, "b", "stopped"),
        outcome(4, "a", m=99.0), outcome(4, "b", m=2.0),
    ]  # fmt: skip
    found = summary.outcomes(limited({"b": {"m": 2.0}}), systems, rows)
    assert found == {0: "inside", 1: "outside", 2: "failed", 3: "unstable", 4: "inside"}
    told = summary.summarise(limited({"b": {"m": 2.0}}), systems, rows)
    assert told is not None
    assert (told.draws, told.inside, told.unstable, told.failed) == (5, 2, 1, 1)
    assert told.interval == summary.interval(2, 5)
    assert [w["variation"] for w in told.worst] == [3, 2]
    assert [(s.case, s.metric, s.limit) for s in told.spreads] == [("a", "m", None), ("b", "m", 2.0)]
    assert summary.summarise(limited(method="grid"), systems, rows).interval is None
    assert summary.summarise(limited(method="optuna"), systems, rows) is None


def test_the_spread_of_a_metric():
    rows = [outcome(k, "a", m=float(v)) for k, v in enumerate(np.random.default_rng(1).permutation(200))]
    rows += [outcome(500, "b", m=1e9)]
    (found,) = summary._spreads("a", {"m": 49.0}, rows)
    assert found == Spread("a", "m", (9.0, 99.0, 189.0, 197.0), 199.0, 49.0, 0.25)
    rows += [outcome(k, "a", m=math.nan) for k in range(200, 202)] + [outcome(300, "a", "timeout", n=1.0)] * 2
    m, n = summary._spreads("a", {}, rows)
    assert (m.worst, m.percentiles[3], m.limit, m.within) == (math.inf, math.inf, None, None)
    assert n.percentiles == (math.inf,) * 4
    none_ran = summary._spreads("a", {"m": 49.0}, [outcome(0, "a", "refused")])
    assert none_ran == [Spread("a", "m", (math.inf,) * 4, math.inf, 49.0, 0.0)]


LIMITED = (Spread("a", "m", (1.0, 2.0, 3.0, 4.0), 5.0, 3.0, 0.6),)
FREE = (Spread("a", "m", (1.0, 2.0, 3.0, 4.0), 5.0, None, None),)


@pytest.mark.parametrize(("told", "sentence"), [
    (Summary(8, 2, 0, 0, None, FREE, ()), "8 variations without limits; none is unstable."),
    (Summary(8, 2, 1, 3, None, FREE, ()), "8 variations without limits; 1 is unstable; 3 could not be run."),
    (Summary(8, 2, 2, 0, None, LIMITED, ()), "2 of 8 variations are inside the limits (25 %); 2 are unstable."),
    (
        Summary(8, 2, 0, 1, (0.0312, 0.651), LIMITED + FREE, ()),
        "2 of 8 variations are inside the limits (25 %; 95 % interval 3.12 to 65.1 %, Clopper-Pearson); none is "
        "unstable; 1 could not be run.",
    ),
])  # fmt: skip
def test_the_answer_in_one_sentence(told, sentence):
    assert told.sentence == sentence


def test_the_command_and_settings_of_a_row(tmp_path: Path):
    of = SimpleNamespace(
        file=tmp_path / "studies" / "s.toml",
        spec=SimpleNamespace(scenario="../scenarios/x"),
        settings=lambda values: {"pid.Kp": 2.5, "lag.b": "*0.5", "q": [1.0, 2.0], **values},
    )
    r = {**outcome(3, "fast"), "values": {"v": 1.0}}
    line = summary.command(of, r)
    given = "--set pid.Kp=2.5 --set 'lag.b=*0.5' --set 'q=[1.0, 2.0]' --set v=1.0"
    assert line == f"hystfmu run {tmp_path / 'scenarios' / 'x'} --case fast {given}"
    path = summary.save_settings(of, r, tmp_path)
    assert path == tmp_path / "worst" / "fast-3.json"
    assert json.loads(path.read_text()) == of.settings({"v": 1.0})
    assert path.read_text().startswith('{\n "pid.Kp": 2.5')


# ---- effects --------------------------------------------------------------------------------------------------------
def legendre(x):
    return np.sqrt(3) * (2 * x - 1)


def draws(n, p, seed=1):
    return np.random.default_rng(seed).random((n, p))


def test_what_is_explained_is_the_leave_one_out_error():
    x, rng = draws(60, 1), np.random.default_rng(2)
    y = (x + 0.3 * rng.normal(size=(60, 1)))[:, 0]
    best = 0.0
    for degree in range(1, 13):
        A = np.polynomial.legendre.legvander(2 * x[:, 0] - 1, degree)
        if 2 * (degree + 1) > 60:
            break
        errors = []
        for k in range(60):
            rest = np.delete(np.arange(60), k)
            errors.append(y[k] - A[k] @ np.linalg.lstsq(A[rest], y[rest], rcond=None)[0])
        best = max(best, 1 - np.mean(np.square(errors)) / y.var())
    assert figures.effects(x, y[:, None]).explained[0] == pytest.approx(best, rel=1e-6)


@pytest.mark.parametrize(("n", "degree", "fits"), [(8, 3, True), (7, 3, False), (100, 12, True), (100, 13, False)])
def test_the_degree_ends_at_twelve_and_with_two_runs_for_a_term(n: int, degree: int, fits: bool) -> None:
    x = draws(n, 1)
    y = np.polynomial.legendre.legval(2 * x - 1, np.eye(14)[degree])
    assert (figures.effects(x, y).explained[0] > 0.999) == fits


def test_a_term_more_than_three_hundred_or_a_share_of_a_ten_thousandth_is_left() -> None:
    x = draws(600, 23)
    assert figures.effects(x, x[:, :1] * x[:, 1:2]).explained[0] == pytest.approx(1.0)  # 300 terms
    more = draws(650, 24)
    assert figures.effects(more, more[:, :1] * more[:, 1:2]).explained[0] < 0.99  # 325
    one = draws(500, 1)
    bent = np.sqrt(5) / 2 * (3 * legendre(one) ** 2 / 3 - 1)
    for part, exact in ((0.005, False), (0.02, True)):
        assert (figures.effects(one, legendre(one) + part * bent).explained[0] > 1 - 1e-9) == exact


def test_polynomials_of_many_levels_are_those_of_a_range() -> None:
    few, many = np.arange(64.0) / 63, np.arange(65.0) / 64
    B = figures._orthonormal(np.repeat(few, 2))
    gram = B.T @ B / 128
    assert gram == pytest.approx(np.eye(13), abs=1e-9)
    want = np.polynomial.legendre.legvander(2 * many - 1, 12) * np.sqrt(2 * np.arange(13) + 1)
    assert figures._orthonormal(many) == pytest.approx(want)
