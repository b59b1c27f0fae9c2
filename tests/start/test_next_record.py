"""The input to measure next stays inside what the record shows of the device, and the second fit is better for it."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import hystfmu as hy
from hystfmu.start.device import reference_frequency
from hystfmu.start.excitation import DRAWS, _path, excitation, information

sys.path.insert(0, str(Path(__file__).parents[1] / "identify"))
from foreign.solvers import relays

H = 1e-3


def relay_device(width: float):
    """Relays with a Gaussian density, and a linear term."""
    return lambda u: (
        relays(u, lambda a, b: np.exp(-((((a - b) / 2 - 0.35) / width) ** 2) / 2 - ((a + b) / 2 / 0.3) ** 2 / 2), 40)
        + 0.3 * u
    )


def one_sine(device) -> hy.Dataset:
    u = np.sin(2 * np.pi * np.arange(1000) / 200)
    return hy.Dataset.from_signal(u, device(u), H)


def test_a_device_that_began_with_one_sine_is_known_five_times_better() -> None:
    """Relays inside the loop of the sine have not moved: nothing tells their weights."""
    seed = int(np.random.SeedSequence().generate_state(1)[0])
    device = relay_device(float(np.random.default_rng(seed).uniform(0.15, 0.3)))
    data = one_sine(device)
    held_out = list(hy.signals.held_out(seed).values())

    def error(model) -> float:
        return float(np.sqrt(np.mean(np.concatenate([model.predict(v, H) - device(v) for v in held_out]) ** 2)))

    first = hy.fit(data, "krasnoselskii_pokrovskii", levels=12)
    u, h = excitation(data, reference_frequency(data), 200.0, first)
    both = hy.Dataset.joined([data, hy.Dataset.from_signal(u, device(u), h)])
    second = hy.fit(both, "krasnoselskii_pokrovskii", levels=12)
    assert error(second) < error(first) / 5, f"seed {seed}: {error(first):.3g}, then {error(second):.3g}"


@pytest.mark.parametrize("offset", [0.0, 50.0])
def test_it_stays_within_the_range_and_the_speed_of_the_record(offset: float) -> None:
    u = offset + 50 * np.sin(2 * np.pi * np.arange(1000) / 200)
    data = hy.Dataset.from_signal(u, u, H)
    found, h = excitation(data, reference_frequency(data), 200.0)
    assert h == data.h
    assert found[0] == found[-1] == u[0]
    assert u.min() <= found.min() < 0.99 * u.min() + 0.01 * u.max()
    assert 0.01 * u.min() + 0.99 * u.max() < found.max() <= u.max()
    assert np.abs(np.diff(found)).max() <= 1.01 * np.abs(np.diff(u)).max()


def test_the_draw_is_the_one_that_tells_most_of_the_model() -> None:
    data = one_sine(relay_device(0.2))
    model = hy.Model("device", hy.blocks.PrandtlIshlinskii(w0=0.5, r=[0.2, 0.7], w=[0.3, 0.2]).graph)
    found, h = excitation(data, reference_frequency(data), 200.0, model)
    speed = np.abs(np.diff(data.u)).max()
    told = [information(model, data, v, h) for v in (found, data.u, 0.1 * data.u)]
    assert told[0] > told[1] > told[2] > 0
    drawn = [_path(0.0, 1 / (reference_frequency(data) * h), speed, 0.2, seed) for seed in range(1, 1 + DRAWS)]
    assert told[0] >= 0.9 * max(information(model, data, v, h) for v in drawn)
