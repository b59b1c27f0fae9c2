"""Preisach and Duhem models: fitted to independent plants, tested on the held-out signals."""

from functools import partial

import numpy as np
import plants
import pytest

from hystfmu import Dataset, InputError, signals
from hystfmu.identify import fit
from hystfmu.identify.features.smooth_density import smooth_density, splines, triangles
from hystfmu.identify.methods.duhem import basis
from hystfmu.model import accuracy

STEP = 0.01


def relays(u, levels=90):
    """Relays off the grid of every method, denser around one place and towards the diagonal for high inputs."""
    edges = np.linspace(-1.05, 1.05, levels + 1)
    middle = (edges[1:] + edges[:-1]) / 2
    alpha, beta = (a[np.tril_indices(levels)] for a in np.meshgrid(middle, middle, indexing="ij"))
    w = np.exp(-((alpha - 0.3) ** 2 + (beta + 0.2) ** 2) / 0.15)
    w += 0.6 * np.exp(-((alpha - beta) ** 2) / 0.05) * (1 + 0.7 * alpha) + 0.15
    state, out = np.where(alpha + beta < 0, 1.0, -1.0), np.empty(len(u))
    for k, x in enumerate(u):
        state = np.where(x >= alpha, 1.0, np.where(x <= beta, -1.0, state))
        out[k] = w @ state / w.sum()
    return out + 0.3 * u


def worst(model, plant, data):
    return {name: row["rms_percent"] for name, row in accuracy.held_out_table(model, plant, data.span).items()}


@pytest.fixture(scope="module")
def preisach_like():
    u = signals.training()
    return Dataset.from_signal(u, relays(u), STEP, "relays")


@pytest.fixture(scope="module")
def preisach_model(preisach_like):
    return fit(preisach_like, "preisach")


@pytest.fixture(scope="module")
def bouc_wen_like():
    u = signals.training(30)
    return Dataset.from_signal(u, plants.bouc_wen(u, n=1.5), STEP, "Bouc-Wen")


@pytest.fixture(scope="module")
def duhem_model(bouc_wen_like):
    return fit(bouc_wen_like, "duhem")


# ---- Preisach -------------------------------------------------------------------------------------------------------
@pytest.mark.stress
def test_preisach_on_relays_that_are_no_sum_of_plays(preisach_like, preisach_model):
    """Of this about 0.3 % is the staircase of the plant's own relays: a step of 2.1 / 90 in u, over sqrt(12)."""
    table = worst(preisach_model, relays, preisach_like)
    assert max(table.values()) <= 0.6, table
    plays = worst(fit(preisach_like, "prandtl_ishlinskii"), relays, preisach_like)
    assert min(plays.values()) >= 3 * max(table.values()), plays
    assert preisach_model.fit["parameters"] == 32 * 8 + 11 + 1, (
        "32 hats times 8 splines, 11 splines of the reversible part, an offset"
    )


def test_preisach_on_plays():
    u = signals.training(50)
    data = Dataset.from_signal(u, plants.prandtl_ishlinskii(u))
    table = worst(fit(data, "preisach", widths=24, means=4), plants.prandtl_ishlinskii, data)
    assert max(table.values()) <= 0.1, table


@pytest.mark.parametrize("start", ["demagnetised", "low", "high"])
@pytest.mark.parametrize("sign", [1, -1])
def test_preisach_finds_a_density_of_its_own_basis(start, sign):
    """With other scales, before and after the memory is wiped out, with rising or falling outputs."""
    size = {"n": 12, "widths": 4, "means": 3}
    u = 50 + 20 * signals.training(40, 4)[::2]
    basis_of_u = smooth_density(u, *size.values(), start)
    w = np.random.default_rng(1).uniform(0.5, 1, basis_of_u.E.shape[1])
    y = sign * (basis_of_u.columns(u) @ w) - 7
    m = fit(Dataset.from_signal(u, y), "preisach", start=start, rate="no", **size)
    assert m.fit["max_percent"] <= 0.3
    v = 50 + 20 * signals.nested_reversals(20, 9, 0.02)
    wanted = sign * (basis_of_u.columns(v) @ w) - 7
    np.testing.assert_allclose(m.predict(v), wanted, atol=3e-3 * np.ptp(y))


