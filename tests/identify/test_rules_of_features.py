"""Dynamics, covariates, excitation, drift and splits of a record: each rule on a case worked out by hand."""

import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.signal import cont2discrete, lfilter

from hystfmu import Dataset, Graph, Node
from hystfmu.identify.catalogue import Candidate
from hystfmu.identify.cuts import validation_rows, without_outermost
from hystfmu.identify.estimate.dynamics import Dynamics, Weighted, bounds, polynomials, search, uncertainty, unknown
from hystfmu.identify.features.bent_sum import Following
from hystfmu.model import guards

H = 1e-3
OPTIONS = {"hold": "foh", "delay_max": 10.0, "zeta_max": 5.0}
RNG = np.random.default_rng(5)


def noise_data(n=500):
    u = np.cumsum(RNG.normal(size=n)) / 5
    return Dataset.from_signal(u, u, H, "noise")


# ---- dynamics -------------------------------------------------------------------------------------------------------
def test_a_delay_is_whole_samples_and_a_rest():
    g = Dynamics(40.0, 0.3, 3.25 * H)
    (g0, delay) = g.nodes(H, "foh")
    assert delay.dims["n"] == 3
    w, s, rest = 80 * np.pi, 2j * np.pi * 25.0, 0.25 * H
    lag = np.polyval(g0.value("b"), s) / np.polyval(g0.value("a"), s)
    assert lag == pytest.approx(w**2 / (s**2 + 0.6 * w * s + w**2) * np.exp(-s * rest), rel=1e-8)
    assert np.polyval(g0.value("b"), 0) == pytest.approx(np.polyval(g0.value("a"), 0))
    assert len(Dynamics(40.0, 0.3, 3 * H).nodes(H, "foh")[0].value("a")) == 3  # no rest
    assert [n.name for n in Dynamics(40.0, 0.3, 0.0).nodes(H, "foh")] == ["g0"]
    b, a = polynomials(Dynamics(40.0, 0.3, 0.0), 0.0)
    assert b == pytest.approx([w**2])
    assert a == pytest.approx([1.0, 0.6 * w, w**2])
    assert Dynamics.at(g.point(H), H).delay == pytest.approx(g.delay)
    assert g.point(H) == pytest.approx([np.log(40), np.log(0.3), 3.25])
    assert Dynamics.at([0.0, 0.0, 1e-7], H).delay == 0.0


@pytest.mark.parametrize("hold", ["zoh", "foh"])
def test_columns_are_filtered_from_their_steady_states(hold):
    g = Dynamics(60.0, 0.4, 2 * H)
    columns = np.column_stack([noise_data().u, 3 + noise_data().u])
    w = 120 * np.pi
    b, a, _ = cont2discrete(([w**2], [1, 0.8 * w, w**2]), H, hold)
    out = g.filter(columns, H, hold)
    for c, y in zip(columns.T, out.T, strict=True):
        late = np.r_[[c[0]] * 2, c[:-2]]
        if hold == "zoh":  # "at the new value": the input of a row acts over the step that ends there
            late = np.r_[late[1:], 0.0]
            want = np.r_[0.0, lfilter(b.ravel(), a, late - c[0])[1:]][:-1] + c[0]
            assert y[:-1] == pytest.approx(want, abs=1e-9)
        else:
            assert y == pytest.approx(lfilter(b.ravel(), a, late - c[0]) + c[0], abs=1e-9)


