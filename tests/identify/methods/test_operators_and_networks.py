"""Kinds made of an operator and a linear fit or a network: which operator, on which rows, with which readout."""

import numpy as np
import pytest

from hystfmu import Dataset, Graph, Input, InputError, Output
from hystfmu.identify.catalogue import options as options_of
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.identify.features.straightened import straightened
from hystfmu.identify.methods import constraint_factor_mlp, operator_networks, weighted_sums
from hystfmu.identify.methods.constraint_factor_mlp import increasing_branch, literal_branch, stack_coordinates
from hystfmu.identify.solvers.nonnegative import nonnegative

H = 1e-3
TRAIN = slice(30, 260)
MODULES = (constraint_factor_mlp, operator_networks)


def record(covariate=False):
    rng = np.random.default_rng(9)
    u = 20 + 5 * np.interp(np.arange(300), 12 * np.arange(26), rng.uniform(-1, 1, 26))
    y = 100 - 3 * u + plays(u, np.array([1.0, 2.0]), u[0]) @ [-2.0, -1.0] + 0.01 * rng.normal(size=300)
    T = {"T": rng.uniform(0, 1, 300)} if covariate else None
    return Dataset(H * np.arange(300), u, y, train=TRAIN, unit_u="V", unit_y="um", covariates=T)


@pytest.fixture
def readouts(monkeypatch):
    """Replace the training of the network; its graph shows the features."""
    asked = []

    def fit_readout(front, data, chosen, seed, progress, **more):
        progress(0.5)
        asked.append((front, dict(chosen), seed, more))
        graph = Graph(front.nodes, front.wires, [Input("u", front.to)], [Output("y", front.outputs[0])])
        return graph, 100, abs(chosen["iterations"] + 0.1 * len(asked) - 40.2)

    for module in MODULES:
        monkeypatch.setattr(module, "fit_readout", fit_readout)
    return asked


def defaults(key, **given):
    return {o.name: o.default for o in options_of(key)} | given


def scaled(u, rows, span):
    return span * (u - (u[rows].max() + u[rows].min()) / 2) / np.ptp(u[rows])


# ---- linear fits ----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("least", [0.0, 2.0])
@pytest.mark.parametrize("u0", [None, 21.0])
def test_a_sum_of_plays_is_the_non_negative_least_squares(least, u0):
    data, told = record(), []
    data = data.with_output(-data.y)
    options = defaults("prandtl_ishlinskii", N=5, w0_min=least, u0=u0)
    graph, count = weighted_sums.prandtl_ishlinskii(data, options, 0, told.append)
    first = data.u[0] if u0 is None else u0
    a = np.column_stack([data.u, plays(data.u, thresholds(data.u[TRAIN], 5), first)])
    w, (offset,) = nonnegative(a[TRAIN], data.y[TRAIN] - least * data.u[TRAIN], np.ones((230, 1)))
    want = a @ w + least * data.u + offset
    assert graph.run(data.u, H).reshape(-1) == pytest.approx(want)
    assert count == 7
    assert told == [0.1]
    assert graph.inputs[0].start == first
    assert graph.node("hysteresis").value("w0")[0] >= least


def test_kernels_between_two_ramps():
    a, p1, p2 = weighted_sums.grid(-1.0, 3.0, 4)
    assert a == 1.0
    pairs = [(i, j) for j in range(4) for i in range(j + 1)]
    assert p1.tolist() == [-1.0 + i for i, _ in pairs]
    assert p2.tolist() == [-1.0 + j for _, j in pairs]
    x = np.array([-0.5, 0.0, 0.25, 1.0, 2.0])
    assert weighted_sums.ridge(x / 2, 0.5).tolist() == [-1.0, -1.0, -0.5, 1.0, 1.0]
    u = np.array([0.0, 2.0, 0.5, -1.0])
    k = weighted_sums.kernels(u, 1.0, np.array([-1.0]), np.array([1.0]), np.array([0.3]))
    assert k[:, 0].tolist() == [0.3, 1.0, 1.0, -1.0]  # held between -1 and 1 + 1
    data, told = record().with_output(-record().y), []
    graph, count = weighted_sums.krasnoselskii_pokrovskii(data, {"levels": 5, "u0": None}, 0, told.append)
    lo, hi = data.u[TRAIN].min(), data.u[TRAIN].max()
    a, p1, p2 = weighted_sums.grid(lo, hi, 5)
    start = np.clip(2 * (data.u[0] - (p1 + p2) / 2) / a - 1, -1, 1)
    columns = weighted_sums.kernels(data.u, a, p1, p2, start)
    w, (offset,) = nonnegative(columns[TRAIN], data.y[TRAIN], np.ones((230, 1)))
    assert graph.run(data.u, H).reshape(-1) == pytest.approx(columns @ w + offset)
    assert count == 16
    assert told == [0.2]


