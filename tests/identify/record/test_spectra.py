"""Responses and noise from records by numbers: windows, cells, coherent bands, densities."""

import numpy as np
import pytest
from scipy.special import betaincinv

from hystfmu.identify.evidence import spectra
from hystfmu.identify.evidence.spectra import Cells, Response, Window

H = 1e-3


def test_a_window_ends_with_its_rows_and_has_a_fast_length():
    assert Window.of(slice(10, 74)) == Window(slice(10, 74))
    assert Window.of(slice(10, 73)) is None
    window = Window.of(slice(10, 81))  # 71 rows: the next smaller product of 2, 3 and 5 is 64
    assert window == Window(slice(17, 81))
    assert (window.n, window.cells) == (64, 3)  # 31 bins between 0 and half the sampling rate
    assert window.frequencies(H) == pytest.approx(np.arange(1, 25) / 0.064)
    assert Window(slice(0, 66)).cells == 4


def test_a_transform_without_the_line_through_the_ends():
    rng = np.random.default_rng(1)
    window = Window(slice(3, 3 + 90))
    x = rng.normal(size=(100, 2))
    part = x[3:93]
    level = part - np.linspace(0, 1, 90)[:, None] * (part[-1] - part[0])
    want = np.fft.rfft(level, axis=0)[1:41] / np.sqrt(90)
    assert window.transform(x) == pytest.approx(want)
    assert window.transform(x[:, 1]) == pytest.approx(want[:, 1])
    assert np.abs(window.transform(np.arange(100.0))).max() < 1e-12


def test_the_response_in_cells_is_that_of_least_squares():
    rng = np.random.default_rng(2)
    windows = [Window(slice(0, 128)), Window(slice(150, 250))]
    v, y = rng.normal(size=250), rng.normal(size=250)
    y += 2 * v
    found = spectra.cells_of(windows, H, v, y)
    place = 0
    for window in windows:
        V, Y, f = window.transform(v), window.transform(y), window.frequencies(H)
        lefts = []
        for cell in range(window.cells):
            at = slice(8 * cell, 8 * cell + 8)
            columns = np.column_stack([V[at], V[at] * np.linspace(-1, 1, 8)])
            left = np.sum(np.abs(Y[at] - columns @ np.linalg.lstsq(columns, Y[at], rcond=None)[0]) ** 2)
            lefts.append(left / 6)
            power = np.sum(np.abs(V[at]) ** 2)
            of_cell = found.f[place], found.g[place], found.weight[place], found.total[place], found.left[place]
            g, total = np.vdot(V[at], Y[at]) / power, np.sum(np.abs(Y[at]) ** 2)
            assert of_cell == pytest.approx((f[at].mean(), g, power, total, left))
            place += 1
        assert found.noise[place - window.cells : place] == pytest.approx(spectra.smooth(np.array(lefts)))
    assert place == len(found.f)


def test_a_moving_average_widens_with_the_frequency():
    x = np.random.default_rng(3).random(150)
    want = [x[max(k - w, 0) : k + w + 1].mean() for k in range(150) for w in [max(2, int(0.04 * k))]]
    assert spectra.smooth(x) == pytest.approx(want)
    assert spectra.smooth(np.zeros(3)).tolist() == [1e-300] * 3


def band(seen, unsure=(), g=None):
    """The coherent band of points at 1, 2, ... 20 Hz."""
    f, at = np.arange(1.0, 21.0), np.isin(np.arange(1, 21), [*seen, *unsure])
    g = np.ones(20) if g is None else g
    return Response(f, g + 0j, np.where(at, 0.9, 0.1), np.full(20, 0.5), np.isin(f, list(seen))).band()


@pytest.mark.parametrize(("seen", "unsure", "found"), [
    ([4, 5, 6, 7], [], (4, 7)),
    ([], [4, 5, 6], (0, 0)),
    ([5, 6], [3, 4, 7], (5, 7)),  # it begins with a sure point
    ([5, 6], [], (0, 0)),
    ([4, 5, 6], [8], (4, 8)),  # over a gap of one point
    ([4, 5, 6], [9], (4, 6)),  # over a wider one to a sure point only
    ([4, 5, 6, 9], [], (4, 9)),
    ([1, 2, 3, 6], [], (1, 6)),  # an octave
])  # fmt: skip
def test_the_coherent_band_of_a_response(seen, unsure, found):
    assert band(seen, unsure) == found


@pytest.mark.parametrize(("above", "changed", "last"), [
    ([8, 9, 10], 1.02, 10), ([8, 9, 10], 1.04, 3), ([8, 9, 10], 0.96, 3), ([8, 9], 1.0, 3),
    ([8, 9, 10, 11], 1.02, 11),
])  # fmt: skip
def test_a_band_goes_on_behind_a_wide_gap_over_which_the_response_is_equal(above, changed, last):
    g = np.where(np.arange(1, 21) > 5, changed, 1.0)
    g[10] = 50.0  # only three points on each side are compared
    g[0] = 1.01
    assert band([1, 2, 3, *above], g=g) == (1, last)


def test_a_response_pools_its_cells():
    rng = np.random.default_rng(4)
    f = np.concatenate([np.arange(1.0, 400.0), np.arange(1.5, 300.0)])
    n = len(f)
    cells = Cells(f, rng.normal(size=n) + 1j * rng.normal(size=n), *(rng.random(n) for _ in range(4)))
    cells.total[:] += cells.left
    found = spectra.response(cells)
    edge = np.geomspace(1.0, 399.0, 151)
    place = np.array([min(np.count_nonzero(edge * (1 - 1e-12) <= v), 150) for v in f])
    groups = [np.flatnonzero(place == k) for k in np.unique(place)]
    assert len(found.f) == len(groups)
    for k, of in enumerate(groups):
        weight = cells.weight[of] / cells.noise[of]
        assert found.f[k] == pytest.approx(np.average(f[of], weights=weight))
        assert found.g[k] == pytest.approx(np.sum(cells.g[of] * weight) / weight.sum())
        left, total = (np.sum(x[of] / cells.noise[of]) for x in (cells.left, cells.total))
        assert found.coherence[k] == pytest.approx(1 - left / total)
        level, sure = (betaincinv(2 * len(of), 6 * len(of), 1 - p) for p in (0.01, 1e-5))
        assert found.level[k] == pytest.approx(level)
        assert found.sure[k] == (found.coherence[k] > sure)
    assert (found.seen == (found.coherence > found.level)).all()
    assert 0 < found.seen.sum() < len(found.f)


def test_densities_of_noise():
    f, power = np.array([0.9, 1.0, 4.0, 4.0]), np.array([9.0, 3.0, 1.0, 2.0])
    assert spectra.noise_density(power, 12, f, H) == pytest.approx(np.sqrt(2 * H * 2.0 / (1 - 2 / 108) ** 3))
    x = np.random.default_rng(5).normal(size=129)
    parts = [x[:44], x[44:]]
    blocks = [np.diff(x[:44], 4), np.diff(x[44:], 4)[:40], np.diff(x[44:], 4)[40:80]]
    want = np.median([np.mean(b**2) for b in blocks]) / 70 / (1 - 2 / (9 * 13.9)) ** 3
    assert spectra.quiet_density(parts, H) == pytest.approx(np.sqrt(2 * H * want))
