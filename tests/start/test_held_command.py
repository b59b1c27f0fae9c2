"""The plant in the loop of `start` is the device itself: its converter holds a command for a step."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import hystfmu as hy
from hystfmu.base.arrays import Array
from hystfmu.design.plants import Plant
from hystfmu.start.device import FINE, device, plant_model

H = 1e-3
PLAYS = {"w0": 0.5, "r": [5.0, 12.0], "w": [0.3, 0.2]}


def truth(u: Array, w: float, zeta: float, late: int) -> Array:
    """Return the output at the end of each fine step of a device whose command comes some fine steps late."""
    M = expm(np.array([[0, 1, 0], [-w * w, -2 * zeta * w, w * w], [0, 0, 0]]) * H / FINE)
    x, plays, y = np.zeros(2), [0.0, 0.0], []
    for command in np.concatenate([np.zeros(late), np.repeat(u, FINE)])[: len(u) * FINE]:
        plays = [min(max(p, command - r), command + r) for p, r in zip(plays, PLAYS["r"], strict=True)]
        v = PLAYS["w0"] * command + sum(p * k for p, k in zip(plays, PLAYS["w"], strict=True))
        x = M[:2, :2] @ x + M[:2, 2] * v
        y.append(x[0])
    return np.array(y)


def test_the_plant_of_the_loop_is_the_device_behind_a_converter() -> None:
    rng = np.random.default_rng()
    f, zeta, late = rng.uniform(60, 250), rng.uniform(0.02, 0.9), int(rng.integers(0, 8))
    k = np.arange(1200)
    u = 50 + 50 * np.exp(-0.001 * k) * np.sin(2 * np.pi * k / 100)
    model = hy.Model("device", hy.blocks.PrandtlIshlinskii(**PLAYS).graph, H, provenance={"span_u": [0.0, 100.0]})
    found = device(model, hy.Dataset(H * k, u, model.predict(u)))
    plant = plant_model(found, Plant((f,), (zeta,), (1.0,), late * H / FINE))
    command = rng.uniform(0, 100, 60)
    held = np.column_stack([np.repeat(command, FINE), np.zeros(60 * FINE)])
    y = plant.graph.run(np.vstack([np.zeros((1, 2)), held]), H / FINE)[1:]
    assert y == pytest.approx(truth(command, 2 * np.pi * f, zeta, late), abs=1e-9)
