"""The search of modes by numbers: which are known, their covariance, pooled spectra, the grid, the end of the band."""

from types import SimpleNamespace

import numpy as np
import pytest

from hystfmu.identify.evidence import modal_fit, search
from hystfmu.identify.evidence.modal_fit import Fitted
from hystfmu.identify.evidence.problem import Structure

H = 1e-3
F = np.geomspace(10, 450, 200)


def fitted(f_n=100.0, zeta=0.1, sd=(0.01, 0.05, 0.1, 0.05, 0.01), gain=(0.8, 0.2, 7.0), rest=True):
    p = np.array([np.log(f_n), np.log(zeta), 1.5])
    return Fitted(Structure(1, rest), p, np.array(gain), 300.0, 106, np.diag(np.square(sd)))


def seen(at=F > 0):
    return SimpleNamespace(h=H, response=SimpleNamespace(f=F, seen=at))


@pytest.mark.parametrize(("given", "known"), [
    ({}, True),
    ({"sd": (0.099, 0.05, 0.1, 0.05, 0.01)}, True), ({"sd": (0.101, 0.05, 0.1, 0.05, 0.01)}, False),
    ({"sd": (0.01, 0.49, 0.1, 0.05, 0.01)}, True), ({"sd": (0.01, 0.51, 0.1, 0.05, 0.01)}, False),
    ({"sd": (0.01, 0.05, 9.0, 0.159, 9.0)}, True), ({"sd": (0.01, 0.05, 0.1, 0.161, 0.01)}, False),
    ({"f_n": 349.0}, True), ({"f_n": 351.0}, False),
    ({"zeta": 1.06e-3}, True), ({"zeta": 1.04e-3}, False), ({"zeta": 2.85}, True), ({"zeta": 2.86}, False),
    ({"gain": (-0.8, 0.2, 7.0)}, True), ({"f_n": 5.0}, False),
])  # fmt: skip
def test_a_mode_is_known_by_its_errors_and_inside_the_bounds(given, known):
    assert fitted(**given).known(seen()).tolist() == [known]


def test_a_mode_is_known_where_half_of_the_points_around_it_are_coherent():
    near = (F > 100 / 2 ** (1 / 3)) & (F < 100 * 2 ** (1 / 6))
    for kept, known in ((near.sum() // 2, False), (near.sum() // 2 + 1, True)):
        at = F > 0
        at[np.flatnonzero(near)[kept:]] = False
        assert fitted().known(seen(at)).tolist() == [known]
    assert fitted().misfit == pytest.approx(300.0 / (106 - 3 - 3))
    assert fitted().gain.tolist() == [0.8, 0.2]
    assert fitted(rest=False).gain.tolist() == [0.8]


def test_a_covariance_is_the_larger_of_two_estimates():
    rng = np.random.default_rng(1)
    n, m = 400, 3
    j = rng.normal(size=(n, m)) * [1.0, 10.0, 0.1]
    for smooth in (1, 40):  # white errors, and errors that are equal over neighbouring bins
        e = np.tile(np.repeat(rng.normal(size=n // 2 // smooth), smooth), 2) * 3
        found = modal_fit._covariance(j, e)
        inverse = np.linalg.inv(j.T @ j)
        white = inverse * (e @ e) / (n - m)
        lever = np.einsum("ij,jk,ik->i", j, inverse, j)
        share = np.cumsum(lever[: n // 2] + lever[n // 2 :])
        place = np.minimum((share / share[-1] * 60).astype(int), 59)
        scores = (j * e[:, None])[: n // 2] + (j * e[:, None])[n // 2 :]
        clusters = np.array([scores[place == k].sum(axis=0) for k in np.unique(place)])
        sandwich = inverse @ clusters.T @ clusters @ inverse * len(clusters) / (len(clusters) - m)
        larger = np.sqrt(np.maximum(1, np.diag(sandwich) / np.diag(white)))
        assert found == pytest.approx(white * np.outer(larger, larger), rel=1e-9)
    assert modal_fit._covariance(j, 1e-3 * e) == pytest.approx(inverse, rel=1e-9)  # never below that of unit noise


def test_spectra_are_pooled_in_the_order_of_their_frequencies():
    rng = np.random.default_rng(2)
    f, v, y = (
        rng.permutation(2500) * 1.0,
        rng.normal(size=2500) + 1j * rng.normal(size=2500),
        rng.normal(size=2500) + 0j,
    )
    weight = rng.random(2500)
    found = search.Pooled.of(f, v, y, weight)
    order = np.argsort(f)
    groups = [order[k : k + 3] for k in range(0, 2500, 3)]
    assert found.f == pytest.approx([f[g].mean() for g in groups])
    assert found.power == pytest.approx([np.sum(np.abs(v[g]) ** 2 * weight[g] ** 2) for g in groups])
    assert found.cross == pytest.approx([np.sum(v[g].conj() * y[g] * weight[g] ** 2) for g in groups])


@pytest.mark.parametrize("known", [False, True])
def test_the_grid_finds_a_mode_and_its_delay(known):
    f = np.arange(1.0, 450.0)
    other = search.mode_response(f, 40.0, 0.1)
    assert other[39] == pytest.approx(1 / 0.2j)
    G = (search.mode_response(f, 200.0, 0.03) + 5 * other * known) * np.exp(-2j * np.pi * f * H * 0.75)
    power = np.where(f % 7 == 0, 0.0, 2.0)
    pooled = search.Pooled(f, power, power * G)
    f_n, zeta, delay = search.scan(pooled, [other, 2 * other] * known, 20.0, 400.0, H, search.WIDE)
    assert (f_n, zeta, delay) == (pytest.approx(200.0, rel=0.015), 0.03, 0.75)


def test_the_highest_frequency_of_a_band_that_is_half_coherent():
    r = SimpleNamespace(f=F, seen=F < 100)
    assert search._highest(r) == F[F < 100][-1]
    r.seen = r.seen | (np.arange(200) == 190)  # one point alone
    assert search._highest(r) == F[F < 100][-1]
    r.seen = np.arange(200) % 2 == 0
    assert search._highest(r) == F[198]
    r.seen = F < 0
    assert search._highest(r) == F[0]


def test_half_of_the_delay_of_a_hold_is_a_doubt():
    before = fitted()
    after = search._half(before)
    assert after.p - before.p == pytest.approx([0, 0, -0.25])
    assert np.diag(after.covariance) == pytest.approx(np.square([0.01, 0.05, np.hypot(0.1, 0.25), 0.05, 0.01]))
    assert before.p[2] == 1.5
