"""What a study of a started loop draws: closed forms of second-order dynamics, widths, gains, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

import hystfmu as hy
from hystfmu.start.device import device
from hystfmu.start.drawn import drawn

K = np.arange(1200)
U = 50 + 50 * np.exp(-0.001 * K) * np.sin(2 * np.pi * K / 150)
PLAYS = {"w0": 0.5, "r": [5.0, 12.0], "w": [0.3, 0.2]}


def ranges(*tail: hy.Node) -> dict[str, dict[str, object]]:
    nodes = [hy.Node("h", "prandtl_ishlinskii", values=PLAYS), *tail]
    wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in zip(nodes, tail, strict=False)]
    ends = [hy.Output("y", f"{nodes[-1].name}.y")]
    model = hy.Model("device", hy.Graph(nodes, wires, [hy.Input("u", ("h.u",))], ends), 1e-3)
    model = hy.Model.of(model)
    model.provenance["span_u"] = model.provenance["trained_u"] = [0.0, 100.0]
    return drawn(device(model, hy.Dataset(1e-3 * K, U, model.predict(U))))


def second_order(f_n: float, zeta: float, gain: float = 1.0, a2: float = 1.0) -> hy.Node:
    w = 2 * np.pi * f_n
    values = {"b": [gain * a2 * w * w], "a": [a2, a2 * 2 * zeta * w, a2 * w * w]}
    return hy.Node("g0", "transfer_function", values={**values, "start": "steady"})


def test_second_order_dynamics_by_frequency_damping_and_gain() -> None:
    rng = np.random.default_rng()
    f_n, zeta, gain = rng.uniform(100, 300), rng.uniform(0.3, 1.0), rng.uniform(0.5, 3)
    found = ranges(second_order(f_n, zeta, gain, rng.uniform(0.1, 9)))
    assert set(found) == {"plant.g0", "plant.h_r"}
    g = found["plant.g0"]["second_order"]
    assert isinstance(g, dict)
    assert g["f_n"] == pytest.approx([0.8 * f_n, 1.2 * f_n], rel=1e-5)
    assert g["zeta"] == pytest.approx([0.7 * zeta, 1.3 * zeta], rel=1e-5)
    assert g["gain"] == pytest.approx([0.8 * gain, 1.2 * gain], rel=1e-5)
    assert found["plant.h_r"] == {"scale": [0.9, 1.1]}


def test_a_static_model_by_the_gain_of_its_output() -> None:
    assert ranges(hy.Node("out", "scaling", values={"gain": 2.0})) == {
        "plant.out_gain": {"scale": [0.8, 1.2]}, "plant.h_r": {"scale": [0.9, 1.1]}
    }  # fmt: skip
    assert set(ranges()) == {"plant.h_r"}


def test_other_dynamics_are_not_drawn() -> None:
    first = hy.Node("lag", "transfer_function", values={"b": [1.0], "a": [0.01, 1.0], "start": "steady"})
    assert set(ranges(first)) == {"plant.h_r"}
