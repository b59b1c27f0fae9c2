"""The loop of `start` around the device itself: its converter holds a command for a step, whatever the rows were."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import hystfmu as hy
from hystfmu.base.arrays import Array
from hystfmu.start.device import COMPUTING, Device, device
from hystfmu.start.loop import loop_scenario
from hystfmu.start.tuning import tune

H, FINER = 1e-3, 8
PLAYS = {"w0": 0.5, "r": [5.0, 12.0], "w": [0.3, 0.2]}


def drawn_device(w: float, zeta: float) -> Device:
    """Plays before second-order dynamics that ramp up to their input, as fits write them, with records of 10 Hz."""
    k = np.arange(1200)
    u = 50 + 50 * np.exp(-0.001 * k) * np.sin(2 * np.pi * k / 100)
    values = {"b": [w * w], "a": [1.0, 2 * zeta * w, w * w], "start": "steady", "hold": "foh"}
    nodes = [hy.Node("h", "prandtl_ishlinskii", values=PLAYS), hy.Node("g0", "transfer_function", values=values)]
    graph = hy.Graph(nodes, [("h.y", "g0.u")], [hy.Input("u", ("h.u",))], [hy.Output("y", "g0.y")])
    model = hy.Model.of(hy.Model("device", graph, H))
    model.provenance["span_u"] = model.provenance["trained_u"] = [0.0, 100.0]
    return device(model, hy.Dataset(H * k, u, model.predict(u)))


def truth(u: Array, w: float, zeta: float) -> Array:
    """Return the output at the end of each step in which a command is held, in steps eight times finer."""
    M = expm(np.array([[0, 1, 0], [-w * w, -2 * zeta * w, w * w], [0, 0, 0]]) * H / FINER)
    x, plays, y = np.zeros(2), [0.0, 0.0], []
    for command in u:
        plays = [min(max(p, command - r), command + r) for p, r in zip(plays, PLAYS["r"], strict=True)]
        v = PLAYS["w0"] * command + sum(p * k for p, k in zip(plays, PLAYS["w"], strict=True))
        for _ in range(FINER):
            x = M[:2, :2] @ x + M[:2, 2] * v
        y.append(x[0])
    return np.array(y)


def test_the_plant_of_the_loop_is_the_device_behind_a_converter() -> None:
    rng = np.random.default_rng()
    w, zeta = 2 * np.pi * rng.uniform(60, 250), rng.uniform(0.3, 0.9)
    found = drawn_device(w, zeta)
    gains = tune([found.dynamics], H, found.delay + COMPUTING)
    for case in ("nested", "inverse_only"):
        result = loop_scenario(found, gains, 1.0, "device").run(case, engine="native")
        assert result.trace is not None
        y = truth(result.trace["delay.y"], w, zeta)
        # the plant comes first in a step and reads the command of the last one
        assert result.trace["plant.y"][1:] == pytest.approx(y[:-1], abs=1e-9)
    r = result.trace["reference.r"][1:]
    e = (y[:-1] - r)[len(r) // 2 :] / np.ptp(r)
    assert 100 * np.sqrt(np.mean(e**2)) < 0.2  # a model on a ramp was followed half a step late: 1.1
