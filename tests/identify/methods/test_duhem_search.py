"""Duhem fit: terms of the slope, pieces of a path, slopes from increments, the free run, what is needed."""

import functools

import numpy as np
import pytest

from hystfmu import Dataset, InputError
from hystfmu.identify.methods import duhem

OPTIONS = {"slopes": "polynomial", "m": 0, "q": 2, "dead_band": 0.0}
TRAIN = slice(20, 600)


@pytest.fixture
def data():
    u = 30 + 5 * np.sin(np.arange(700) / 20) * np.linspace(1, 0.5, 700)
    u[650:] += 50  # behind the training rows
    w = np.zeros(700)
    for k in range(1, 700):
        d = (u[k] - u[k - 1]) / 5
        w[k] = w[k - 1] + d * (1 - 0.5 * np.sign(d) * w[k - 1])
    return Dataset(1e-3 * np.arange(700), u, 100 + 4 * u + 10 * w, train=TRAIN, unit_u="V", unit_y="um")


def scaled(data):
    seen = data.u[:600]
    u = (2 * data.u - seen.max() - seen.min()) / np.ptp(seen)
    y = data.y[TRAIN]
    return u, (y - y.mean()) / (np.ptp(y) / 2)


def test_rows_of_both_directions_are_needed(data):
    up = Dataset.from_signal(
        np.r_[np.linspace(0, 1, 60), 0.99, 0.98], np.r_[np.linspace(0, 1, 60), 0.9, 0.8], 1e-3, "up"
    )
    with pytest.raises(InputError, match=r"up: .* m = 0, q = 2 must have at least 5 rows .* Got 59 and 2 instead"):
        duhem.build(up, OPTIONS, 0, lambda f: None)
    with pytest.raises(InputError, match=r"m = 0, q = 5 must have at least 11 rows"):
        duhem.build(up, {**OPTIONS, "q": 5}, 0, lambda f: None)


def test_the_node_has_its_coefficients_by_powers():
    theta = [np.arange(10.0), np.arange(10.0) + 100]  # m = 1, q = 2: (1, w, w^2, |w|, |w| w) for B_0, then for B_1
    node = duhem._node(theta, 0.5, 7.0, -1.0, 2.0, 1, 2)
    assert node.value("a_rise").tolist() == [0, 5]
    assert node.value("b_rise").ravel().tolist() == [1, 2, 6, 7]
    assert node.value("c_rise").ravel().tolist() == [3, 4, 8, 9]
    assert node.value("a_fall").tolist() == [100, 105]
    assert node.value("b_fall").ravel().tolist() == [101, 102, 106, 107]
    assert node.value("c_fall").ravel().tolist() == [103, 104, 108, 109]
    assert [float(node.value(k)[0]) for k in ("w0", "u0", "w_max", "k")] == [2.0, -1.0, 2.0, 0.5]
    assert duhem._node(theta, 0.5, -7.0, -1.0, 2.0, 1, 2).value("w0")[0] == -2.0


def test_terms_that_the_data_do_not_tell_share_their_weight():
    u = np.tile([0.0, 0.5, 1.0, 0.5], 10)  # two steps up, two down: five terms, two of them are seen
    y = np.tile([0.0, 1.0, 1.5, 1.2], 10)
    slopes = duhem._Slopes(u, y, np.ones(40, dtype=bool), 0, 2, 0.0)
    theta, _, left = slopes.solve(0.0, 0.0)
    terms = duhem.basis((u[:-1] + u[1:]) / 2, (y[:-1] + y[1:]) / 2, 0, 2) * np.diff(u)[:, None]
    for sign, found in zip((1, -1), theta, strict=True):
        rows = sign * np.diff(u) > 0
        assert found == pytest.approx(np.linalg.pinv(terms[rows], rcond=1e-8) @ np.diff(y)[rows], abs=1e-9)
    assert np.abs(left).max() < 1e-9


def test_the_second_row_may_be_a_reversal():
    first, last = duhem.segments(np.array([0.0, 1.0, 0.0, -1.0]), 100.0)
    assert (first.tolist(), last.tolist()) == ([0, 1], [1, 3])


def test_a_slope_that_follows_the_input():
    u = np.sin(np.arange(300) / 15)
    y = u + 0.25 * u**2  # slope 1 + u / 2 in both directions
    slopes = duhem._Slopes(u, y, np.ones(300, dtype=bool), 1, 1, 0.0)
    theta, _, left = slopes.solve(0.0, 0.0)
    terms = duhem.basis(u, y, 1, 1)
    for found in theta:
        assert terms @ found == pytest.approx(1 + 0.5 * u, abs=1e-6)
    assert np.abs(left).max() < 1e-9


def test_the_first_row_counts_only_if_it_is_measured(data):
    u, y = scaled(data)
    kept = np.ones(580, dtype=bool)
    slopes = duhem._Slopes(u[TRAIN], y, kept, 0, 2, 0.0)
    assert duhem._Start(slopes, np.array([0.2, 0.1]), u, y, TRAIN, kept).first == 0.0
    whole = duhem._Start(slopes, np.array([0.2, 0.1]), u[TRAIN], y, slice(0, 580), kept)
    assert whole.first == pytest.approx(y[0] - 0.2 * u[20] - 0.1)
    kept = kept.copy()
    kept[:3] = False
    late = duhem._Start(slopes, np.array([0.2, 0.1]), u[TRAIN], y, slice(0, 580), kept)
    assert late.first == 0.0
    assert late.w_max == pytest.approx(3 * np.abs(y - 0.2 * u[TRAIN] - 0.1)[3:].max())
    assert late.cost == pytest.approx(np.sum(late.error(np.zeros(13)) ** 2))
    assert len(late.error(np.zeros(13))) == 577


# ---- duhem ----------------------------------------------------------------------------------------------------------
def test_the_terms_of_the_slope():
    u, w = np.array([0.5, -2.0]), np.array([3.0, -0.5])  # one cell of quadratic B-splines; -2 counts as -1
    splines = [[0.03125, 0.6875, 0.28125], [0.5, 0.5, 0.0]]
    want = [
        [b * term for b in row for term in (1, x, x * x, abs(x), abs(x) * x)] for row, x in zip(splines, w, strict=True)
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


@pytest.mark.turn("oscillators")
@pytest.mark.some(1)
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


@pytest.mark.turn("oscillators")
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
