"""Duhem fit: scaling, starts from the increments, the free run."""

from __future__ import annotations

import numpy as np
import pytest

import hystfmu as hy
from hystfmu import Dataset, InputError
from hystfmu.identify.features import slopes
from hystfmu.identify.methods import duhem

OPTIONS = {"m": 0, "q": 2, "dead_band": 0.0}
P = 5  # terms of a direction for m = 0, q = 2
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


def test_graph_scaling_and_free_parameters(data):
    model = hy.fit(data, "duhem", q=2, dead_band=0.0)
    u, _ = scaled(data)
    g = model.graph
    assert g.node("input").value("gain")[0] * data.u + g.node("input").value("offset")[0] == pytest.approx(u)
    assert (g.inputs[0].unit, g.inputs[0].start, g.outputs[0].unit) == ("V", data.u[0], "um")
    assert model.fit["parameters"] == 3 + 2 * P
    assert model.fit["rms_percent"] < 0.05
    names = ("w0", "k", "a_rise", "b_rise[1]", "c_rise[2]", "a_fall", "b_fall[2]", "c_fall[1]")
    assert {*(f"operator.{k}" for k in names), "readout.offset"} <= set(model.fit["free"])
    e = (model.predict(data.u) - data.y)[TRAIN]
    assert e.mean() == pytest.approx(0.0, abs=1e-4 * np.ptp(data.y))


def test_starts_are_those_of_the_increments(data):
    u, y = scaled(data)
    found = slopes.Slopes(u[TRAIN], y, np.ones(580, dtype=bool), 0, 2, 0.0)
    told = []
    starts = found.starts(np.polyfit(u[TRAIN], y, 1)[0], told.append)
    assert told == pytest.approx([0, 1 / 3, 2 / 3])
    for k, c in starts:  # stationary: neither k nor c changes the residual
        here = np.sum(found.solve(k, c)[2] ** 2)
        assert all(np.sum(found.solve(k + d, c + e)[2] ** 2) >= here * (1 - 1e-3) for d, e in ((0.01, 0), (-0.01, 0)))


def test_pieces_are_five_dead_bands_long(monkeypatch, data):
    asked = []
    segments = slopes.segments
    monkeypatch.setattr(slopes, "segments", lambda u, least: (asked.append(least), segments(u, least))[1])
    duhem.build(data, {**OPTIONS, "dead_band": 0.01}, 0, lambda f: None)
    assert asked == [pytest.approx(5 * 0.01 / (np.ptp(data.u[:600]) / 2))]


def test_rows_of_both_directions_are_needed(data):
    up = Dataset.from_signal(
        np.r_[np.linspace(0, 1, 60), 0.99, 0.98], np.r_[np.linspace(0, 1, 60), 0.9, 0.8], 1e-3, "up"
    )
    with pytest.raises(InputError, match=r"up: .* m = 0, q = 2 must have at least 5 rows .* Got 59 and 2 instead"):
        duhem.build(up, OPTIONS, 0, lambda f: None)
    with pytest.raises(InputError, match=r"m = 0, q = 5 must have at least 11 rows"):
        duhem.build(up, {**OPTIONS, "q": 5}, 0, lambda f: None)


def test_the_coefficients_by_powers():
    theta = [np.arange(10.0), np.arange(10.0) + 100]  # m = 1, q = 2: (1, w, w^2, |w|, |w| w) for u^0, then for u^1
    found = {k: v.tolist() for k, v in duhem.coefficients(theta, 1, 2).items()}
    rise = {"a_rise": [0, 5], "b_rise": [1, 2, 6, 7], "c_rise": [3, 4, 8, 9]}
    assert found == {**rise, "a_fall": [100, 105], "b_fall": [101, 102, 106, 107], "c_fall": [103, 104, 108, 109]}


def test_terms_that_the_data_do_not_tell_share_their_weight():
    u = np.tile([0.0, 0.5, 1.0, 0.5], 10)  # two steps up, two down: five terms, two of them are seen
    y = np.tile([0.0, 1.0, 1.5, 1.2], 10)
    found_slopes = slopes.Slopes(u, y, np.ones(40, dtype=bool), 0, 2, 0.0)
    theta, _, left = found_slopes.solve(0.0, 0.0)
    terms = slopes.basis((u[:-1] + u[1:]) / 2, (y[:-1] + y[1:]) / 2, 0, 2) * np.diff(u)[:, None]
    for sign, found in zip((1, -1), theta, strict=True):
        rows = sign * np.diff(u) > 0
        assert found == pytest.approx(np.linalg.pinv(terms[rows], rcond=1e-8) @ np.diff(y)[rows], abs=1e-9)
    assert np.abs(left).max() < 1e-9


def test_the_second_row_may_be_a_reversal():
    first, last = slopes.segments(np.array([0.0, 1.0, 0.0, -1.0]), 100.0)
    assert (first.tolist(), last.tolist()) == ([0, 1], [1, 3])


def test_a_slope_that_follows_the_input():
    u = np.sin(np.arange(300) / 15)
    y = u + 0.25 * u**2  # slope 1 + u / 2 in both directions
    found_slopes = slopes.Slopes(u, y, np.ones(300, dtype=bool), 1, 1, 0.0)
    theta, _, left = found_slopes.solve(0.0, 0.0)
    terms = slopes.basis(u, y, 1, 1)
    for found in theta:
        assert terms @ found == pytest.approx(1 + 0.5 * u, abs=1e-6)
    assert np.abs(left).max() < 1e-9
