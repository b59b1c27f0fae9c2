"""Parts of the kinds of model against their equations: regressions of duhem and polynomial_narx."""

import functools

import numpy as np
import pytest

from hystfmu import Dataset
from hystfmu.identify.methods import duhem, polynomial_narx
from hystfmu.identify.solvers.ridge import least_squares

RNG = np.random.default_rng(8)


# ---- duhem ----------------------------------------------------------------------------------------------------------
def test_the_terms_of_the_slope():
    u, w = np.array([0.5, -2.0]), np.array([3.0, -0.5])
    want = [
        [v**i * term for i in range(3) for term in (1, x, x * x, abs(x), abs(x) * x)] for v, x in zip(u, w, strict=True)
    ]
    assert duhem.basis(u, w, 2, 2) == pytest.approx(np.array(want))


def test_a_path_is_cut_at_reversals_and_after_a_length():
    u = np.array([0.0, 1.0, 2.0, 3.0, 2.0, 1.0, 1.0, 0.0, 4.0])
    first, last = duhem.segments(u, 0.0)  # every step is a piece
    assert first.tolist() == [0, 1, 2, 3, 4, 5, 6, 7]
    assert last.tolist() == [1, 2, 3, 4, 5, 6, 7, 8]
    first, last = duhem.segments(u, 2.0)
    assert first.tolist() == [0, 2, 3, 5, 7]
    assert last.tolist() == [2, 3, 5, 7, 8]
    first, last = duhem.segments(u, 100.0)
    assert first.tolist() == [0, 3, 7]
    assert last.tolist() == [3, 7, 8]


RISE, FALL = np.array([1.0, -0.8, 0.1, 0.3, -0.2]), np.array([0.7, 0.5, -0.2, 0.4, 0.1])


@functools.cache
def duhem_path(k, c, n=1500):
    """A path whose increments are those of the equation at the middle of each step, by fixed-point iteration."""
    u = np.sin(np.linspace(0, 30, n)) * np.linspace(1, 0.3, n)
    w = np.zeros(n)
    for i in range(1, n):
        theta = RISE if u[i] > u[i - 1] else FALL
        middle = w[i - 1]
        for _ in range(8):
            terms = duhem.basis(np.array([(u[i] + u[i - 1]) / 2]), np.array([middle]), 0, 2)[0]
            step = (u[i] - u[i - 1]) * terms @ theta
            middle = w[i - 1] + step / 2
        w[i] = w[i - 1] + step
    return u, c + k * u + w


@pytest.mark.parametrize("least", [0.0, 0.05])
def test_slopes_follow_from_the_increments(least):
    u, y = duhem_path(0.4, -0.2)
    kept = np.ones(len(u), dtype=bool)
    slopes = duhem._Slopes(u, y, kept, 0, 2, least)
    assert slopes.terms == 5
    theta, factors, left = slopes.solve(0.4, -0.2)
    assert theta[0] == pytest.approx(RISE, abs=1e-6)
    assert theta[1] == pytest.approx(FALL, abs=1e-6)
    assert np.abs(left).max() < 1e-9
    assert np.abs(slopes.solve(0.5, -0.2)[2]).max() > 1e-7
    assert [f.shape for f in factors] == [(5, 5), (5, 5)]
    if least == 0:
        terms = duhem.basis((u[:-1] + u[1:]) / 2, (y - 0.4 * u + 0.2)[:-1] / 2 + (y - 0.4 * u + 0.2)[1:] / 2, 0, 2)
        rising = np.diff(u) > 0
        orthonormal = (np.diff(u)[:, None] * terms)[rising] @ factors[0]
        assert orthonormal.T @ orthonormal == pytest.approx(np.eye(5), abs=1e-8)


def test_rows_that_do_not_count_take_no_part():
    u, y = duhem_path(0.4, -0.2)
    kept = np.ones(len(u), dtype=bool)
    kept[100:200] = False
    y = np.where(kept, y, 77.0)
    slopes = duhem._Slopes(u, y, kept, 0, 2, 0.0)
    used = np.sort(np.concatenate(slopes.parts))
    assert not set(range(99, 200)) & set(used.tolist())
    assert {98, 200} <= set(used.tolist())
    assert np.abs(slopes.solve(0.4, -0.2)[2]).max() < 1e-9


