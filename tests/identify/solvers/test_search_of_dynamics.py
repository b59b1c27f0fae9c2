"""Dynamics behind a hysteresis: the grid of starts, settings of the search, derivatives, standard errors, the rest."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from hystfmu import Dataset, Graph, InputError, Node, fit
from hystfmu.identify.catalogue import covariate_inputs
from hystfmu.identify.cuts import validation_rows
from hystfmu.identify.estimate import dynamics
from hystfmu.identify.estimate.dynamics import Dynamics, Weighted, bounds, search, uncertainty, unknown
from hystfmu.identify.evidence import Mode
from hystfmu.identify.features import bent_sum, other_memory, plays
from hystfmu.identify.features.bent_sum import BentSum, Problem
from hystfmu.identify.features.plays import behind_dead_band, dead_band, with_dead_band
from hystfmu.identify.solvers.trust_region import Differences, standard_errors

H = 1e-3
OPTIONS = {"hold": "foh", "delay_max": 10.0, "zeta_max": 5.0}
DATA = Dataset.from_signal(np.arange(400.0), np.arange(400.0), H, "d", slice(100, 300))
LO, HI = np.log([1 / 0.2, 0.01, 1.0]), np.array([np.log(500), np.log(5), 10.0])


class Known:
    """Residuals that are a known function of the dynamics, in place of weighted signals before the dynamics."""

    def __init__(self, of, size):
        self.of, self.size, self.tried = of, size, []

    def thinned(self):
        return self

    def differences(self, beside, limits):
        def residuals(p):
            self.tried.append(Dynamics.at(p, H, beside))
            return self.of(p) / self.size

        return Differences(residuals, np.ones(3), limits)


def from_minimum(p):
    """Residuals that are linear in the point of the search."""
    return np.array([1.0, 2.0, 3.0]) * (p - [np.log(60), np.log(0.5), 3.0])


def test_a_long_record_is_searched_over_four_decades():
    u = np.arange(2_000_000.0)
    known = Known(from_minimum, 1.0)
    search(known, Dataset.from_signal(u, u, 1e-4), OPTIONS, lambda f: None)
    assert min(g.f_n for g in known.tried) == pytest.approx(0.5, rel=1e-3)
    assert max(g.f_n for g in known.tried) == pytest.approx(5000, rel=1e-3)


def test_the_modes_that_a_record_shows_are_starts_alone_and_together(monkeypatch):
    slow, fast = Mode(100.0, 0.1, 0.3, 1.0, 0.01, 0.1), Mode(300.0, 0.05, 0.6, 1.0, 0.01, 0.1)
    asked = []

    def starts(modes, delay_se=1.0, data=DATA):
        shown = SimpleNamespace(modes=modes, delay=0.002, delay_se=delay_se)
        monkeypatch.setattr(dynamics, "evidence", lambda data: asked.append(data) or shown)
        monkeypatch.setattr(dynamics, "_SHOWN", {})
        return [dynamics._modes(data) for _ in range(2)][1]

    assert starts(()) == []
    assert starts((slow,)) == [Dynamics(100.0, 0.1, 0.002)]
    both = Dynamics(300.0, 0.05, 0.002, ((100.0, 0.1, 0.3 / (0.3 + 0.6)),))
    assert starts((slow, fast)) == [Dynamics(100.0, 0.1, 0.002), Dynamics(300.0, 0.05, 0.002), both]
    assert starts((slow,), np.inf) == [Dynamics(100.0, 0.1, 0.0)]
    assert len(asked) == 4  # once for a record
    u = np.arange(60_001.0)
    assert [len(starts((slow,), data=Dataset.from_signal(v, v, H))) for v in (u, u[1:])] == [0, 1]


def test_each_point_is_filtered_once():
    known = Known(from_minimum, 1.0)
    found = search(known, DATA, OPTIONS, lambda f: None, Dynamics(70.0, 0.4, 3 * H))
    assert found.point(H) == pytest.approx([np.log(60), np.log(0.5), 3.0])
    assert len(known.tried) > 4
    assert all(a != b for a, b in pairwise(known.tried))


@pytest.mark.parametrize(("at", "sign"), [(HI[2] - 2e-5, 1), (HI[2] - 0.5e-5, -1)])
def test_a_difference_stays_inside_the_bounds(at, sign):
    seen = []
    of = Differences(lambda p: (seen.append(np.array(p)), p)[1], np.ones(3), (LO, HI))
    assert of.jacobian(np.array([1.0, 1.0, at])) == pytest.approx(np.eye(3), abs=1e-9)
    steps = np.array(seen[1:]) - seen[0]
    assert np.diag(steps) == pytest.approx([1e-5, 1e-5, sign * 1e-5], rel=1e-6)


def test_standard_errors_of_what_is_free():
    g = Dynamics(60.0, 0.5, 0.0)  # the delay is at its bound
    rng = np.random.default_rng(2)
    J, e = rng.normal(size=(200, 3)), rng.normal(size=200)

    def near(at):
        return Known(lambda p: e + J @ (p - at), 1.0)

    found = uncertainty(near([np.log(60), np.log(0.5), 0.0]), g, DATA, OPTIONS)
    want = standard_errors(e, J, np.array([True, True, False]))
    assert found == pytest.approx(want, rel=1e-3)
    assert found[2] == 0
    inner = uncertainty(near([np.log(60), np.log(0.5), 3.0]), replace(g, delay=3 * H), DATA, OPTIONS)
    assert inner == pytest.approx(standard_errors(e, J, np.ones(3, dtype=bool)), rel=1e-3)


def test_the_jacobian_of_weighted_signals_is_that_of_the_projected_residuals():
    """Kaufman's Jacobian neglects a term of second order in the residuals, which are 0 here at the true dynamics."""
    rng = np.random.default_rng(5)
    signals = np.column_stack([np.cumsum(rng.normal(size=(400, 2)), axis=0), np.ones(400)])
    true, rows = Dynamics(60.0, 0.5, 2.5 * H), np.arange(100, 300, 2)
    y = np.zeros(400)
    y[rows] = true.filter(signals, H, "foh", rows) @ [2.0, -1.0, 3.0]

    def fit(seen, y):
        return np.linalg.lstsq(seen, y, rcond=None)[0], np.ones(3, dtype=bool)

    problem = Weighted(signals, Dataset.from_signal(np.arange(400.0), y, H), rows, "foh", fit)
    of = problem.differences((), (LO - 5, HI + 5))
    p = true.point(H)
    assert of.residuals(p) == pytest.approx(np.zeros(100), abs=1e-12)
    want = np.column_stack([(of.residuals(p + d) - of.residuals(p - d)) / 2e-5 for d in 1e-5 * np.eye(3)])
    assert of.jacobian(p) == pytest.approx(want, abs=1e-3 * np.abs(want).max())


