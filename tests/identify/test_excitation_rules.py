"""Lag, feedback, drift, dead time and minor loops of a record against their formulas, and the limits of each rule."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import plants
import pytest
from scipy.stats import norm, rankdata

from hystfmu import Dataset
from hystfmu.data.reversals import turning_points
from hystfmu.identify.excitation import minor_loops, timing
from hystfmu.identify.excitation.minor_loops import NONE, OPEN_LOOPS, RETURN_POINT, UNKNOWN, examine
from hystfmu.model import guards

H = 1e-3
RNG = np.random.default_rng()
SEED = int(RNG.integers(1 << 31))
U = np.linspace(0.0, 1.0, 50)
RECORD = Dataset.from_signal(U, U, H)


@pytest.fixture
def rng():
    print("seed", SEED)
    return np.random.default_rng(SEED)


def residuals(data):
    return timing.residuals(data.u, data.y, data.train)


def lag(data):
    return timing.lag(data.u, data.y, data.train)


def regression(u, rows):
    """1, x, x^2, x^3 and twelve plays up to 98 % of half the trained range."""
    x = (u - u[rows].mean()) / np.ptp(u[rows])
    r = 0.98 * np.ptp(u[rows]) / 2 * np.arange(1, 13) / 12
    return np.column_stack([x**0, x, x**2, x**3, plants.plays(u, r, u[0])])


def left(a, y):
    return y - a @ np.linalg.lstsq(a, y, rcond=None)[0]


# ---- the input follows the error ------------------------------------------------------------------------------------
def white(v):
    """What a prediction from the last twelve values leaves, as centred ranks in (-1/2, 1/2)."""
    v = v - v.mean()
    past = np.array([v[k - 12 : k] for k in range(12, len(v))])
    return (rankdata(left(past, v[12:])) - 1) / (len(v) - 12) - 0.5


def sums(a, b):
    """Of ten shifts each: 1 to 10, 11 to 20, and so on to 100."""
    n = len(a)
    squares = [n * float(a[: n - k] @ b[k:]) ** 2 / float(a @ a * (b @ b)) for k in range(1, 101)]
    return np.reshape(squares, (10, 10)).sum(1)


@pytest.mark.parametrize(("train", "rows"), [(slice(None), slice(0, 2000)), (slice(100, 500), slice(100, 500))])
def test_the_correlation_of_residual_and_later_increments(rng, train, rows):
    u = 3 + np.cumsum(rng.normal(size=2600))
    data = Dataset.from_signal(u, 0.3 * u + rng.normal(size=2600), H, "loop", train)
    e = white(left(regression(u, train)[rows], data.y[rows]))
    v = white(np.diff(u[rows], prepend=u[rows][0]))
    later = sums(e, v)
    assert timing.correlation(data.u, data.y, data.train) == pytest.approx(
        (later[0], max(*later[1:], *sums(v, e))), rel=1e-6
    )


@pytest.mark.parametrize(("rows", "told"), [(240, True), (239, False)])
def test_a_record_of_twenty_rows_a_coefficient_is_enough(rng, rows, told):
    u = np.cumsum(rng.normal(size=400))
    data = Dataset.from_signal(u, u + rng.normal(size=400), H, "short", slice(100, 100 + rows))
    assert (timing.correlation(data.u, data.y, data.train) != (0.0, 0.0)) is told


@pytest.mark.parametrize(
    ("found", "warned"),
    [((60.0, 20.0), 1), ((59.9, 0.0), 0), ((61.0, 20.4), 0), ((61.0, 20.3), 1), ((900.0, 301.0), 0), ((50.0, 1.0), 0)],
)
def test_feedback_is_sure_at_60_and_three_times_the_other_direction(monkeypatch, found, warned):
    monkeypatch.setattr(timing, "correlation", lambda *record: found)
    assert len(timing.feedback(RECORD)) == warned


# ---- drift ----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("rows", [1000, 31, 41, 7, 6])
def test_the_drift_is_the_slope_of_a_line_through_chunk_means(rng, rows):
    e = rng.normal(size=rows)
    n = min(20, rows // 2)
    chunks = np.array([part.mean() for part in np.array_split(e, n)])
    t = (np.arange(n) + 0.5) / n
    a = np.column_stack([t, np.ones(n)])
    slope, rest = np.linalg.lstsq(a, chunks, rcond=None)[0][0], left(a, chunks)
    covariance = np.linalg.inv(a.T @ a)[0, 0]
    total, error = guards.drift(e)
    assert total == pytest.approx(slope)
    assert error == pytest.approx(np.sqrt(rest @ rest / max(n - 2, 1) * covariance), abs=1e-12)


@pytest.mark.parametrize("rows", [5, 4, 3, 2])
def test_two_means_show_no_drift(rows):
    assert guards.drifts(np.arange(rows), 1.0) == []


@pytest.mark.parametrize(
    ("total", "error", "span", "warned"),
    [(0.5, 0.1, 100.0, 1), (0.499, 0.01, 100.0, 0), (-0.5, 0.0999, 100.0, 1), (5.0, 1.001, 100.0, 0), (5.0, 1.0, 9, 1)],
)
def test_drift_is_told_from_half_a_percent_and_five_standard_errors_on(monkeypatch, total, error, span, warned):
    monkeypatch.setattr(guards, "drift", lambda e: (total, error))
    assert len(guards.drifts(np.zeros(4), span)) == warned


# ---- dead time ------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("late", [0, 3])
def test_the_answer_to_kinks_is_the_regression_on_second_differences(rng, late):
    lag, n = 3, 700
    u = rng.normal(size=n).cumsum()
    # an output that leads makes the leading weights larger than their errors say
    y = (np.roll(u, -2) if late else 0) + 0.1 * rng.normal(size=n).cumsum()
    du, dy = np.diff(u, 2), np.diff(y, 2)
    rows = np.arange(lag + 8, len(du) - 8)
    a = np.column_stack([du[rows - k] for k in range(-8, lag + 9)])
    w = np.linalg.lstsq(a, dy[rows], rcond=None)[0]
    sigma = np.sqrt(np.mean((dy[rows] - a @ w) ** 2) * np.diag(np.linalg.inv(a.T @ a)))
    chance = np.sqrt(np.mean((w[:8] / sigma[:8]) ** 2))
    found, error = timing.answer(u, y, lag)
    assert found == pytest.approx(w)
    assert error == pytest.approx(sigma * max(chance, 1.0))


@pytest.mark.parametrize(("n", "told"), [(357, False), (358, True), (900, True)])
def test_twenty_rows_a_weight_are_needed(rng, n, told):
    u = rng.normal(size=n)
    w, _ = timing.answer(u, np.roll(u, 1), 0)
    assert len(w) == 17
    assert bool(w.any()) is told


LEAD, ERROR = [0.02, -0.02, 0.02, -0.02] * 2, 0.01


@pytest.mark.parametrize(("weights", "error", "lag", "found"), [
    ([0.0, 0.0, 1.0, 0.5], ERROR, 2, 2),
    ([1.0, 0.5, 0.2, 0.1], ERROR, 2, 0),
    ([0.0, 0.11, 1.0, 0.5], ERROR, 2, 1),
    ([0.0, 0.1, 1.0, 0.5], ERROR, 2, 1),
    ([0.0, 0.09, 1.0, 0.5], ERROR, 2, 2),  # less than a tenth of the largest
    ([0.0, 0.11, 1.0, 0.5], 0.11 / 1.9, 2, 2),  # beyond 1.96 standard errors once in twenty
    ([0.0, 0.115, 1.0, 0.5], 0.115 / 2.0, 2, 1),
    ([0.12, 1.0, 0.5, 0.1], 0.12 / 1.7, 1, 0),  # one weight: 1.64 standard errors
    ([0.0, 0.0, 1.0, 0.5], 1 / 4.99, 2, None),  # unclear
    ([0.0, 0.0, 1.0, 0.5], 1 / 5.01, 2, 2),
    ([0.0, 0.0, 0.0, 1.0], ERROR, 2, 3),
    ([0.0, 0.0, 0.0, 0.0, 1.0], ERROR, 2, None),  # later than a row after the lag
    ([0.0, 0.0, 0.079, 0.02], 1e-4, 2, None),  # leading weights of a quarter: a smooth input
    ([0.0, 0.0, 0.081, 0.02], 1e-4, 2, 2),
])  # fmt: skip
def test_the_first_answer_that_chance_does_not_explain(monkeypatch, weights, error, lag, found):
    w = np.array([*LEAD, *weights])
    monkeypatch.setattr(timing, "answer", lambda u, y, late: (w, np.full(len(w), error)))
    assert norm.ppf(1 - 0.05 / 2) == pytest.approx(1.96, abs=1e-3)
    assert timing.dead_time(U, U, lag) == found


# ---- lag of the sensor ----------------------------------------------------------------------------------------------
@pytest.mark.parametrize("train", [slice(None), slice(300, 2700), slice(900, 2900)])
def test_the_residual_of_each_lag_until_it_rises(rng, train):
    u = 50 + np.cumsum(rng.normal(size=3000))
    y = 5 * np.r_[[u[0]] * 4, u[:-4]] + 0.1 * rng.normal(size=3000)
    data = Dataset.from_signal(u, y, H, "late", train)
    first, end = data.train.start, data.train.stop
    a = regression(u[:end], data.train)
    rows = np.arange(max(first, 8), end)[:: 2 if end - first > 2000 else 1]
    want = [np.sqrt(np.mean(left(a[rows - k], y[rows]) ** 2)) for k in range(6)]
    assert np.argmin(want) == 4
    assert residuals(data) == pytest.approx(100 * np.array(want) / np.ptp(y[first:end]))
    assert lag(data)[0] == 4


def test_lags_up_to_eight_rows_and_a_tenth_of_the_record(monkeypatch):
    ramp = np.linspace(0, 1, 200)
    data = Dataset.from_signal(np.sin(40 * ramp), np.roll(np.sin(40 * ramp), 30), H, "far")
    assert len(residuals(data)) <= 9
    u = np.cumsum(np.random.default_rng(1).normal(size=100))
    late = Dataset.from_signal(u, np.r_[[u[0]] * 30, u[:-30]], H, "far")
    assert len(residuals(late.with_train((0, 47)))) == 1  # fewer than 4 rows a play
    assert len(residuals(late.with_train((0, 48)))) > 1
    assert residuals(late.with_train((0, 47))).tolist() == [0.0]
    assert len(residuals(late.with_train((52, 99)))) == 1
    walk = np.cumsum(np.random.default_rng(1).normal(size=160))
    for rows, lags in ((60, 6), (69, 6), (70, 7), (100, 8)):  # a tenth of the rows, at most eight
        falling = iter(range(20, 0, -1))
        monkeypatch.setattr(timing, "rms", lambda e, falling=falling: float(next(falling)))
        table = residuals(Dataset.from_signal(walk, walk, H, "far", slice(30, 30 + rows)))
        assert len(table) == lags + 1
    monkeypatch.undo()
    falling = Dataset.from_signal(np.arange(2000.0) ** 2, np.arange(2000.0) ** 2, H)
    assert len(residuals(falling)) >= 2


@pytest.mark.parametrize(("residuals", "found"), [
    ([1.16, 1.0, 1.2], 1),
    ([1.14, 1.0, 1.2], 0),
    ([0.3, 0.199, 0.25], 1),
    ([0.3, 0.201, 0.25], 0),  # less than 0.1 % of the span
    ([3.0, 2.0, 1.0], 0),  # no minimum inside
    ([3.0, 2.0, 1.0, 1.1], 2),
])  # fmt: skip
def test_a_lag_must_matter(monkeypatch, residuals, found):
    monkeypatch.setattr(timing, "residuals", lambda *record: np.array(residuals))
    rows, seen = timing.lag(U, U, slice(0, len(U)))
    assert rows == found
    assert seen.tolist() == residuals


@pytest.mark.parametrize(("rows", "dead", "error", "words", "warned"), [
    (1, None, 0.25, "by about 1 row, 0.002 s", "align the record with --lag 1; if the device is, take a kind"),
    (3, 2, 0.25, "by about 3 rows, 0.006 s, of which 2 rows dead time: kinks of the input, such as that at row 4, "
     "show no answer before", "--lag 2; if the device is, take a kind of model with a delay"),
    (3, 1, 0.25, "of which 1 row dead time", "--lag 1"),
    (3, 0, 0.25, "such as that at row 4, show an answer at once", ": take a kind of model with dynamics"),
    (3, 0, 0.249, "answer at once", None),
    (0, None, 9.0, None, None),
])  # fmt: skip
def test_what_a_fit_says_of_a_lag(monkeypatch, rows, dead, error, words, warned):
    u = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 3.0, 5.6, 8.2])
    data = Dataset.from_signal(u, u, 2e-3, "said")
    monkeypatch.setattr(timing, "lag", lambda *record: (rows, np.array([3.456, 2.0, 1.5, 1.0 if rows == 3 else 9.0])))
    monkeypatch.setattr(timing, "dead_time", lambda *record: dead)
    if rows == 1:
        error *= 2
    noted, found = timing.told(data, error)
    if words is None:
        assert (noted, found) == ({}, [])
        return
    assert noted["lag_rows"] == rows
    assert noted.get("dead_rows") == dead
    assert words in noted["lag"]
    assert len(found) == (warned is not None)
    for line in found:
        assert line.startswith(noted["lag"])
        assert warned in line
        assert f"leaves {1 if rows == 3 else 2} % of the span with that lag, 3.5 % without" in line


# ---- minor loops -----------------------------------------------------------------------------------------------------
DRAW = int(np.random.default_rng().integers(1 << 31))


def gaps_by_rows(u, y, turns):
    """Walk on from every extremum: the branch back must not leave the one that led there, and is 2 % deep."""
    found = []
    for before, at in pairwise(turns):
        side, depth = np.sign(u[at] - u[before]), 0.0
        for k in range(at + 1, len(u)):
            way = side * (u[k] - u[at])
            if way >= 0:
                if depth >= 0.02 * np.ptp(u):
                    found.append(np.interp(0.0, [side * (u[k - 1] - u[at]), way], [y[k - 1], y[k]]) - y[at])
                break
            depth = max(depth, -way)
            if depth > abs(u[at] - u[before]):
                break
    return found


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_gap_of_every_loop_that_closes(sign):
    print("seed", DRAW)
    rng = np.random.default_rng(DRAW)
    levels = rng.uniform(-1, 1, 41)
    u = sign * np.interp(np.arange(401), 10 * np.arange(41), levels)
    y, turns = rng.normal(size=401), turning_points(u, 0.0)
    want = gaps_by_rows(u, y, turns)
    assert len(want) > 2
    assert minor_loops.gaps(u, y, turns) == pytest.approx(want)


@pytest.mark.parametrize(("back", "count"), [(0.0, 1), (-1e-9, 0), (0.979, 1), (0.981, 0)])
def test_a_loop_is_inside_its_branch_and_two_percent_deep(back, count):
    u = np.interp(np.arange(41), [0, 10, 20, 30, 40], [0.2, 0, 1, back, 1.0])
    assert len(minor_loops.gaps(u, u, np.array([10, 20, 30]))) == count


def test_the_last_row_may_close_a_loop():
    u = np.array([0.5, 0.0, 1.0, 0.4, 0.5, 1.0])
    assert minor_loops.gaps(u, np.arange(6.0), np.array([1, 2, 3])).tolist() == [3.0]
    assert minor_loops.gaps(u[:-1], np.arange(5.0), np.array([1, 2, 3])).tolist() == []
    u[2:] = [1.0, 1.0 - 0.02, 0.99, 1.0]
    assert len(minor_loops.gaps(u, u, np.array([1, 2, 3]))) == (1.0 - u[3] >= 0.02)


@pytest.mark.parametrize(("inner", "count"), [(98, 1), (99, 0)])
def test_the_search_ends_after_two_hundred_turns(inner, count):
    levels = [0.3, 0.0, 1.0, *[0.5, 0.6] * inner, 0.4, 1.1]
    u = np.interp(np.arange(10 * len(levels) - 9), 10 * np.arange(len(levels)), levels)
    turns = turning_points(u, 0.0)
    y = np.arange(float(len(u)))
    closed = [g for g in minor_loops.gaps(u, y, turns) if g > 100]
    assert (len(closed) > 0) is bool(count)
    assert len(turns) == 2 * inner + 3


@pytest.mark.parametrize("rows", [1000, 60])
def test_the_width_is_the_rest_of_lines_over_fifty_parts(rows):
    rng = np.random.default_rng(DRAW)
    u, y = rng.normal(size=rows), rng.normal(size=rows)
    order = np.argsort(u)
    parts = np.array_split(order, min(50, rows // 4))
    rest = [np.sum((y[p] - np.polyval(np.polyfit(u[p], y[p], 1), u[p])) ** 2) for p in parts]
    assert minor_loops.width(u, y) == pytest.approx(np.sqrt(np.sum(rest) / rows))


@pytest.fixture
def record(monkeypatch):
    """Examine 200 rows with y from 0 to 100, turning points every ten rows, and given gaps, noise and width."""

    def make(gap=0.0, loops=8, sigma=0.1, width=50.0, step=10, levels=None):
        u = np.zeros(200)
        turns = np.arange(1, 7) * step
        u[turns] = [0, 1, 0, 2, 0, 3] if levels is None else levels
        y = np.linspace(0, 100, 200)
        d = np.full(loops, np.sqrt(gap**2 + 2 * sigma**2))
        for name, value in (
            ("gaps", d),
            ("noise", sigma),
            ("width", width),
            ("reversals", turns),
            ("turning_points", turns),
        ):
            monkeypatch.setattr(minor_loops, name, lambda *given, value=value: value)
        return examine(SimpleNamespace(u=np.r_[9.0, u, 9.0], y=np.r_[500.0, y, -500.0], train=slice(1, 201)))

    return make


@pytest.mark.parametrize(("given", "memory"), [
    ({"gap": 1.951}, OPEN_LOOPS),  # 20 samples a cycle: 3 * 260 / 400 = 1.95 % are the samples themselves
    ({"gap": 1.949}, UNKNOWN),
    ({"gap": 0.51, "step": 30}, OPEN_LOOPS),  # 60 a cycle: 0.22 %
    ({"gap": 0.49, "step": 30}, RETURN_POINT),
    ({"gap": 0.0}, RETURN_POINT),
    ({"gap": 0.0, "sigma": 0.28}, RETURN_POINT),  # 3 * 2 sigma^2 / 2 of eight loops: 0.485 %
    ({"gap": 0.0, "sigma": 0.30}, UNKNOWN),  # 0.52 %
    ({"gap": 0.0, "sigma": 0.30, "loops": 10}, RETURN_POINT),  # 0.49 %
    ({"gap": 0.6, "sigma": 0.4, "step": 30}, UNKNOWN),  # below its error of 0.69 %
    ({"gap": 0.7, "sigma": 0.4, "step": 30}, OPEN_LOOPS),
    ({"loops": 0}, UNKNOWN),
    ({"sigma": 1.0, "width": np.sqrt(0.709)}, NONE),  # 1 - 3 sqrt(2 / 200) and (0.1 %)^2
    ({"sigma": 1.0, "width": np.sqrt(0.711), "gap": 9.0}, OPEN_LOOPS),
    ({"sigma": 0.0, "width": 0.099}, NONE),
    ({"sigma": 0.0, "width": 0.101}, RETURN_POINT),
])  # fmt: skip
def test_the_class_of_the_memory(record, given, memory):
    seen = record(**given)
    assert seen.memory == memory
    assert seen.loops == given.get("loops", 8)
    assert seen.reversals == 6
    assert seen.samples_per_cycle == 2 * given.get("step", 10)
    if memory != NONE and seen.loops:
        assert seen.gap == pytest.approx(given.get("gap", 0.0), abs=1e-6)
    assert bool(seen.coarse) is (seen.samples_per_cycle < 50)


@pytest.mark.parametrize(("fast", "several"), [(2.01, True), (2.0, False), (1.99, False)])
def test_speeds_that_differ_twofold(record, fast, several):
    levels = [0, 1, 0, fast, 0, fast]
    assert record(levels=levels).several_speeds is several


def test_the_speeds_are_the_10th_and_90th_percentile_of_half_cycles(monkeypatch):
    rng = np.random.default_rng(DRAW)
    for _ in range(60):
        turns = np.cumsum(rng.integers(5, 40, 8))
        u, y = np.zeros(400), np.linspace(0, 1, 400)
        u[turns] = np.cumsum((-1.0) ** np.arange(8) * rng.uniform(0.7, 1.2, 8) * np.diff(turns, prepend=0))
        speeds = np.sort(np.abs(np.diff(u[turns])) / np.diff(turns))  # seven: the percentiles lie at 0.6 and 5.4
        slow, swift = speeds[0] + 0.6 * (speeds[1] - speeds[0]), speeds[5] + 0.4 * (speeds[6] - speeds[5])
        for name, value in (("gaps", np.zeros(0)), ("noise", 0.0), ("width", 1.0), ("reversals", turns)):
            monkeypatch.setattr(minor_loops, name, lambda *given, value=value: value)
        seen = examine(SimpleNamespace(u=u, y=y, train=slice(0, 400)))
        assert seen.several_speeds is bool(swift > 2 * slow)
        assert seen.gap == 0.0


def test_a_record_without_reversals(monkeypatch):
    u = np.linspace(0, 1, 100)
    seen = examine(SimpleNamespace(u=u, y=np.sqrt(u), train=slice(0, 100)))
    assert (seen.reversals, seen.loops, seen.several_speeds) == (0, 0, False)
    assert seen.samples_per_cycle == 100
    assert len(seen.warnings) >= 1


@pytest.mark.parametrize(("samples", "words"), [(50.0, None), (49.4, "49 samples per cycle; at least 50 are needed")])
def test_fifty_samples_a_cycle(samples, words):
    found = minor_loops._coarse(samples)
    assert found == () if words is None else found[0].startswith(words)


@pytest.mark.parametrize(("levels", "loops", "memory", "words"), [
    ([0, 1, 0], 5, UNKNOWN, ["one decaying"]), ([0, 1, 0, 1], 5, UNKNOWN, ["one decaying"]),
    ([0, 1, 0, 2], 5, UNKNOWN, []), ([0, 1, 0, 2], 0, UNKNOWN, ["closes no minor loop"]),
    ([0, 1, 0, 1.009], 5, UNKNOWN, ["one decaying"]), ([0, 1, 0, 1.012], 5, UNKNOWN, []),
    ([0, 3, 0, 3, 0.4, 3.0], 5, UNKNOWN, ["one decaying"]), ([0, 1, 0, 2], 5, NONE, ["thinner than 0.1 %"]),
    ([0, 1, 0, 1], 0, NONE, ["thinner than 0.1 %", "one decaying"]),
])  # fmt: skip
def test_excitation_that_is_not_informative(levels, loops, memory, words):
    found = minor_loops._warnings(np.array(levels, float), loops, memory)
    assert len(found) == len(words)
    assert all(word in line for word, line in zip(words, found, strict=True))
