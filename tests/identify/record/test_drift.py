"""Drift and creep in data: drift is reported with its size, models with lags represent creep."""

import numpy as np
import plants
import pytest

from hystfmu import Dataset
from hystfmu.data import signals
from hystfmu.identify import fit
from hystfmu.model.guards import drift

U = signals.training(40, 3)[::2]
Y = plants.prandtl_ishlinskii(U)
SPAN = np.ptp(Y)
H = 0.01


def warned(y, key="prandtl_ishlinskii", **options):
    return fit(Dataset.from_signal(U, y, H), key, **options).fit.get("warnings", [])


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