# ---- networks -------------------------------------------------------------------------------------------------------
def test_a_fitted_sum_of_plays_beside_the_input(readouts):
    data, told = record(), []
    _, count = operator_networks.fitted_operator_mlp(data, defaults("fitted_operator_mlp", N=5), 3, told.append)
    front, _, seed, more = readouts[0]
    a = np.column_stack([data.u, plays(data.u, thresholds(data.u[TRAIN], 5), data.u[0])])
    v, free = straightened(data.u[TRAIN], data.y[TRAIN], 5, np.zeros((230, 0)))
    w, _ = nonnegative(a[TRAIN], v, free)
    assert front.values == pytest.approx(np.column_stack([data.u, a @ w]))
    assert (seed, more, count) == (3, {}, 106)
    assert told == pytest.approx([0.2, 0.6])


def test_a_bank_of_plays_with_a_linear_readout(readouts):
    data = record()
    _, count = operator_networks.play_bank_mlp(data, defaults("play_bank_mlp", N=5), 3, lambda f: None)
    front, _, _, more = readouts[0]
    assert front.values == pytest.approx(
        np.column_stack([data.u, plays(data.u, thresholds(data.u[TRAIN], 5), data.u[0])])
    )
    assert more == {"linear": True, "least_decay": 1e-7}
    assert count == 100


def differentiated(v, tau):
    """Difference over the last step behind a first-order lag."""
    rate = np.diff(v, prepend=v[0]) / H
    out, q = np.zeros(len(v)), 0.0
    for k in range(1, len(v)):
        q = rate[k] if tau == 0 else q + -np.expm1(-H / tau) * (rate[k] - q)
        out[k] = q
    return out


@pytest.mark.parametrize("tau", [None, 0.0])
def test_rates_of_the_input_and_of_a_fit(readouts, tau):
    data = record(covariate=True).with_output(-record().y)
    operator_networks.rate_mlp(data, defaults("rate_mlp", N=2, tau=tau), 0, lambda f: None)
    operator_networks.rate_mlp(data, defaults("rate_mlp", memory="none", tau=tau), 0, lambda f: None)
    (front, _, _, more), (bare, _, _, literal) = readouts
    nodes = {n.name: n for n in front.nodes}
    for name in ("rate", "first", "second"):
        assert nodes[name].value("tau")[0] == (5 * H if tau is None else 0.0)
    assert [n.name for n in bare.nodes] == ["input", "rate"]
    assert bare.nodes[1].value("tau")[0] == 0.0
    assert (more, literal) == ({"linear": True}, {"linear": False})
    r = thresholds(data.u[TRAIN], 6)
    a = np.column_stack([data.u, plays(data.u, r, data.u[0])])
    free = np.column_stack([np.ones(230), data.covariates.values[TRAIN]])
    w, _ = nonnegative(a[TRAIN], data.y[TRAIN], free)
    bank = plays(data.u, thresholds(data.u[TRAIN], 2), data.u[0])
    assert front.values.shape == (300, 2 + 2 + 2 + 1)
    assert front.values[:, 2:4] == pytest.approx(bank)
    if tau == 0:
        first = differentiated(a @ w, 0.0)
        assert front.values[2:, 4] == pytest.approx(first[2:], abs=1e-6)
        assert front.values[3:, 5] == pytest.approx(differentiated(first, 0.0)[3:], abs=1e-3)
        assert front.values[2:, 1] == pytest.approx(differentiated(data.u, 0.0)[2:], abs=1e-8)