def test_bounds_leave_room_for_a_delay_of_nothing():
    lo, hi = bounds(DATA, {**OPTIONS, "delay_max": 0.0, "zeta_max": 2.0})
    assert lo == pytest.approx([np.log(5), np.log(0.01), 0])
    assert hi == pytest.approx([np.log(500), np.log(2), 1e-9])
    none = {**OPTIONS, "delay_max": 0.0}
    assert unknown(Dynamics(60.0, 0.5, 0.0), np.array([0, 0, 9.0]), DATA, none) == []
    assert len(unknown(Dynamics(60.0, 0.5, 0.0), np.array([0, 0, 9.0]), DATA, OPTIONS)) == 1
    near = Dynamics(500 * np.exp(-2e-3), 0.5, 0.0)
    assert unknown(near, np.zeros(3), DATA, OPTIONS) == []
    assert len(unknown(replace(near, f_n=500 * np.exp(-0.5e-3)), np.zeros(3), DATA, OPTIONS)) == 1
    assert len(unknown(replace(near, f_n=5 * np.exp(0.5e-3)), np.zeros(3), DATA, OPTIONS)) == 1


@pytest.mark.parametrize(("rest", "order"), [(0.5e-6, 3), (2e-6, 5)])
def test_a_rest_of_a_millionth_of_a_sample_is_none(rest, order):
    g0, delay = Dynamics(60.0, 0.5, (3 + rest) * H).nodes(H, "foh")
    assert delay.dims["n"] == 3
    assert len(g0.value("a")) == order
    assert Dynamics(60.0, 0.5, (3 - 0.5e-6) * H).nodes(H, "foh")[1].dims["n"] == 3
    assert Dynamics.at([0.0, 0.0, 1.1e-6], H).delay > 0
    assert Dynamics.at([0.0, 0.0, 0.9e-6], H).delay == 0


