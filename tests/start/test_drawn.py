"""What a study of a started loop draws: gain, modes as far as they are known, widths of the loops, and nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hystfmu as hy
from hystfmu.design.plants import Plant
from hystfmu.start.device import device
from hystfmu.start.run import drawn

K = np.arange(1200)
U = 50 + 50 * np.exp(-0.001 * K) * np.sin(2 * np.pi * K / 150)
PLAYS = {"w0": 0.5, "r": [5.0, 12.0], "w": [0.3, 0.2]}


def ranges(*tail: hy.Node, modes: int = 0) -> dict[str, dict[str, object]]:
    nodes = [hy.Node("h", "prandtl_ishlinskii", values=PLAYS), *tail]
    wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in zip(nodes, tail, strict=False)]
    graph = hy.Graph(nodes, wires, [hy.Input("u", ("h.u",))], [hy.Output("y", f"{nodes[-1].name}.y")])
    model = hy.Model("device", graph, 1e-3, provenance={"span_u": [0.0, 100.0]})
    found = device(model, hy.Dataset(1e-3 * K, U, model.predict(U)))
    f_n, zeta, share = (120.0, 400.0)[:modes], (0.1, 0.05)[:modes], ((1.0,), (0.9, 0.1))[modes - 1]
    if modes:
        plant = Plant(f_n, zeta, share)
        found = replace(found, plant=plant, errors=((0.1, 0.01, 0.0), (40.0, 0.01, 0.0))[:modes])
    return drawn(found)


def test_one_mode_by_frequency_damping_and_gain() -> None:
    found = ranges(modes=1)
    assert set(found) == {"plant.dynamics", "plant.h_r"}
    g = found["plant.dynamics"]["second_order"]
    assert isinstance(g, dict)
    assert g["f_n"] == pytest.approx([0.99 * 120, 1.01 * 120], rel=1e-5)
    assert g["zeta"] == pytest.approx([0.07, 0.13], rel=1e-5)
    assert g["gain"] == pytest.approx([0.8, 1.2], rel=1e-5)
    assert found["plant.h_r"] == {"scale": [0.9, 1.1]}


def test_a_static_model_by_the_gain_of_its_output() -> None:
    assert ranges(hy.Node("out", "scaling", values={"gain": 2.0})) == {
        "plant.out_gain": {"scale": [0.8, 1.2]}, "plant.h_r": {"scale": [0.9, 1.1]}
    }  # fmt: skip
    assert set(ranges()) == {"plant.h_r"}


def test_two_modes_are_not_drawn() -> None:
    assert set(ranges(modes=2)) == {"plant.h_r"}
