"""Models of several blocks against the C core: the hysteretic actuator, and the example against its scenario's loop."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import library
import numpy as np
import simulate

from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.model import Model
from hystfmu.unit import Unit

SCENARIOS = library.ROOT.parents[1] / "scenarios"
OMEGA_N = 2 * np.pi * 500


def test_hysteretic_actuator_agrees_with_the_chain_of_units(tmp_path: Path) -> None:
    h = 1e-4
    before = simulate.run("HystFMU.Validation.BacklashSumDynamics", tmp_path / "r.npz").at(h, "left")
    hysteresis = Node("h", "backlash_sum", {}, {"w0": 0.3, "r": np.linspace(0.05, 0.5, 10), "w": np.full(10, 0.1)})
    dynamics = Node("g", "transfer_function", {}, {"b": [1.0], "a": [1 / OMEGA_N**2, 2 * 0.7 / OMEGA_N, 1.0]})
    # what the dynamics get in row k was held since instant k - 1
    v = Graph.single(hysteresis).run(before["tested.u"])
    expected = Graph.single(dynamics).run(np.r_[0.0, v[:-1]], h)
    assert np.ptp(expected) > 0.3
    # the solver at Tolerance = 1e-10
    assert np.abs(before["tested.y"] - expected).max() <= 1e-8


def controller_side(units: dict[str, Any], identified: Graph) -> Unit:
    """Reference, feed-forward, exact inverse of the identified model and controller as one unit: y -> u."""
    hysteresis, readout = identified.node("hysteresis"), identified.node("readout")
    gain, offset = readout.value("gain")[0], readout.value("offset")[0]

    def node(name: str, unit: str) -> Node:
        return Node(name, units[unit]["block"], units[unit].get("dims", {}), units[unit].get("values", {}))

    nodes = [
        node("reference", "reference"),
        node("feedforward", "feedforward"),
        Node("scaling", "scaling", {"n": 1}, {"gain": [1 / gain], "offset": [-offset / gain]}),
        Node("inverse", "prandtl_ishlinskii_inverse", hysteresis.dims, hysteresis.values),
        node("controller", "sliding_mode"),
    ]
    wires = [
        ("reference.r_lead", "feedforward.r"),
        ("reference.dr_lead", "feedforward.dr"),
        ("reference.ddr_lead", "feedforward.ddr"),
        ("feedforward.v", "scaling.u"),
        ("scaling.y", "inverse.y"),
        ("inverse.u", "controller.u_ff"),
        ("reference.r", "controller.y_d"),
    ]
    ports = [Output(n.split(".")[1], n) for n in ("controller.u", "reference.r")]
    return Unit(Graph(nodes, wires, [Input("y", ("controller.y",))], ports, sort=False))


def test_sliding_mode_example_agrees_with_the_units_of_the_scenario(tmp_path: Path) -> None:
    scenario = tomllib.loads((SCENARIOS / "sliding_mode" / "scenario.toml").read_text())
    h, units = scenario["step"], scenario["units"]
    order = [u for u in scenario["order"] if u in ("plant", "sliding_mode")]
    assert order == ["plant", "sliding_mode"], "the example is written for the order: plant first"
    plant = Unit(Model.load(SCENARIOS / "sliding_mode" / units["plant"]["model"]).graph)
    identified = Model.load(SCENARIOS / "sliding_mode" / units["inverse"]["inverse_of"]).graph
    rest = controller_side(units, identified)

    now = simulate.run("HystFMU.Examples.SlidingMode", tmp_path / "r.npz").at(h)
    rows = np.empty((len(now["time"]), 3))
    plant.initialize(0.0, u=0.0)
    rest.initialize(0.0, y=plant.get("y"))
    for k in range(len(rows)):
        if k > 0:
            plant.set("u", rest.get("u"))  # the command held since the last sample
            plant.do_step((k - 1) * h, h)
            rest.set("y", plant.get("y"))
            rest.do_step((k - 1) * h, h)
        rows[k] = rest.get("r"), rest.get("u"), plant.get("y")

    got = np.column_stack([now[n] for n in ("reference.r", "controller.u", "plant.y")])
    error = np.abs(got - rows).max(axis=0) / np.abs(rows).max(axis=0)
    print("largest differences of r, u, y:", *(f"{e:.1e}" for e in error))
    assert len(rows) == round(scenario["stop"] / h)
    # the solver at Tolerance = 1e-10; the controller divides its error by the sample period
    assert error.max() <= 1e-8
    # the loop tracks: after the first period within 0.1 % RMS of the stroke
    late = now["time"] > 0.1
    assert np.sqrt(np.mean((got[:, 2] - got[:, 0])[late] ** 2)) <= 0.001 * 2.0
