"""What a record shows of its sensor: lag, feedback, drift; each is reported once, never where there is none."""

import numpy as np
import plants
import pytest

from hystfmu import Dataset, InputError, fit, signals, synthetic
from hystfmu.data.signals import decaying_sine, nested_reversals, training
from hystfmu.identify.excitation import timing
from hystfmu.identify.excitation.timing import dead_time, feedback, told
from hystfmu.model.guards import drift
from hystfmu.start.device import reference_frequency
from hystfmu.start.excitation import excitation


# ---- lag -------------------------------------------------------------------------------------------------------------
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


@pytest.mark.some(0.5)
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


# ---- feedback --------------------------------------------------------------------------------------------------------
def noisy(u, plant=plants.prandtl_ishlinskii, noise=1e-3, seed=0):
    y = plant(u)
    return Dataset.from_signal(u, y + noise * np.ptp(y) * np.random.default_rng(seed).normal(size=len(y)), 1e-3)


def tracked(seed, noise, Kp, Ki):
    """A sum of plays that follows a reference under feedback of its noisy output."""
    r, rng = 0.8 * training(40, seed, 0.03), np.random.default_rng(seed)
    width, z, total, u = np.linspace(0.05, 0.8, 10), np.zeros(10), 0.0, 0.0
    rows = []
    for wanted in r:
        z = np.minimum(np.maximum(z, u - width), u + width)
        y = 0.6 * u + 0.05 * z.sum() + noise * rng.normal()
        rows.append((u, y))
        total += Ki * (wanted - y)
        u = wanted + Kp * (wanted - y) + total
    return Dataset.from_signal(*np.array(rows).T, 1e-3)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(("noise", "Kp", "Ki"), [(2e-3, 0.3, 0.1), (5e-3, 0.0, 0.1), (1e-3, 0.5, 0.3)])
def test_feedback_is_seen(seed, noise, Kp, Ki):
    assert len(feedback(tracked(seed, noise, Kp, Ki))) == 1


def test_a_fit_reports_it():
    warned = fit(tracked(1, 5e-3, 0.3, 0.1), "prandtl_ishlinskii").fit["warnings"]
    assert sum("closed-loop" in w for w in warned) == 1


def walk(seed):
    return np.cumsum(np.random.default_rng(seed).normal(size=4000)) / 60


def designed(reversals, seed, noise):
    """A record of the input that `start` designs: its tones hide in the residual of the plays of the test."""
    u = 50 + 50 * nested_reversals(reversals, seed, 0.04)
    record = Dataset.from_signal(u, u, 1e-3)
    u = excitation(record, reference_frequency(record), 200.0)[0]
    y = 0.5 * u + plants.plays(u, np.array([2.0, 6.0, 12.0, 20.0]), 0.0) @ [0.2, 0.15, 0.1, 0.1]
    return Dataset.from_signal(u, y + noise * np.random.default_rng(seed + 1).normal(size=len(y)), 1e-3)


DESIGNED = {1: (31, 184, 0.02), 2: (18, 286, 0.05)}


OPEN = {
    "nested reversals": lambda seed: noisy(training(40, seed, 0.03), seed=seed),
    "decaying sine": lambda seed: noisy(decaying_sine(20, 0.1), seed=seed),
    "walk": lambda seed: noisy(walk(seed), seed=seed),
    "white input": lambda seed: noisy(np.random.default_rng(seed).normal(size=2000), seed=seed),
    "Bouc-Wen": lambda seed: noisy(walk(seed)[:1500], plants.bouc_wen, seed=seed),
    "asymmetric": lambda seed: noisy(training(40, seed, 0.03), plants.asymmetric, seed=seed),
    "noise of the sensor of the input": lambda seed: noisy(
        training(40, seed, 0.03) + 1e-3 * np.random.default_rng(seed + 9).normal(size=len(training(40, seed, 0.03)))
    ),
    "16 levels": lambda seed: noisy(walk(seed), lambda u: np.round(8 * plants.prandtl_ishlinskii(u)) / 8, seed=seed),
    "piezo": lambda seed: synthetic.piezo(60, 1000.0, seed=seed),
    "designed input": lambda seed: designed(*DESIGNED[seed]),
    "open loop, late sensor": lambda seed: noisy(
        walk(seed), lambda u: np.roll(plants.prandtl_ishlinskii(u), 3), seed=seed
    ),
}


@pytest.mark.some(5)
@pytest.mark.parametrize("name", OPEN)
@pytest.mark.parametrize("seed", [1, 2])
def test_open_loop_records_are_not_warned_about(name, seed):
    assert feedback(OPEN[name](seed)) == []


# ---- drift and creep -------------------------------------------------------------------------------------------------
U = signals.training(40, 3)[::2]
Y = plants.prandtl_ishlinskii(U)
SPAN = np.ptp(Y)
H = 0.01


def warned(y, key="prandtl_ishlinskii", **options):
    return fit(Dataset.from_signal(U, y, H), key, **options).fit.get("warnings", [])


@pytest.mark.some(1)
@pytest.mark.parametrize("percent", [3.0, -3.0])
def test_a_linear_drift_is_said_with_its_size(percent):
    y = Y + percent / 100 * SPAN * np.arange(len(U)) / len(U)
    m = fit(Dataset.from_signal(U, y, H), "prandtl_ishlinskii")
    (text,) = m.fit["warnings"]
    total, error = drift(y - m.predict(U))
    said = 100 * total / np.ptp(y)
    assert text.startswith(f"the output drifts by {said:+.2g} % of its span or more")
    assert 0.5 < said / percent < 1.05  # plays absorb a part
    assert error < abs(total) / 5


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_no_drift_no_word(noise):
    assert warned(Y + noise * SPAN * np.random.default_rng(0).normal(size=len(U))) == []


def test_an_offset_is_no_drift_and_is_taken():
    m = fit(Dataset.from_signal(U, Y + 100.0, H), "prandtl_ishlinskii")
    assert "warnings" not in m.fit
    assert m.fit["rms_percent"] < 0.1


@pytest.mark.some(0.5)
def test_creep_is_taken_by_lags_and_left_by_plays_alone():
    """y plus 10 % of a first-order lag of it, T = 2 s, integrated by the exact exponential between rows."""
    q = np.zeros(len(U))
    for k in range(1, len(U)):
        q[k] = q[k - 1] + (1 - np.exp(-H / 2)) * (Y[k] - q[k - 1])
    data = Dataset.from_signal(U, Y + 0.1 * q, H)
    plays, lags = fit(data, "prandtl_ishlinskii"), fit(data, "actuator")
    assert lags.fit["rms_percent"] < plays.fit["rms_percent"] / 3
    assert "warnings" not in lags.fit
    v = signals.nested_reversals(60, 9, 0.02)
    z, q = plants.prandtl_ishlinskii(v), np.zeros(len(v))
    for k in range(1, len(v)):
        q[k] = q[k - 1] + (1 - np.exp(-H / 2)) * (z[k] - q[k - 1])
    of = [np.sqrt(np.mean((m.predict(v) - z - 0.1 * q) ** 2)) for m in (plays, lags)]
    assert of[1] < of[0] / 2
