"""A Maxwell-slip sum is a `backlash_sum` with signed weights: an elasto-slide element is its input less a play."""

import numpy as np
import pytest
from numpy.typing import NDArray
from whole_history import SIGNALS, every_signal

from hystfmu.graph.blocks import BacklashSum, PrandtlIshlinskii

Array = NDArray[np.float64]


def maxwell_slip(u: Array, k: Array, f: Array, s0: Array, u0: float) -> Array:
    """Spring forces k_i s_i, by increments: an element stretches with the input until its force is f_i, then slides."""
    force, last = [], u0
    s = s0
    for x in u:
        s = s + (x - last)
        s = np.sign(s) * np.minimum(np.abs(s), f / k)
        last = x
        force.append(float(k @ s))
    return np.array(force)


@every_signal
def test_it_is_a_backlash_sum(signal: str) -> None:
    """w0 = sum k_i, w_i = -k_i, r_i = f_i / k_i, z0_i = u0 - s0_i."""
    u, rng = SIGNALS[signal], np.random.default_rng(3)
    k, f, u0 = rng.uniform(0.5, 3, 7), rng.uniform(0.05, 1.5, 7), 0.2
    s0 = rng.uniform(-1, 1, 7) * f / k
    y = BacklashSum(w0=k.sum(), r=f / k, w=-k, z0=u0 - s0)(u)
    want = maxwell_slip(u, k, f, s0, u0)
    assert np.abs(y - want).max() <= 1e-14 * k.sum() * np.abs(u).max()
    assert np.ptp(want) > 0.1


@pytest.mark.parametrize("block", [BacklashSum, PrandtlIshlinskii])
def test_from_rest_it_is_also_the_operator_of_turning_points(block: type) -> None:
    k, f = np.array([2.0, 1.0, 0.5]), np.array([0.4, 0.5, 0.6])
    u = SIGNALS["white"]
    y = block(w0=k.sum(), r=f / k, w=-k)(u)
    assert y == pytest.approx(maxwell_slip(u, k, f, np.zeros(3), 0.0), abs=1e-14)
    assert block(w0=k.sum(), r=f / k, w=-k)([0.0, 5.0])[-1] == pytest.approx(f.sum(), rel=1e-15)  # all slide