def test_the_search_of_dynamics_finds_them():
    data = noise_data(600)
    lo, hi = bounds(data, OPTIONS)
    rows = data.train.stop - data.train.start
    assert lo == pytest.approx([np.log(1 / (rows * H)), np.log(0.01), 0.0])
    assert hi == pytest.approx([np.log(500.0), np.log(5.0), 10.0])
    true = Dynamics(30.0, 0.5, 2.4 * H)
    y = true.filter(data.u[:, None], H, "foh")[:, 0] + 1e-4 * RNG.normal(size=600)
    data, one = Dataset.from_signal(data.u, y, H, train=data.train), (np.ones(1), np.zeros(1, dtype=bool))
    behind = Weighted(data.u[:, None], data, np.arange(600)[data.train], "foh", lambda seen, y: one)
    seen = []
    for near in (None, Dynamics(35.0, 0.6, 2 * H)):
        found = search(behind, data, OPTIONS, seen.append, near)
        assert found.point(H) == pytest.approx(true.point(H), abs=0.02)
    assert seen == sorted(seen)
    assert seen[-1] == pytest.approx(1.0)
    spread = uncertainty(behind, found, data, OPTIONS)
    assert (spread > 0).all()
    assert (spread < 0.01).all()
    assert unknown(found, spread, data, OPTIONS) == []


@pytest.mark.parametrize(("g", "spread", "words"), [
    (Dynamics(499.9, 0.5, 0.0), [0, 0, 0], ["f_n = 499.9 Hz is a bound of the search"]),
    (Dynamics(2.0, 0.5, 0.0), [0, 0, 0], []),
    (Dynamics(30.0, 0.5, 0.0), [0.021, 0, 0], ["f_n = 30 Hz has a standard error of 2.1 %"]),
    (Dynamics(30.0, 0.5, 0.0), [0.019, 0.021, 0], ["zeta = 0.5 has a standard error of 2.1 %"]),
    (Dynamics(30.0, 0.5, H), [0, 0, 0.27], ["the delay 0.001 s has a standard error of 0.00027 s"]),
    (Dynamics(30.0, 0.5, H), [0, 0, 0.26], []),
])  # fmt: skip
def test_what_the_record_does_not_tell_of_the_dynamics(g, spread, words):
    found = unknown(g, np.array(spread), noise_data(1000), OPTIONS)
    assert len(found) == len(words)
    assert all(line.startswith(word) for line, word in zip(found, words, strict=True))


# ---- covariates -----------------------------------------------------------------------------------------------------
def test_a_bend_follows_its_covariates():
    theta, v = RNG.uniform(-1, 1, (20, 4)), RNG.uniform(-1, 1, 20)
    f = Following(theta, ("none", "offset", "gain", "bend"))
    q, c = np.array([0.2, 1.0, 0.3]), np.zeros((4, 3))
    c[1, 0], c[2, 0], c[3] = 0.5, -0.4, [0.1, 0.2, 0.3]
    g = np.array([0.0, 0.0, 0.7, 0.0])

    def b(v, q):
        return q[0] + q[1] * v + q[2] * (1.5 * v**2 - 0.5)

    want = (1 + 0.7 * theta[:, 2]) * b(v, q) + sum(theta[:, j] * b(v, c[j]) for j in range(4))
    assert f.value(v, q, c, g) == pytest.approx(want)
    e = 1e-6
    assert f.slope(v, q, c, g) == pytest.approx((f.value(v + e, q, c, g) - f.value(v - e, q, c, g)) / (2 * e), abs=1e-8)
    assert f.slope(v, q[:1], c[:, :1], g).tolist() == [0.0] * 20
    assert f.gains.tolist() == [2]
    assert f.free(3).tolist() == [[False] * 3, [True, False, False], [True, False, False], [True] * 3]
    assert f.parameters(3) == 6
    columns = f.columns(legendre.legvander(v, 2), g)
    found = np.r_[q, 0.5, -0.4, 0.1, 0.2, 0.3]
    assert columns @ found == pytest.approx(want)
    again = f.coefficients(found, 3)
    assert again[0].tolist() == q.tolist()
    assert again[1].tolist() == c.tolist()
    y = np.array([2.0, 4.0])
    used = theta[[3, 5], 1:]
    assert f.started(y, np.array([3, 5])) == pytest.approx(np.column_stack([np.ones(2), used, used * y[:, None]]))


