"""Duhem operator, polynomial network of lags and differentiator: each against an independent definition."""

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import BSpline
from whole_history import SIGNALS, every_signal

from hystfmu.base.errors import InputError
from hystfmu.graph.blocks import BoucWen, Differentiator, Duhem, PolynomialNarx

Array = NDArray[np.float64]


# ---- Duhem ----------------------------------------------------------------------------------------------------------
def as_duhem(n: int, beta: float, gamma: float) -> dict[str, object]:
    """Bouc-Wen of whole n with A = 1: the two kinds of power change places between odd and even n."""
    rows: dict[str, object] = {"m": 0, "q": n, "a_rise": [1.0], "a_fall": [1.0]}
    for end, s in (("rise", 1), ("fall", -1)):
        signed, plain = np.zeros(n), np.zeros(n)
        (signed if n % 2 else plain)[-1] = -s * beta
        (plain if n % 2 else signed)[-1] = -gamma
        rows |= {f"b_{end}": signed, f"c_{end}": plain}
    return rows


@every_signal
@pytest.mark.parametrize(("n", "tolerance"), [(1, 1e-9), (2, 5e-9), (3, 2e-8)])
@pytest.mark.parametrize(("beta", "gamma"), [(0.5, 0.5), (1.0, -0.6), (0.2, 0.9)])
def test_bouc_wen_is_a_duhem_operator(signal: str, n: int, tolerance: float, beta: float, gamma: float) -> None:
    """Against the block bouc_wen: exact for n = 1, another integrator for n > 1."""
    u = 2 * SIGNALS[signal]
    values = as_duhem(n, beta, gamma)
    expected = BoucWen(beta=beta, gamma=gamma, n=float(n), alpha=0.25, k=4.0, z0=0.1)(u)[:, 0]
    y = Duhem(k=1 / 3, **values, w0=0.1, du_max=0.01)(u)
    assert np.abs(3 * y - expected).max() <= tolerance * 3


COEFFICIENTS = {  # of three quadratic B-splines on [-1, 1], the powers of u there
    "a_rise": [1.0, 0.2, -0.1],
    "a_fall": [0.8, -0.1, 0.0],
    "b_rise": [-0.5, 0.1, -0.2, 0.05, 0.1, 0.0],
    "b_fall": [0.4, -0.1, 0.1, 0.05, 0.0, -0.1],
    "c_rise": [-0.3, 0.0, 0.1, 0.1, 0.0, 0.0],
    "c_fall": [-0.4, 0.1, 0.0, 0.0, 0.1, 0.0],
}


KNOTS = np.arange(-5.0, 6.0, 2.0)


def duhem_by_scipy(u: Array, w0: float) -> Array:
    """Every monotone piece by DOP853, cut where w = 0, with the B-splines of scipy."""
    rows = [w0]
    for end, last, now in zip(np.where(np.diff(u) > 0, "rise", "fall"), u[:-1], u[1:], strict=True):
        a, b, c = (np.array(COEFFICIENTS[f"{k}_{end}"]).reshape(3, -1) for k in "abc")

        def slope(at: float, w: Array, a: Array = a, b: Array = b, c: Array = c) -> Array:
            of_w = a[:, 0] + b @ np.array([w[0], w[0] ** 2]) + c @ np.array([abs(w[0]), abs(w[0]) * w[0]])
            return np.array([BSpline(KNOTS, of_w, 2)(np.clip(at, -1, 1))])

        def zero(_: float, w: Array) -> float:
            return float(w[0])

        zero.terminal = True  # type: ignore[attr-defined]
        w, at = rows[-1], last
        while at != now:
            done = solve_ivp(slope, (at, now), [w], "DOP853", rtol=1e-13, atol=1e-15, events=zero if w else None)
            at, w = (done.t[-1], done.y[0, -1]) if done.status == 0 else (done.t_events[0][0], 0.0)
        rows.append(w)
    return np.array(rows)


def test_duhem_is_its_differential_equation_to_order_4() -> None:
    u = SIGNALS["white"][:60] / np.abs(SIGNALS["white"][:60]).max()
    expected = 0.3 * u + duhem_by_scipy(u, 0.2)
    start = {"w0": 0.2, "u0": u[0]}
    error = [
        np.abs(Duhem(m=2, q=2, k=0.3, du_max=d, **start, **COEFFICIENTS)(u) - expected).max() for d in (0.2, 0.1, 0.01)
    ]
    assert error[1] <= error[0] / 11
    assert error[2] <= 1e-9