@pytest.mark.parametrize("operator", ["zhao_tan", "zhao_tan_inverse"])
def test_the_range_of_the_operator_with_the_least_error(readouts, operator):
    data, told = record(), []
    _, count = operator_networks.zhao_tan_mlp(data, defaults("zhao_tan_mlp", operator=operator), 3, told.append)
    spans = [np.ptp(front.values[TRAIN, 0]) for front, *_ in readouts]
    assert spans == pytest.approx([0.5, 1.0, 2.0, 1.0])  # the second had the least error
    for front, chosen, seed, more in readouts[:3]:
        assert (chosen["starts"], chosen["iterations"], seed, more) == (1, 40, 3, {"most_rows": 500})
        x = front.values[:, 0]
        zero = x - np.ptp(x[TRAIN]) / np.ptp(data.u[TRAIN]) * data.u
        assert np.ptp(zero) < 1e-9
        if operator == "zhao_tan":
            assert x[TRAIN].max() == pytest.approx(-x[TRAIN].min())
        else:
            assert x[0] == pytest.approx(0, abs=1e-12)  # an inverse rests at 0
    assert (readouts[3][1]["starts"], readouts[3][1]["iterations"], readouts[3][3]) == (3, 150, {})
    assert told == pytest.approx([0.1, 0.2, 0.3, 0.65])
    assert count == 100
    with pytest.raises(InputError, match="'memory' option with the operator 'zhao_tan_inverse' must be 'dominant'"):
        operator_networks.with_zhao_tan(data, 1.0, "last", 0.0, "zhao_tan_inverse")


@pytest.mark.parametrize("span", [1.0, 3.0])
@pytest.mark.parametrize("branch", ["increasing", "literal"])
def test_the_constraint_factor_operator_of_a_branch(readouts, span, branch):
    data, told = record(covariate=True), []
    data = data.with_output(-data.y) if branch == "literal" else data  # it does not turn an output that falls
    options = defaults("constraint_factor_mlp", m=3, range=span, branch=branch)
    _, count = constraint_factor_mlp.build(data, options, 3, told.append)
    front = readouts[0][0]
    x = scaled(data.u, TRAIN, span)
    where = stack_coordinates(x, x[0])
    if branch == "literal":
        g = literal_branch(where, data.y / np.ptp(data.y[TRAIN]), TRAIN, 3)
    else:
        v, free = straightened(x[TRAIN], data.y[TRAIN], 5, data.covariates.values[TRAIN])
        g = increasing_branch(where, v, free, TRAIN, 3, 1e-4)
    h = np.zeros(301)
    inside = where.d <= g.d_max
    for k, p in enumerate(where.start):
        h[k] = h[p] + where.weight[k] * g(where.d[k : k + 1])[0]
    rows = np.flatnonzero(np.logical_and.accumulate(inside))
    assert front.values[:, 0] == pytest.approx(x)
    assert front.values[rows, 1] == pytest.approx(h[rows], rel=1e-6, abs=1e-9)
    assert len(rows) > 10
    assert count == 104
    assert told == [0.5]


def test_the_sweep_keeps_the_size_with_the_least_error(readouts, monkeypatch):
    data, told, asked = record(), [], []

    def hidden_sweep(x, y, fitted, validation, counts, chosen, seed, progress):
        progress(0.5)
        asked.append((len(x), fitted, validation, list(counts), seed))
        return {1: 3.0, 2: 1.0, 3: 2.0}

    monkeypatch.setattr(constraint_factor_mlp, "hidden_sweep", hidden_sweep)
    constraint_factor_mlp.build(data, defaults("constraint_factor_mlp", m=3, sweep=3), 4, told.append)
    assert asked == [(300, slice(30, 191), slice(191, 260), [1, 2, 3], 4)]  # 70 % and 30 %
    assert readouts[0][1]["hidden"] == 2
    assert told == pytest.approx([0.475, 0.975])