# ---- splits, guards, candidates -------------------------------------------------------------------------------------
def test_validation_blocks_end_at_reversals_and_share_the_record():
    levels = RNG.uniform(-1, 1, 81)
    levels[::2], levels[1::2] = np.abs(levels[::2]) + 0.2, -np.abs(levels[1::2]) - 0.2
    u = np.interp(np.arange(801), 10 * np.arange(81), levels)
    sets = [validation_rows(u, which) for which in range(4)]
    assert np.sum(sets, axis=0).tolist() == [1] * 801  # each row in one of four
    for rows in sets:
        assert (np.flatnonzero(np.diff(rows.astype(int))) % 10 == 9).all()  # a new block begins at a reversal
        assert 0.15 < rows.mean() < 0.35
    assert sets[0][0]
    assert np.count_nonzero(np.diff(sets[3].astype(int))) >= 18  # forty blocks, ten of them
    few = validation_rows(u, 3, 8)
    assert np.count_nonzero(np.diff(few.astype(int))) == 3  # the fourth and the last block
    ramp = validation_rows(np.linspace(0, 1, 100))  # no reversals
    assert np.flatnonzero(np.diff(ramp.astype(int))).tolist() == [14, 19, 34, 39, 54, 59, 74, 79, 94]


def test_the_outermost_loop_is_not_held_out():
    u = np.array([0.0, 1.0, 0.0, 3.0, 0.0, -1.0, 0.0, 1.0, 0.5])
    held = np.array([0, 1, 0, 1, 0, 0, 0, 1, 1], dtype=bool)
    assert without_outermost(u, held).tolist() == [False, True, *[False] * 5, True, True]
    assert without_outermost(-u, held).tolist() == [False, True, *[False] * 5, True, True]
    nearly = np.where(u == 3, 1.03, u)  # less than 1 % of the range beyond the others
    assert without_outermost(nearly, np.array([0, 0, 0, 1, 0, 0, 0, 0, 0], dtype=bool)).any()
    alone = np.array([0, 0, 0, 1, 0, 0, 0, 0, 0], dtype=bool)
    assert without_outermost(u, alone).tolist() == alone.tolist()  # nothing else is left


def test_poles_bounds_and_coverage_are_warned_of():
    def warned(b=(1.0,), a=(1.0, 1.0), bounded=None, covered=None):
        graph = Graph.single(Node("g0", "transfer_function", {}, {"b": list(b), "a": list(a)}))
        return guards.warnings(graph, H, bounded or {}, covered)

    fast = 1.01 * np.pi / H
    (line,) = warned(a=[1.0, fast])
    assert line.startswith("a pole of g0 at 3.2e+03 1/s lies above")
    assert warned(a=[1.0, 0.99 * np.pi / H]) == []
    assert warned([-1.0, fast], [1.0, fast]) == []  # mirrored: of a delay
    assert warned([-1.0, 1.1 * fast], [1.0, fast]) != []
    for value, told in ((0.0, True), (1e-3, True), (2e-2, False), (9.98, False), (9.995, True), (10.0, True)):
        assert bool(warned(bounded={"p": (value, 0.0, 10.0)})) is told, value
    lines = warned(bounded={"n": (6.0, 1.0, 6.0), "share": (0.2, -1.0, 1.0), "z": (-3.0, -3.0, 3.0)}, covered=39.9)
    assert [w.split(" = ")[0] for w in lines[:2]] == ["n", "z"]
    assert "n = 6 is a bound of the search (1 to 6)" in lines[0]
    assert "the training rows reach 40 % of the states" in lines[2]
    assert warned(covered=40.0) == []


def test_the_cost_and_the_name_of_a_candidate():
    c = Candidate("open", 2.0, 0.5, {"memory": "last", "n": 3})
    assert c.cost(4000) == 4.0
    assert c.named("zhao_tan_mlp") == "zhao_tan_mlp memory=last n=3"
