"""Structured actuator: which part is kept at which gain, in which order the parts are tried."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.polynomial import legendre

from hystfmu import Dataset
from hystfmu.identify.cuts import validation_rows, without_outermost
from hystfmu.identify.estimate.dynamics import Dynamics
from hystfmu.identify.features import bent_chain, bent_sum
from hystfmu.identify.features.bent_chain import Fitting as Fit
from hystfmu.identify.features.bent_chain import Parts, Trial, dead_zones
from hystfmu.identify.features.bent_sum import BentSum
from hystfmu.identify.features.plays import plays
from hystfmu.identify.methods import actuator

H = 1e-3
RISING, BUTTERFLY = np.array([0.0, 1.0]), np.array([0.0, 0.1, 1.0])
G = Dynamics(60.0, 0.5, 0.0)


def trial(error, monotone=True, **parts):
    return Trial(Parts(**parts), BentSum(np.ones(2), RISING if monotone else BUTTERFLY, np.zeros(0)), error)


@pytest.mark.parametrize(("mine", "other", "better"), [
    (trial(1.0), trial(0.949), True),
    (trial(1.0), trial(0.951), False),
    (trial(1.0), trial(0.499, monotone=False), True),
    (trial(1.0), trial(0.501, monotone=False), False),
    (trial(1.0, monotone=False), trial(0.949, monotone=False), True),
    (trial(1.0, monotone=False), trial(0.96), False),
])  # fmt: skip
def test_a_part_must_gain_five_percent_and_a_bend_without_inverse_half(mine, other, better):
    assert (mine.or_better(other) is other) is better


class Fitting:
    """Errors by structure instead of fits."""

    def __init__(self, error, options=None, rows=600):
        self.options = {"operator": None, "bend": None, "creep": None, "dynamics": None, "covariates": None} | (
            options or {}
        )
        self.error, self.asked = error, []
        self.data = Dataset.from_signal(np.arange(float(rows)), np.arange(float(rows)), H)
        self.kept, self.noise = np.arange(90), np.inf  # no error is clear: no back-relaxation is tried

    def tried(self, parts, start=None, wanted=np.inf):
        self.asked.append((parts, start))
        return Trial(parts, start or trial(1.0).fit, self.error(parts))

    def settled(self, of):
        return False  # no noise

    def dynamics(self, of, rows, progress):
        progress(1.0)
        self.asked.append((of.parts, rows))
        return G


def test_the_degree_rises_while_the_error_falls():
    f = Fitting(lambda p: {1: 1.0, 3: 0.5, 5: 0.49, 8: 0.1}[p.degree])
    assert actuator._bent(f, trial(1.0)).parts.degree == 3  # 5 gains too little: 8 is not tried
    assert [p.degree for p, _ in f.asked] == [3, 5, 5]
    assert f.asked[2][1].w.tolist() == [1.0, 1.0]  # once more from equal weights
    f = Fitting(lambda p: 1 / p.degree)
    assert actuator._bent(f, trial(1.0)).parts.degree == 8
    assert [p.degree for p, _ in f.asked] == [3, 5, 8]
    assert actuator._bent(f, trial(0.3, degree=3)).parts.degree == 8
    f = Fitting(lambda p: 0.1, {"bend": 4})
    assert actuator._bent(f, trial(0.01)).parts.degree == 4
    same = trial(0.01, degree=4)
    assert actuator._bent(f, same) is same


def test_equal_weights_help_an_even_output():
    f = Fitting(lambda p: 1.0)
    errors = iter([0.99, 0.2, 0.5, 0.5])
    f.error = lambda p: next(errors)
    best = actuator._bent(f, replace(trial(1.0), fit=replace(trial(1.0).fit, w=np.array([0.3, 0.4]))))
    assert best.parts.degree == 3
    assert f.asked[0][1].w.tolist() == [0.3, 0.4]
    assert f.asked[1][1].w.tolist() == [1.0, 1.0]


@pytest.mark.parametrize(("option", "error", "kept"), [(None, 0.9, True), (None, 0.96, False), ("yes", 2.0, True)])
def test_dynamics_are_searched_on_every_third_row(option, error, kept):
    f, told = Fitting(lambda p: error, {"dynamics": option}), []
    assert (actuator._moving(f, trial(1.0), told.append).parts.g is G) is kept
    assert f.asked[0][1].tolist() == list(range(0, 90, 3))
    assert told == [1.0]


@pytest.mark.parametrize(("option", "error", "kept"), [(None, 0.9, True), (None, 0.96, False), ("yes", 2.0, True)])
@pytest.mark.parametrize("g", [None, Dynamics(1.0, 1.0, 0.0)])
def test_lags_a_decade_apart_up_to_a_third_of_the_record(option, error, kept, g):
    f = Fitting(lambda p: error, {"creep": option}, rows=6000)
    found = actuator._creeping(f, trial(1.0, g=g))
    assert bool(found.parts.T) is kept
    T = f.asked[0][0].T
    assert pytest.approx((0.02, 0.2, 2.0)) == T  # ten samples are 0.01 s
    if g is not None:  # found again beside the creep
        assert f.asked[1][1].tolist() == list(range(0, 90, 3))
        assert f.asked[2][0].g is G
    assert len(f.asked) == (1 if g is None else 3)


def test_what_is_a_clear_error():
    f = SimpleNamespace(noise=0.1, data=SimpleNamespace(span=100.0))
    assert [actuator._clear(f, trial(e)) for e in (0.199, 0.2, 0.201)] == [False, False, True]
    f.data.span = 1000.0
    assert [actuator._clear(f, trial(e)) for e in (0.499, 0.501)] == [False, True]


def test_time_constants_from_ten_samples_to_a_third_of_the_record():
    def lags(rows, per_decade):
        return actuator._lags(SimpleNamespace(data=SimpleNamespace(h=H, train=SimpleNamespace(stop=rows))), per_decade)

    assert lags(3000, 1) == pytest.approx((0.01, 0.1, 1.0))
    assert lags(3000, 3) == pytest.approx(10 ** np.arange(-2, 0.01, 1 / 3))
    assert lags(30, 1) == pytest.approx((0.02,))
    assert (len(lags(3 * 10**9, 1)), len(lags(3 * 10**9, 3))) == (6, 18)
    assert lags(3 * 10**9, 1)[-1] == pytest.approx(1e6)


@pytest.mark.parametrize(("k", "bounded"), [(3.99, True), (4.01, False), (-5.99, True), (-6.01, False)])
def test_a_step_response_stays_within_five_times_its_start(k, bounded):
    of = trial(1.0, T=(2.0,))
    assert actuator._relaxes(replace(of, fit=replace(of.fit, k=np.array([k])))) is bounded


def test_the_components_of_a_fit_as_options():
    found = actuator._structure(Parts(operator="relays", degree=3))
    assert found == {"operator": "relays", "bend": 3, "creep": "no", "dynamics": "no"}
    words = [actuator._structure(Parts(T=(1.0,), signed=signed, g=G)) for signed in (False, True)]
    assert [(w["creep"], w["dynamics"]) for w in words] == [("yes", "yes"), ("back-relaxation", "yes")]


@pytest.mark.parametrize(("errors", "degree", "found"), [
    ({"none": 9.0, "offset": 2.0, "gain": 1.0, "bend": 0.9}, 3, "bend"),
    ({"none": 9.0, "offset": 2.0, "gain": 1.0, "bend": 0.96}, 3, "gain"),
    ({"none": 9.0, "offset": 2.0, "gain": 1.0, "bend": 0.9}, 1, "gain"),  # no bend to follow
    ({"none": 9.0, "offset": 1.04, "gain": 1.0, "bend": 1.0}, 3, "offset"),
    ({"none": 9.0, "offset": 1.06, "gain": 1.0, "bend": 1.0}, 3, "gain"),
    ({"none": 1.05, "offset": 1.04, "gain": 1.0, "bend": 1.0}, 3, "none"),
])  # fmt: skip
@pytest.mark.parametrize("place", [0, 1])
def test_what_follows_a_covariate(errors, degree, found, place):
    def error(parts):
        mine = parts.levels[place]
        rest = parts.levels[1 - place]
        return errors[mine] * (1.0 if rest == "gain" else 100.0)

    f = Fitting(error)
    best = actuator._following(f, trial(1.0, degree=degree, levels=("gain", "gain")))
    assert best.parts.levels[place] == found
    assert best.parts.levels[1 - place] == "gain"
    f.options["covariates"] = "offset"
    same = trial(1.0, degree=3, levels=("offset",))
    assert actuator._following(f, same) is same


# ---- the whole ------------------------------------------------------------------------------------------------------
def record():
    rng = np.random.default_rng(4)
    u = np.interp(np.arange(400), 10 * np.arange(41), rng.uniform(-1, 1, 41))
    T = rng.uniform(20, 30, 400)
    y = 3 * u + 0.2 * (T - 25) + 1e-3 * rng.normal(size=400)
    return Dataset(H * np.arange(400), u, y, covariates={"T": T, "quiet": rng.random(400)})


OPTIONS = {
    "N": 3, "operator": None, "bend": 1, "creep": "no", "dynamics": "no", "covariates": None,
    "w0_min": 1e-3, "u0": None, "hold": "foh",
    "delay_max": 0.0, "zeta_max": 5.0,
}  # fmt: skip


def test_the_parts_are_counted_and_told():
    told, data = [], record()
    graph, count, found = actuator.build(data, OPTIONS, 0, told.append)
    assert found["parts"] == "plays, offset that follows T"
    assert count == 4 + 2 + 1  # weights, bend, offset
    assert found["warnings"] == [
        "the covariate 'quiet' does not reduce the error on validation blocks: it is not an input of the model"
    ]
    assert [i.name for i in graph.inputs] == ["u", "T"]
    assert 0 < found["validation_percent"] < 0.1
    assert told == [0.2, 0.8]
    _, count, found = actuator.build(data, {**OPTIONS, "creep": "yes", "bend": 3, "covariates": "bend"}, 0, told.append)
    follows = "static nonlinearity that follows"
    assert found["parts"] == (
        f"plays, static nonlinearity of degree 3, {follows} T, {follows} quiet, creep with 2 lags"
    )
    assert count == 4 + 4 + 2 + 2 * 4


def test_dynamics_are_searched_twice_more_on_all_rows(monkeypatch):
    told, rows, searched = [], [], iter([Dynamics(90.0 + k, 0.7, 0.0) for k in range(3)])

    def search(weighted, data, options, progress, near=None):
        progress(0.5)
        rows.append(len(weighted.project(Dynamics(90.0, 0.7, 0.0))[0]))
        return next(searched)

    monkeypatch.setattr(bent_chain, "search", search)
    data = Dataset.from_signal(record().u, record().y, H)
    graph, count, found = actuator.build(data, {**OPTIONS, "dynamics": "yes"}, 0, told.append)
    kept = len(Fit(data, OPTIONS).kept)
    assert rows == [-(-kept // 3), 400, 400]
    assert (found["f_n"], found["zeta"], found["delay"]) == (92.0, 0.7, 0.0)
    assert found["parts"].endswith("G0(s) with delay")
    assert count == 4 + 2 + 3
    assert told[:2] == pytest.approx([0.2, 0.2 + 0.4 * 0.5])
    assert told[-1] == 0.8
    b, a = (graph.node("g0").value(k) for k in "ba")
    assert np.sqrt(b[0]) == pytest.approx(2 * np.pi * 92)
    assert len(a) == 3


# ---- columns, rows and graphs ----------------------------------------------------------------------------------------
SETTINGS = {
    "N": 3, "operator": None, "bend": None, "creep": None, "dynamics": None, "covariates": None,
    "w0_min": 0.01, "u0": None,
    "hold": "foh", "delay_max": 10.0, "zeta_max": 5.0,
}  # fmt: skip
TRAIN = slice(40, 560)


def noise_record(n=600, covariates=0, train=TRAIN):
    rng = np.random.default_rng(8)
    u = 30 + 6 * np.interp(np.arange(n), 12 * np.arange(n // 12 + 1), rng.uniform(-1, 1, n // 12 + 1))
    beside = {f"T{j} [degC]": rng.uniform(10 * j, 10 * j + 5, n) for j in range(covariates)}
    y = 5 + 2 * u + rng.normal(size=n)
    return Dataset(H * np.arange(n), u, y, train=train, unit_u="V", unit_y="um", covariates=beside or None)


# ---- dead zones -----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("q", [[0.3, -1.2, 0.1], [0.0, 1.0, 0.0, 0.02], np.r_[1.0, np.ones(19)]])
def test_dead_zones_interpolate_the_polynomial_on_as_few_knots_as_serve(q):
    q = np.asarray(q)
    v = np.linspace(-1.4, 1.4, 801)
    fine = np.linspace(-1, 1, 4001)
    curve, m = legendre.legval(fine, q), 4
    while 2 * m < 400 and np.abs(
        np.interp(fine, k := np.linspace(-1, 1, 2 * m), legendre.legval(k, q)) - curve
    ).max() > (1e-5 * np.ptp(curve)):
        m *= 2
    knots = np.linspace(-1, 1, 2 * m)
    at = legendre.legval(knots, q)
    w0, r, w, at_0 = dead_zones(q)
    assert r == pytest.approx(knots[1:-1])
    zones = np.where(r > 0, np.maximum(v[:, None] - r, 0), np.minimum(v[:, None] - r, 0))
    inside = np.interp(v, knots, at)
    ends = [(at[1] - at[0]) / (knots[1] - knots[0]), (at[-1] - at[-2]) / (knots[-1] - knots[-2])]
    straight = np.where(v < -1, ends[0] * (v + 1), np.where(v > 1, ends[1] * (v - 1), 0.0))
    assert at_0 + w0 * v + zones @ w == pytest.approx(inside + straight, abs=1e-10)


@pytest.mark.parametrize(("q", "w0"), [([3.0], 0.0), ([3.0, 2.5], 2.5)])
def test_a_straight_bend_has_one_dead_zone_without_weight(q, w0):
    slope, r, w, at_0 = dead_zones(np.array(q))
    assert (slope, r.tolist(), w.tolist(), at_0) == (w0, [1.0], [0.0], 3.0)


# ---- columns and rows -----------------------------------------------------------------------------------------------
@pytest.mark.parametrize("u0", [None, 28.0])
def test_columns_are_scaled_plays_and_stops_up_to_the_last_training_row(u0):
    data = noise_record(covariates=2)
    f = bent_chain.Fitting(data, {**SETTINGS, "u0": u0})
    u = data.u[TRAIN]
    x = (2 * data.u[:560] - u.max() - u.min()) / np.ptp(u)
    x0 = x[0] if u0 is None else (2 * 28.0 - u.max() - u.min()) / np.ptp(u)
    r = 0.98 * np.arange(1, 4) / 3
    assert f.r == pytest.approx(r)
    assert f.plays == pytest.approx(np.column_stack([x, plays(x, r, x0)]))
    assert f.stops == pytest.approx(np.column_stack([x, x[:, None] - plays(x, r, x0)]))
    T = data.covariates.values[:560]
    lo, hi = T[TRAIN].min(axis=0), T[TRAIN].max(axis=0)
    assert f.theta == pytest.approx((2 * T - lo - hi) / (hi - lo))
    held = np.zeros(560, dtype=bool)
    held[TRAIN] = validation_rows(data.u[TRAIN])
    held[TRAIN] = without_outermost(data.u[TRAIN], held[TRAIN])
    assert f.held.tolist() == np.flatnonzero(held).tolist()
    assert f.kept.tolist() == [k for k in range(40, 560) if not held[k]]


@pytest.mark.parametrize(("n", "stride"), [(6000, 1), (6001, 2)])
def test_more_than_6000_rows_are_thinned(n, stride):
    f = bent_chain.Fitting(noise_record(n, train=None), SETTINGS)
    assert f.all.tolist() == list(range(0, n, stride))


def fitted(f, parts, seed=0):
    """Some weights for a structure."""
    rng = np.random.default_rng(seed)
    columns, m = f.columns(parts.operator), len(parts.levels)
    w = rng.uniform(0.1, 1, columns.shape[1])
    w /= np.abs(columns @ w).max()
    q = np.r_[0.4, 1.0, 0.3 * rng.normal(size=parts.degree - 1)]
    c = np.zeros((m, len(q)))
    for j, level in enumerate(parts.levels):
        c[j, : {"none": 0, "bend": len(q)}.get(level, 1)] = 0.2 + 0.1 * j
    g = np.array([0.3 if level == "gain" else 0.0 for level in parts.levels])
    return BentSum(w, q, rng.uniform(0.1, 0.3, len(parts.T)), 0.0, g, c)


STRUCTURES = [
    Parts(),
    Parts("stops", degree=3),
    Parts("relays", degree=3, T=(0.02,)),
    Parts(degree=3, T=(0.02, 0.2)),
    Parts(g=Dynamics(60.0, 0.5, 0.0)),
    Parts(degree=3, T=(0.05,), g=Dynamics(60.0, 0.5, 2 * H)),
    Parts(degree=3, levels=("gain", "none", "bend")),
    Parts(degree=3, T=(0.05,), g=Dynamics(80.0, 0.5, H), levels=("bend", "offset", "bend")),
    Parts("stops", levels=("none", "gain", "gain")),
]


@pytest.mark.parametrize("parts", STRUCTURES)
def test_the_graph_of_a_structure_runs_as_bent_sum_does(parts):
    data = noise_record(covariates=len(parts.levels))
    f = bent_chain.Fitting(data, SETTINGS)
    s = fitted(f, parts)
    graph = bent_chain.chain(f, parts, s)
    used = [j for j, level in enumerate(parts.levels) if level != "none"]
    inputs = np.column_stack([data.u, data.covariates.values[:, used]])[:560]
    want = bent_sum.model(f.problem(parts, np.arange(560)), s)
    assert graph.run(inputs, H).reshape(-1) == pytest.approx(want, abs=2e-4)
    assert [i.name for i in graph.inputs] == ["u", *(f"T{j}" for j in used)]
    assert (graph.inputs[0].unit, graph.inputs[0].start, graph.outputs[0].unit) == ("V", data.u[0], "um")
    if used:  # covariates are limited to 5 % beyond the training range
        T = data.covariates.values[TRAIN][:, used]
        for end in (1, -1):
            edge = T.max(axis=0) if end > 0 else T.min(axis=0)
            near, far = edge + end * 0.05 * np.ptp(T, axis=0), edge + end * 10 * np.ptp(T, axis=0)
            runs = [graph.run(np.column_stack([data.u, np.tile(v, (600, 1))]), H) for v in (near, far)]
            assert runs[0] == pytest.approx(runs[1])
            for share in (0.0, 0.045):
                inner = edge + end * share * np.ptp(T, axis=0)
                inner = graph.run(np.column_stack([data.u, np.tile(inner, (600, 1))]), H)
                assert np.abs(inner - runs[0]).max() > 1e-4


def test_a_structure_in_words():
    data = noise_record(covariates=2)
    words = actuator._named(Parts("stops", 3, (0.1, 1.0), Dynamics(1.0, 1.0, 0.0), ("none", "gain")), data)
    assert words == "stops, static nonlinearity of degree 3, gain that follows T1, creep with 2 lags, G0(s) with delay"
    assert actuator._named(Parts(levels=("none", "none")), data) == "plays"


def test_a_fit_grows_from_one_with_fewer_parts(monkeypatch):
    data, asked = noise_record(covariates=2), []
    f = bent_chain.Fitting(data, SETTINGS)
    monkeypatch.setattr(bent_sum, "fit", lambda p, start, wanted=0.0: (asked.append((p, start)), start)[1])
    start = replace(fitted(f, Parts(degree=3)), k=np.zeros(0), g=np.array([0.5, 0.6]))
    grown = f.fit(Parts(degree=5, T=(0.1, 1.0), levels=("gain", "bend")), f.kept, start)
    assert grown.q.tolist() == [*start.q, 0, 0]
    assert grown.k.tolist() == [1e-3, 1e-3]
    assert grown.g.tolist() == [0.5, 0.0]
    assert grown.c.shape == (2, 6)
    shrunk = f.fit(Parts(degree=1), f.kept, replace(start, k=np.zeros(0), g=np.zeros(0)))
    assert shrunk.q.tolist() == start.q[:2].tolist()
    kept = f.fit(Parts(degree=3, T=(0.1,)), f.kept, replace(start, k=np.array([0.7]), g=np.zeros(0)))
    assert kept.k.tolist() == [0.7]
    straight = f.fit(Parts(), f.kept)
    assert len(straight.q) == 2
    p = asked[0][0]
    assert (p.least, p.h, p.T.tolist()) == (0.01, H, [0.1, 1.0])
    assert p.y.tolist() == data.y[f.kept].tolist()
    assert asked[1][0].following.levels == ()
    trial = f.tried(Parts(degree=3), replace(start, k=np.zeros(0), g=np.zeros(0)))
    e = bent_sum.model(f.problem(Parts(degree=3), f.held), trial.fit) - data.y[f.held]
    assert trial.error == pytest.approx(np.sqrt(np.mean(e**2)))