def test_columns_shorter_than_the_delay_rest():
    columns = np.arange(4.0)[:, None] + 2
    out = Dynamics(60.0, 0.5, 9 * H).filter(columns, H, "foh", np.arange(4))
    assert out[:, 0] == pytest.approx(np.full(4, 2.0))


def test_the_static_part_of_a_model():
    u = 3 + np.interp(np.arange(300), 10 * np.arange(31), np.random.default_rng(1).uniform(-1, 1, 31))
    model = fit(Dataset.from_signal(u, 2 * u, H), "g0_prandtl_ishlinskii", N=3, delay_max=0.0)
    static = dynamics.hysteresis(model)
    assert static.key == "prandtl_ishlinskii"
    assert [n.name for n in static.graph.nodes] == ["input", "hysteresis", "readout"]
    assert static.fit == {}
    assert static.predict(u) == pytest.approx(2 * u, abs=1e-2)
    with pytest.raises(InputError, match=r"must have a key g0_\.\.\. \. Got 'prandtl_ishlinskii'"):
        dynamics.hysteresis(static)


# ---- smaller features -----------------------------------------------------------------------------------------------
def test_an_input_with_other_memory_by_its_recipe():
    turns = np.array([0.0, 3, 1, 2, 0.5, 2.5, 0.7])
    u = np.interp(np.arange(61), 10 * np.arange(7), turns)
    found = other_memory.other_memory(u, 1.3)
    rng = np.random.default_rng(77)
    rng.permutation(4)  # the order of the half cycles, all alike here
    assert found[0] == 1.3
    assert (len(found) - 1) % 10 == 0
    assert 8000 <= len(found) <= 8010
    level, want = 1.3, [1.3]
    for k in range((len(found) - 1) // 10):
        up = k % 2 == 0
        to = 3.0 if up else 0.0
        if k >= 4:
            to = rng.uniform(level, 3.0) if up else rng.uniform(0.0, level)
        want += (level + (to - level) * np.arange(1, 11) / 10).tolist()
        level = to
    assert found == pytest.approx(np.array(want))
    slow = np.interp(np.arange(559), 93 * np.arange(7), turns)
    assert len(other_memory.other_memory(slow, 1.3)) == 1 + 87 * 93  # 1 + 86 * 93 = 7999 is a row short
    sweep = other_memory.other_memory(np.linspace(0, 1, 9), 0.5)
    assert sweep[:3] == pytest.approx([0.5, 0.75, 1.0])  # a quarter of nine rows: two
    long = other_memory.other_memory(np.linspace(0, 1, 40_000), 0.5)
    assert len(long) == 1 + 12 * 10_000  # at least twelve reversals


@pytest.mark.parametrize(("noise", "band"), [(0.001, True), (0.3, False), (0.0, False)])
def test_a_dead_band_of_two_sigma(noise, band):
    t = np.arange(4000) / 300
    u = np.sin(t) + noise * np.random.default_rng(2).normal(size=4000)
    found = dead_band(u)
    assert (found > 0) is band
    if band:
        assert found == pytest.approx(2 * noise, rel=0.1)


def test_a_play_in_front_of_a_model():
    graph = Graph.single(Node("k", "scaling", {"n": 1}, {"gain": 3.0}))
    assert with_dead_band(graph, 0.0) is graph
    made = with_dead_band(graph, 0.5)
    u = np.array([0.0, 1.0, 0.8, -0.4, -1.0])
    assert made.run(u).reshape(-1) == pytest.approx(3 * np.array([0.0, 0.5, 0.5, 0.1, -0.5]))
    data = Dataset.from_signal(u, u, H)
    assert behind_dead_band(data, 0.0) is data
    assert behind_dead_band(data, 0.5).u.tolist() == pytest.approx([0.0, 0.5, 0.5, 0.1, -0.5])


def test_covariates_start_at_their_training_means():
    T = {"T [degC]": np.arange(10.0), "load [N]": np.arange(10.0) ** 2}
    data = Dataset(H * np.arange(10), np.arange(10.0), np.arange(10.0), train=slice(2, 6), covariates=T)
    first, second = covariate_inputs(data, [("a.u",), ("b.u", "c.u")])
    assert (first.name, first.unit, first.start, first.to, first.text) == ("T", "degC", 3.5, ("a.u",), "covariate")
    assert (second.name, second.start, second.to) == ("load", 13.5, ("b.u", "c.u"))
    assert plays.u0_of(data, {"u0": None}) == 0.0
    assert plays.u0_of(data, {"u0": 4}) == 4.0


def test_blocks_by_default():
    u = np.interp(np.arange(2001), 20 * np.arange(101), np.random.default_rng(3).uniform(-1, 1, 101))
    assert validation_rows(u).tolist() == validation_rows(u, 3, 40).tolist()
    assert bent_sum.LEVELS == ("none", "offset", "gain", "bend")


def test_steps_behind_another_start_end_where_they_do_not_reach_it(monkeypatch):
    count = []
    monkeypatch.setattr(bent_sum, "_with_bend", lambda p, s: replace(s, rms=0.9 ** len(count)))
    monkeypatch.setattr(bent_sum, "_newton", lambda p, s: (count.append(1), s)[1])
    start = BentSum(np.ones(1), np.ones(2), np.zeros(0), 1.0)
    bent_sum.fit(SimpleNamespace(penalties=()), start, 0.9**30.5)
    assert len(count) == 1, "at this gain 30 steps end at 0.9^30"
    count.clear()
    bent_sum.fit(SimpleNamespace(penalties=()), start, 0.9**29.5)
    assert len(count) == 30


@pytest.mark.parametrize(("good", "tried"), [(1.0, [1.0]), (0.5, [1.0, 0.5]), (0.1, [1.0, 0.5, 0.25, 0.1])])
def test_shares_of_a_step_are_tried_in_turn(monkeypatch, good, tried):
    seen = []

    def bent(p, s):
        seen.append(float(s.w[0]))
        return replace(s, rms=0.0 if s.w[0] == good else 1.0)

    monkeypatch.setattr(bent_sum, "_with_bend", bent)
    monkeypatch.setattr(bent_sum, "_newton", lambda p, s: replace(s, w=s.w + 1))
    found = bent_sum.fit(SimpleNamespace(penalties=()), BentSum(np.zeros(1), np.ones(2), np.zeros(0)))
    assert found.w[0] == good
    assert seen[1 : 1 + len(tried)] == tried


def test_gauss_newton_steps_with_gains_of_covariates():
    """The gain of a covariate is found beside the weights; a least weight of the input is kept."""
    rng = np.random.default_rng(9)
    x = np.sin(np.linspace(0, 30, 500))
    play = np.clip(np.r_[0, x[:-1]], x - 0.2, x + 0.2)
    theta = rng.uniform(-1, 1, (500, 2))
    v = 0.6 * x + 0.4 * play
    y = (1 + 0.3 * theta[:, 0]) * (0.5 + v + 0.2 * v**2) + 0.1 * theta[:, 0] + 0.4 * theta[:, 1]
    f = bent_sum.Following(theta, ("gain", "offset"))
    rows = np.arange(20, 500)
    p = Problem(np.column_stack([x, play]), y[rows], rows, H, np.zeros(0), following=f)
    s = bent_sum.fit(p, bent_sum.fit_linear(p, 2))
    assert s.rms < 1e-6
    assert s.g == pytest.approx([0.3, 0.0], abs=1e-6)
    assert s.w / s.w.sum() == pytest.approx([0.6, 0.4], abs=1e-6)
    assert bent_sum.model(p, s) == pytest.approx(p.y, abs=1e-5)
    held = bent_sum.fit(replace(p, least=0.8), bent_sum.fit_linear(p, 2))
    assert held.w[0] / held.w.sum() == pytest.approx(0.8 / 1.2, abs=0.01)  # 0.8 of the sum of 0.6 and 0.4
    made = BentSum(np.ones(2), np.ones(2), np.zeros(0))
    assert (made.rms, made.g.shape, made.c.shape) == (np.inf, (0,), (0, 0))
    assert bent_sum._with_bend(p, replace(made, w=np.zeros(2), g=np.zeros(2))).rms == np.inf