@pytest.mark.turn("Preisach and Duhem")
def test_a_density_goes_on_beyond_the_trained_range():
    """The loops of a sum of plays are the same a little outside, where a grid of relays would be saturated."""
    u = signals.training(40, 2)[::2]
    m = fit(Dataset.from_signal(u, plants.prandtl_ishlinskii(u)), "preisach", widths=16)
    wide = 1.05 * u
    e = m.predict(wide) - plants.prandtl_ishlinskii(wide)
    assert np.abs(e).max() <= 0.01 * np.ptp(plants.prandtl_ishlinskii(u))


def test_rate_dependence_is_kept_only_where_it_explains_something():
    h, T = 1e-3, 0.02
    t = h * np.arange(1500)
    u = np.sin(2 * np.pi * 2 * t) + 0.6 * np.sin(2 * np.pi * 9 * t)
    static = plants.prandtl_ishlinskii(u)
    late = np.empty(len(u))
    q = static[0]
    for k, v in enumerate(static):
        q += (1 - np.exp(-h / T)) * (v - q)
        late[k] = q
    size = {"n": 16, "widths": 6, "means": 2}
    nodes = [len(fit(Dataset.from_signal(u, y, h), "preisach", **size).graph.nodes) for y in (static, late)]
    assert nodes == [1, 6]


def test_splines_of_the_mean_add_up_to_one():
    x = np.linspace(-1.5, 1.5, 31)
    for n in (1, 2, 3, 5):
        assert splines(x, n).shape == (31, n)
        np.testing.assert_allclose(splines(x, n).sum(axis=1), 1, rtol=1e-14)


def test_everett_function_of_a_cell_counts_the_triangle():
    """Node (alpha_i, beta_j) holds the cells with beta_j <= beta, alpha <= alpha_i: counted with loops."""
    n, expected = 4, []
    for i in range(1, n + 1):
        for j in range(i):
            expected.append([float(k < i and b >= j) for k in range(n) for b in range(k + 1)])
    np.testing.assert_array_equal(triangles(n), expected)


def polarisation(u, remanent=0.0, levels=120):
    """Polarisation of relays with a Lorentzian density of the coercive field, and a Gaussian one of the bias field."""
    edges = np.linspace(-1.2, 1.2, levels + 1)
    middle = (edges[1:] + edges[:-1]) / 2
    alpha, beta = (a[np.tril_indices(levels)] for a in np.meshgrid(middle, middle, indexing="ij"))
    mean, half = (alpha + beta) / 2, (alpha - beta) / 2
    w = np.exp(-(((mean - 0.05) / 0.2) ** 2) / 2) / (1 + ((half - 0.4) / 0.12) ** 2)
    state, out = np.where(mean < remanent, 1.0, -1.0), np.empty(len(u))
    for k, x in enumerate(u):
        up, down = (np.clip(2 * (x - edge) / 0.02 + s, -1, 1) for edge, s in ((alpha, -1), (beta, 1)))
        state = np.clip(state, up, down)
        out[k] = w @ state / w.sum()
    return out


@pytest.mark.stress
@pytest.mark.parametrize("remanent", [0.0, 0.03])
def test_preisach_with_a_bell_curve_of_a_butterfly_loop(remanent):
    """The strain of a ferroelectric is even in the polarisation, so that it shows the polarisation without its sign."""

    def plant(u):
        p = polarisation(u, remanent)
        return p**2 + 0.1 * p

    u = signals.training(25)
    y = plant(u)
    data = Dataset.from_signal(u, y + 5e-4 * np.ptp(y) * np.random.default_rng(3).normal(size=len(y)))
    table = worst(fit(data, "preisach", density="bell"), plant, data)
    assert max(table.values()) <= 1.5, table


