"""Creep beside the hysteresis: what lasts of a stroke, and margins of a loop whose inverse has the creep in it."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

import hystfmu as hy
from hystfmu import Graph, Input, Node, Output
from hystfmu.scenario.loop.table import margin_table
from hystfmu.start.closed_loop import close
from hystfmu.start.device import reach
from hystfmu.start.requirements import Requirements

H, T, SLOW = 0.02, 1.5, -0.7


def with_creep(w: float) -> hy.Model:
    """Return plays with a first-order lag of the input beside them, identified on -3..3 V, say."""
    nodes = [
        Node("hysteresis", "prandtl_ishlinskii", {}, {"w0": 1.0, "r": [0.3, 0.9], "w": [0.3, 0.2]}),
        Node("creep", "creep", {}, {"w0": 0.0, "w": [w], "T": [T], "start": 1.0}),
        Node("readout", "sum", {"n": 2}, {"k": [1.0, 1.0]}),
    ]
    wires = [("hysteresis.y", "readout.u[1]"), ("creep.y", "readout.u[2]")]
    graph = Graph(nodes, wires, [Input("u", ("hysteresis.u", "creep.u"))], [Output("y", "readout.y")])
    return hy.Model("device", graph, provenance={"span_u": [-3.0, 3.0], "h": H}, step=H)


def test_what_creep_takes_back_is_no_stroke() -> None:
    """Plays at the end of a ramp to +-3: 3 + 0.3 (3 - 0.3) + 0.2 (3 - 0.9) = 4.23; held, the lag adds w 3."""
    low, high, falling = reach(with_creep(SLOW), round(20 * T / H))
    assert not falling
    assert [low, high] == pytest.approx([-4.23 - 3 * SLOW, 4.23 + 3 * SLOW], rel=1e-6)
    assert reach(with_creep(-2.0), round(20 * T / H))[2]
    high = reach(with_creep(0.5), round(20 * T / H))[1]
    assert high < 4.23 + 1.5, "creep that adds has not come yet in a sweep"


def test_an_inverse_with_the_creep_in_it_leaves_no_dynamics(tmp_path: Path) -> None:
    """The loop is PI and delay then: the peak of its sensitivity is a closed form."""
    model = with_creep(float(np.random.default_rng().uniform(-0.8, 0.8)))
    Kp, Ki = 0.1, 10.0
    loop = hy.Scenario("creeping", step=H, stop=4.0)
    loop.add("plant", model)
    loop.add("reference", hy.blocks.Reference(amplitude=1.0, frequency=0.5))
    loop.add("pid", hy.blocks.Pid(Kp=Kp, Ki=Ki))
    loop.add("inverse", model.inverse("implicit"))
    loop.add("delay", hy.blocks.Delay(n=1))
    for ends in (
        ("reference.r", "pid.y_d"),
        ("reference.r", "pid.u_ff"),
        ("plant.y", "pid.y"),
        ("pid.u", "inverse.u"),
        ("inverse.y", "delay.u"),
        ("delay.y", "plant.u"),
    ):
        loop.connect(*ends)
    loop.metric("tracking", "rms", "plant.y", "reference.r")
    table = margin_table([loop.save(tmp_path / "loop")])
    assert not table.refused
    z = np.exp(1j * np.geomspace(1e-4, 1, 20000) * np.pi)
    L = (Kp + Ki * H * z / (z - 1)) / z**2  # the hold, and a step of delay
    assert table.rows[0].margins["Ms_db"] == pytest.approx(float(-20 * np.log10(np.abs(1 + L).min())), abs=0.02)


def test_a_device_that_contracts_has_a_loop(tmp_path: Path) -> None:
    """The gain that stands for the inverse in one case falls too."""
    u = 3 * np.sin(np.arange(1200) / 30) * np.linspace(1, 0.2, 1200)
    graph = with_creep(0.0).graph.replace(Node("readout", "sum", {"n": 2}, {"k": [-1.0, 0.0], "offset": 3.0}))
    model = hy.Model("device", graph, provenance={"span_u": [-3.0, 3.0]}, step=H)
    data = hy.Dataset(H * np.arange(1200), u, model.predict(u))
    quiet = str, lambda step: nullcontext(lambda done: None)
    made = close(model, data, tmp_path / "loop", "device", Requirements(), *quiet)
    assert made.results.passed
    assert not made.margins.broken()
    assert not made.approved, "the record does not show the dynamics"
    errors = {r.case: r.verdicts[0].value for r in made.results}
    assert errors["sine"] < errors["neither"] < 50
