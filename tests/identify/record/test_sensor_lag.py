"""Lag of the sensor: found in rows, reported once, never seen where there is none."""

import numpy as np
import plants
import pytest

from hystfmu import Dataset, InputError, fit
from hystfmu.data.signals import decaying_sine, training
from hystfmu.identify.excitation import timing
from hystfmu.identify.excitation.timing import dead_time, told


def lag(data):
    return timing.lag(data.u, data.y, data.train)


def late(rows, seed=3, plant=plants.prandtl_ishlinskii):
    u = training(30, seed, 0.03)
    y = plant(u)
    y = y + 1e-3 * np.ptp(y) * np.random.default_rng(seed).normal(size=len(y))
    return Dataset.from_signal(u[rows:], y[: len(y) - rows], 1e-3, "late")


@pytest.mark.parametrize("rows", [0, 1, 3])
def test_the_lag_is_found_and_none_is_invented(rows):
    assert lag(late(rows))[0] == rows


@pytest.mark.parametrize("plant", [plants.asymmetric, plants.bouc_wen])
def test_plants_that_no_sum_of_plays_fits(plant):
    assert lag(late(0, plant=plant))[0] == 0


def test_creep_moves_the_lag_by_a_row_at_most():
    assert abs(lag(late(4, plant=plants.asymmetric))[0] - 4) <= 1


def test_a_fit_reports_it_with_the_remedy():
    data = late(2)
    (warning,) = [w for w in fit(data, "prandtl_ishlinskii").fit["warnings"] if "lags" in w]
    assert "the output lags the input by about 2 rows, 0.002 s, of which 2 rows dead time: kinks" in warning
    assert "--lag 2" in warning
    aligned = fit(data.aligned(2), "prandtl_ishlinskii")
    assert not [w for w in aligned.fit.get("warnings", []) if "lags" in w]
    assert aligned.fit["rms_percent"] < 0.5 * fit(data, "prandtl_ishlinskii").fit["rms_percent"]


def test_a_lag_that_the_model_follows_is_noted():
    found = fit(late(2), "g0_prandtl_ishlinskii").fit
    assert found["lag_rows"] == found["dead_rows"] == 2
    assert not [w for w in found.get("warnings", []) if "lags" in w]
    assert "lag_rows" not in fit(late(0), "prandtl_ishlinskii").fit


def behind(u, dead, tau, noise, seed):
    """Record of plays, a first-order lag of time constant tau rows (0: none), dead rows, and noise."""
    y = plants.prandtl_ishlinskii(u)
    for k in range(1, len(u) if tau else 0):
        y[k] = y[k - 1] + (1 - np.exp(-1 / tau)) * (y[k] - y[k - 1])
    y = np.concatenate([np.full(dead, y[0]), y])[: len(u)]
    return Dataset.from_signal(u, y + noise * np.ptp(y) * np.random.default_rng(seed).normal(size=len(u)), 1e-3)


@pytest.mark.parametrize(("dead", "tau"), [(0, 4), (1, 0), (1, 2), (2, 3), (3, 0)])
def test_dead_time_inside_the_lag(dead, tau):
    """Known dead time with and without a first-order lag; seeds are drawn at run time."""
    found = []
    for seed in np.random.default_rng().integers(1 << 31, size=5):
        data = behind(training(30, seed, 0.03), dead, tau, 5e-4, seed)
        if rows := lag(data)[0]:
            found.append(dead_time(data.u, data.y, rows))
    assert len(found) >= 4  # one draw in ten thousand takes away less than the LEAST that is reported
    assert np.median(found) == dead
    assert max(found) == dead
    assert sum(k < dead for k in found) <= 2  # by chance, once in twenty


@pytest.mark.parametrize("dead", [0, 1, 3])
def test_a_smooth_input_does_not_tell_dead_time_from_dynamics(dead):
    data = behind(decaying_sine(10, 0.1), dead, 2, 1e-3, 1)
    noted, (warning,) = told(data, 100.0)
    assert "dead_rows" not in noted
    assert f"--lag {noted['lag_rows']};" in warning


def test_a_lag_without_dead_time_is_no_late_sensor():
    noted, (warning,) = told(behind(training(30, 7, 0.03), 0, 4, 1e-3, 1), 100.0)
    assert noted["dead_rows"] == 0
    assert "of which 0 rows dead time" in noted["lag"]
    assert "an answer at once" in noted["lag"]
    assert "--lag" not in warning
    assert "take a kind of model with dynamics" in warning


def test_a_lag_moves_the_output_alone():
    data = late(0)
    moved = data.with_train("10:40").aligned(3)
    np.testing.assert_array_equal(moved.u, data.u[:-3])
    np.testing.assert_array_equal(moved.y, data.y[3:])
    assert moved.train == slice(10, 40)
    assert data.aligned(3).train == slice(0, len(data.t) - 3)
    for wrong in (-1, len(data.t)):
        with pytest.raises(InputError, match="lag must be from 0 to"):
            data.aligned(wrong)