# ---- Duhem ----------------------------------------------------------------------------------------------------------
@pytest.mark.turn("Preisach and Duhem")
def test_duhem_on_bouc_wen_with_a_broken_exponent(bouc_wen_like, duhem_model):
    """S3: no polynomial is |w|^1.5, and the plant is integrated by scipy."""
    plant = partial(plants.bouc_wen, n=1.5)
    table = worst(duhem_model, plant, bouc_wen_like)
    assert max(table.values()) <= 0.005, table
    assert duhem_model.fit["parameters"] == 25


@pytest.mark.stress
def test_duhem_under_noise(bouc_wen_like):
    noise = 1e-3 * bouc_wen_like.span * np.random.default_rng(1).normal(size=len(bouc_wen_like.u))
    m = fit(bouc_wen_like.with_output(bouc_wen_like.y + noise), "duhem")
    table = worst(m, partial(plants.bouc_wen, n=1.5), bouc_wen_like)
    assert max(table.values()) <= 0.02, table


@pytest.mark.turn("Preisach and Duhem")
def test_duhem_in_other_units(bouc_wen_like, duhem_model):
    data = Dataset.from_signal(50 + 20 * bouc_wen_like.u, 1e-6 * bouc_wen_like.y + 3e-6, STEP)
    assert fit(data, "duhem").fit["rms_percent"] == pytest.approx(duhem_model.fit["rms_percent"], rel=0.05)


@pytest.mark.stress
def test_duhem_whose_slope_depends_on_the_input():
    """dw/du = (1 + 0.4 u) (1 -+ w), c + k u beside it, solved in closed form along every ramp."""

    def plant(u):
        w, out = 0.0, np.zeros(len(u))
        for i in range(len(u)):
            last, now = u[max(i - 1, 0)], u[i]
            s = np.sign(now - last)
            way = s * (now - last + 0.2 * (now**2 - last**2))
            w = s - (s - w) * np.exp(-way)
            out[i] = w
        return 0.3 + 0.5 * u + out

    u = signals.training(30)
    data = Dataset.from_signal(u, plant(u))
    good = worst(fit(data, "duhem", m=1, q=1), plant, data)
    assert max(good.values()) <= 1e-3, good
    assert min(worst(fit(data, "duhem", m=0, q=5), plant, data).values()) >= 0.1


class Alloy:
    """dw/d|u| = r (W - w): w to 1 rising, to 0 falling; the integral of r is a tanh, so ramps have a closed form."""

    def __init__(self, up, down, width, size, elastic):
        self.at, self.width, self.size, self.elastic = (up, down), width, size, elastic

    def __call__(self, u):
        w, out = 0.5, np.zeros(len(u))
        for i, (last, now) in enumerate(zip(np.r_[u[0], u[:-1]], u, strict=True)):
            fall = int(now < last)
            a, b = np.tanh((np.array([last, now]) - self.at[fall]) / self.width)
            w = (1 - fall) + (w - (1 - fall)) * np.exp(-self.size * abs(b - a))
            out[i] = w
        return out + self.elastic * u


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("record", "most"), [(signals.training(30), 0.1), (signals.decaying_sine(9, 0.12), 0.4)], ids=["nested", "decaying"]
)
def test_saturating_slopes_of_a_shape_memory_alloy(record, most):
    plant = Alloy(0.3, -0.2, 0.25, 1.3, 0.2)
    y = plant(record)
    data = Dataset.from_signal(record, y + 5e-4 * np.ptp(y) * np.random.default_rng(2).normal(size=len(y)))
    table = worst(fit(data, "duhem", slopes="saturating"), plant, data)
    assert max(table.values()) <= most, table


def test_terms_of_the_slope():
    got = basis(np.array([0.5]), np.array([-3.0]), 1, 2)
    np.testing.assert_array_equal(4 * got, [[1, -3, 9, 3, -9, 3, -9, 27, 9, -27]])


def test_duhem_needs_both_directions():
    u = np.linspace(0, 1, 200)
    with pytest.raises(InputError, match=r"at least 11 rows of rising and of falling u\. Got 199 and 0 instead"):
        fit(Dataset.from_signal(u, u**2), "duhem")