def test_the_free_run_starts_from_the_increments():
    u, y = duhem_path(0.4, -0.2)
    rows, kept = slice(0, 1500), np.ones(1500, dtype=bool)
    slopes = duhem._Slopes(u, y, kept, 0, 2, 0.0)
    start = duhem._Start(slopes, np.array([0.4, -0.2]), u, y, rows, kept)
    assert start.w_max == pytest.approx(3 * np.abs(y - 0.4 * u + 0.2).max())
    assert start.first == pytest.approx(0.0, abs=1e-12)
    assert start.cost < 1e-8
    x = np.zeros(13)
    x[:3], x[3], x[8] = [0.1, 0.2, 0.3], 1.0, 2.0
    theta, k, c, w0 = start.parts(x)
    assert (k, c, w0) == pytest.approx((0.5, 0.0, 0.3))
    assert theta[0] - start.theta[0] == pytest.approx(start.factors[0][:, 0])
    assert theta[1] - start.theta[1] == pytest.approx(2 * start.factors[1][:, 0])
    later = duhem._Start(slopes, np.array([0.4, 0.0]), u, y, rows, kept)
    assert later.first == pytest.approx(-0.2)  # y - k u - c at the first row


# ---- polynomial_narx ------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("rows", [50, 4100])  # one chunk, and three
def test_the_ridge_of_a_regression(rows):
    phi, y = RNG.normal(size=(rows, 3)), RNG.normal(size=rows)
    theta, rms = least_squares(phi, y, 0.3)
    want = np.linalg.solve(phi.T @ phi + rows * 0.09 * np.eye(3), phi.T @ y)
    assert theta == pytest.approx(want, rel=1e-9)
    assert rms == pytest.approx(np.sqrt(np.mean((y - phi @ want) ** 2)))


def narx_data():
    u = 5 + 3 * np.sin(np.arange(300) / 9) * np.linspace(1, 0.2, 300)
    return Dataset.from_signal(u, 2 * u + 40, 1e-3, "narx")


def test_the_signals_of_the_polynomial_are_scaled_to_the_training_rows():
    data = narx_data()
    s = polynomial_narx.signals(data, 2.0, "dominant", float(data.u[0]), 0.05)
    u, y = data.u[data.train], data.y[data.counted]
    lo, hi = u.min(), u.max()
    limited = np.clip(data.u, lo - 0.05 * (hi - lo), hi + 0.05 * (hi - lo))
    assert s.x == pytest.approx((2 * limited - lo - hi) / (hi - lo))  # a range of 2
    assert (s.middle, s.half) == pytest.approx(((y.max() + y.min()) / 2, np.ptp(y) / 2))
    assert s.y == pytest.approx((data.y - s.middle) / s.half)
    assert s.nodes[0].value("gain")[0] == pytest.approx(2 / (hi - lo))
    assert s.nodes[1].value("x0")[0] == pytest.approx(s.x[0])
    assert s.f[0] == pytest.approx(0.0)
    first = int(np.argmax(s.x))  # before the first reversal, the virgin branch: h = g(2 |x - x0|) / 2
    d = s.x[: first + 1] - s.x[0]
    assert s.f[: first + 1] == pytest.approx(d * -np.expm1(-2 * d), abs=1e-9)
    assert s.beside.shape == (300, 0)


def test_lags_and_their_gains():
    data = narx_data()
    s = polynomial_narx.signals(data, 4.0, "dominant", float(data.u[0]), 0.05)
    z, gains = s.lags(2, 1, 3, 0)
    k = 50
    assert z[k] == pytest.approx([s.x[k], s.x[k - 1], s.f[k], s.y[k - 1], s.y[k - 2], s.y[k - 3]])
    most = [np.abs(v).max() for v in (s.x, s.x, s.f, s.y, s.y, s.y)]
    assert gains == pytest.approx(1 / np.array(most))
    assert s.lags(1, 1, 0, 1)[0][k] == pytest.approx([s.x[k - 1], s.f[k - 1]])
    theta, rms, gains = polynomial_narx.solve(s, data.counted, [2, 0, 0, 0], 1, 1e-9)
    assert rms < 1e-6 * s.half
    assert theta[0] * gains[0] * s.x[k] + theta[1] * gains[1] * s.x[k - 1] + theta[2] == pytest.approx(s.y[k], abs=1e-5)
    wrong = polynomial_narx.solve(s, data.counted, [1, 0, 0, 1], 1, 1e-9)[1]  # without the present value
    late = np.column_stack([s.x[data.counted], np.r_[s.x[0], s.x[:-1]][data.counted], np.ones(len(s.x[data.counted]))])
    left = s.y[data.counted] - late[:, 1:] @ np.linalg.lstsq(late[:, 1:], s.y[data.counted], rcond=None)[0]
    assert wrong == pytest.approx(s.half * np.sqrt(np.mean(left**2)), rel=1e-6)