@pytest.mark.parametrize(("n", "share"), [(1.0, 1e-6), (1.5, 1e-4), (2.3, 1e-4)])
def test_duhem_fitted_to_bouc_wen(n: float, share: float) -> None:
    """Slopes by differences, coefficients by linear least squares; RMS of a free run on other reversals / span."""

    def z(u: Array) -> Array:
        return BoucWen(beta=0.6, gamma=0.3, n=n, alpha=0.0)(u)[:, 1]

    def ramps(seed: int, step: float) -> Array:
        levels = np.random.default_rng(seed).uniform(-2, 2, 80)
        return np.concatenate([np.arange(a, b, step if b > a else -step) for a, b in itertools.pairwise(levels)])

    u, q = ramps(1, 1e-3), 5
    w, du = z(u), np.diff(u)
    middle = (w[1:] + w[:-1]) / 2
    powers = np.arange(1, q + 1)
    basis = np.column_stack(
        [np.ones_like(middle), middle[:, None] ** powers, np.abs(middle)[:, None] * middle[:, None] ** (powers - 1)]
    )
    values: dict[str, object] = {}
    for end, s in (("rise", 1), ("fall", -1)):
        rows = (s * du > 5e-4) & (w[1:] * w[:-1] > 0)
        theta = np.linalg.lstsq(basis[rows], np.diff(w)[rows] / du[rows], rcond=None)[0]
        values |= {f"a_{end}": theta[:1], f"b_{end}": theta[1 : q + 1], f"c_{end}": theta[q + 1 :]}
    test = ramps(2, 1e-2)
    free = Duhem(m=0, q=q, k=0.0, w0=0.0, **values)(test)
    assert np.sqrt(np.mean((free - z(test)) ** 2)) <= share * np.ptp(z(test))


def test_duhem_stays_within_its_bound() -> None:
    y = Duhem(k=0.0, a_rise=1.0, b_rise=5.0, c_rise=0.0, w_max=3.0)([0.0, 100.0, 1e300, -1e300, 1e6])
    assert np.abs(y).max() <= 3.0
    with pytest.raises(InputError, match=r"w0\| must be at most w_max"):
        Duhem(w0=2.0, w_max=1.0)([0.0])


# ---- polynomial network of lags -------------------------------------------------------------------------------------
@pytest.mark.parametrize(("n", "weights"), [(7, 120), (8, 153), (9, 190), (10, 231)])
def test_number_of_weights_of_the_structures_of_the_ipmc_paper(n: int, weights: int) -> None:
    """n_u = n_f = 7 .. 10, n_y = 0, q = 2: (p + q)! / (p! q!), the constant included."""
    assert PolynomialNarx(n_u=n, n_f=n, n_y=0, q=2).node.sizes["theta"] == weights


def test_a_polynomial_network_that_no_graph_holds_is_refused() -> None:
    with pytest.raises(InputError, match="too many values"):
        PolynomialNarx(n_u=1000, n_f=1000, n_y=1000, q=10)


def test_polynomial_narx_lets_its_input_through_at_once_only_if_told() -> None:
    u = np.zeros((5, 2))
    u[2] = 1.0
    theta = [1.0, 2.0, 0.0]
    block = {"n_u": 1, "n_f": 1, "n_y": 0, "q": 1, "theta": theta}
    assert PolynomialNarx(**block, n_k=0)(u).tolist() == [0, 0, 3, 0, 0]
    assert PolynomialNarx(**block)(u).tolist() == [0, 0, 0, 3, 0]


# ---- derivative -----------------------------------------------------------------------------------------------------
def test_differentiator_converges_to_the_filtered_derivative() -> None:
    """u = sin(omega t): (omega cos - ..) / (tau s + 1) in steady state, error of order h."""
    tau, omega, errors = 0.05, 9.0, []
    for h in (1e-3, 5e-4):
        t = np.arange(round(2 / h)) * h
        du = Differentiator(tau=tau)(np.sin(omega * t), h=h)
        expected = (1j * omega / (1 + 1j * omega * tau) * np.exp(1j * omega * t)).imag
        errors.append(np.abs(du - expected)[t > 1].max() / omega)
    assert errors[0] <= 0.01
    assert errors[1] == pytest.approx(errors[0] / 2, rel=0.05)
