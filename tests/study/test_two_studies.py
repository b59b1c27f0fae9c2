"""The page of two studies by numbers: shares, distributions, changed variations and changes of made results."""

from typing import Any

import numpy as np
import pytest

from hystfmu.report.diagrams import Parallel
from hystfmu.scenario.outcome.result import Change
from hystfmu.studies import compare
from hystfmu.studies.summary import Facts, Read, interval

N = 400
P = np.arange(float(N))
Q = np.tile([1.0, 5.0], N // 2)


def read(outcomes: str, limit: float = 2.0, q: Any = Q, random: bool = True, **metrics: Any) -> Read:
    """The result of a study with the parameters p and q, and metrics of the case a."""
    inside = outcomes.count("i")
    ends = list(interval(inside, N)) if random else None
    limits, names = {"a": dict.fromkeys(metrics, limit)}, {"p": "p (V)", "q": "q"}
    facts = Facts(
        name="s", scenario="x", inside=inside, interval=ends, limits=limits, units={"x": "um"}, parameters=names,
        outcomes=outcomes,
    )  # fmt: skip
    return Read(facts, np.column_stack([P, q]), {("a", k): v + 0 * P for k, v in metrics.items()})


def within(share: float) -> Any:
    """Values from 0 to above 2, of which a share is at most 2."""
    return P / (N * share - 1) * 2


REST = {f"m{k:02}": k / 100 for k in range(12)}
OLD = read("i" * 300 + "o" * 100, x=within(0.9), y=within(0.5), lost=np.inf, **REST)
NEW = read("o" * 250 + "i" * 100 + "u" * 50, 1.0, x=within(0.2), y=within(0.5), lost=1.0, **REST)


def test_bars_of_all_limits_and_the_four_strictest() -> None:
    bars = compare._shares((OLD, NEW)).bars
    assert [b.name for b in bars[:8]] == [
        f"{what}, {which}" for what in ("all limits", "a: lost", "a: x", "a: y") for which in ("old", "new")
    ]
    assert [b.share for b in bars[:8]] == pytest.approx([75, 25, 0, 100, 90, 10, 50, 25], abs=0.5)
    assert len(bars) == 10
    assert bars[0].interval == pytest.approx([100 * v for v in interval(300, N)])
    assert compare._shares((read("i" * N, random=False), NEW)).bars[0].interval is None


def test_distributions_on_common_axes() -> None:
    plots = compare._distributions((OLD, NEW))
    assert [p.title for p in plots[:3]] == ["a: x", "a: y", "a: m00"]  # a metric that one of them lost has none
    assert len(plots) == 11
    x, m = plots[0], plots[2]
    assert (x.x_label, x.y_label) == ("x in um", "% of the variations at or below")
    assert [line.name for line in x.lines] == ["old", "new", "old limit", "new limit"]
    most = 3 * float(np.quantile(NEW.metrics["a", "x"], 0.95))
    assert [line.x[-1] <= most for line in x.lines[:2]] == [True, True]
    for line, r in zip(x.lines, (OLD, NEW), strict=False):
        values = r.metrics["a", "x"]
        assert line.x.tolist() == values[values <= most].tolist()
        assert line.y.tolist() == pytest.approx((100 * (1 + P) / N)[values <= most].tolist())
    assert [(line.x.tolist(), line.y.tolist()) for line in x.lines[2:]] == [
        ([2.0, 2.0], [0.0, 100.0]), ([1.0, 1.0], [0.0, 100.0]),
    ]  # fmt: skip
    far = np.where(P < 390, 1.0, 50.0)
    (cut,) = compare._distributions((read("i" * N, x=far), read("i" * N, x=np.ones(N))))
    assert [len(line.x) for line in cut.lines] == [390, N, 2]  # up to three times the limit
    assert [line.name for line in cut.lines] == ["old", "new", "limit"]
    assert len(m.lines[0].x) == N


def test_the_variations_that_changed_their_verdict() -> None:
    found = compare._verdicts((OLD, NEW))
    assert found.title == "Draws that changed their verdict"
    (listed,) = found.folded
    assert list(listed.head) == ["draw", "p (V)", "q", "old", "new"]
    assert listed.rows == [[k, k, Q[k], "inside", "outside"] for k in range(100)]
    assert listed.caption == "350 variations, the first 100 of them"
    (drawn,) = found.plots
    assert isinstance(drawn, Parallel)
    assert [(a.name, a.lo, a.hi) for a in drawn.axes] == [("p (V)", 0.0, 349.0), ("q", 1.0, 5.0)]
    assert drawn.good.tolist() == [False] * 250 + [True] * 50  # not those that were outside before and are unstable now
    assert drawn.words == ("now inside the limits", "now outside")
    many = compare._verdicts((read("i" * N), read("o" * N))).plots[0]
    assert isinstance(many, Parallel)
    assert len(many.good) == 300
    one = compare._verdicts((read("i" * N), read("i" * 399 + "f")))
    assert (len(one.plots), one.tables[0].rows) == (0, [[399, 399.0, 5.0, "inside", "failed"]])
    assert one.tables[0].caption == "1 variations"
    assert len(compare._verdicts((read("i" * N), read("oo" + "i" * 398))).plots) == 1
    assert compare._verdicts((OLD, OLD)).text == "None."


def test_the_answer_and_pairs_of_the_same_variations() -> None:
    lo, hi = (100 * v for v in interval(300, N))
    before = f"Inside the limits: 300 of 400 variations (75 %, 95 % interval {lo:.3g} to {hi:.3g} %) before, "
    moved = read("o" + "i" * 299 + "i" * 10 + "o" * 90, random=False)
    p = compare._sign_test(10, 1)
    assert compare._answer((OLD, moved)) == (
        f"{before}309 of 400 variations (77.2 %) after. 11 variations changed their verdict, 10 to inside and 1 to "
        f"outside: chance alone is as one-sided with a probability of {p:.2g} (exact McNemar test)."
    )
    assert compare._answer((OLD, OLD)).endswith(" after. No variation changed its verdict.")
    other = read("i" * N, q=Q + 1)
    assert compare._answer((OLD, other)).endswith(f" after. {compare.UNPAIRED}")
    assert compare._verdicts((OLD, other)).text == compare.UNPAIRED


def test_what_changed_and_what_did_not() -> None:
    changed, same = compare._changes((read("i" * N, x=within(0.5), y=1.0), read("i" * 100 + "o" * 300, x=1.5, y=1.0)))
    at = [float(within(0.5)[k]) for k in (199, 379, 395)]
    assert changed == [
        Change("all cases", "inside the limits, %", 100.0, 25.0),
        Change("x/a", "x within its limit, %", 50.0, 100.0),
        *(Change("x/a", f"x in um, {p} % of the variations", v, 1.5) for p, v in zip((50, 95, 99), at, strict=True)),
    ]
    assert [(c.title, c.what, c.old) for c in same] == [
        ("x/a", "y within its limit, %", 100.0), *(("x/a", f"y, {p} % of the variations", 1.0) for p in (50, 95, 99)),
    ]  # fmt: skip
