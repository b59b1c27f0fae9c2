"""The controller of the scenario h_infinity is the one that the design returns for its weight."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hystfmu.design import loop_shaping
from hystfmu.design.linear import python_control
from hystfmu.scenario import Scenario

FOLDER = Path(__file__).parents[3] / "scenarios" / "h_infinity"


def test_controller_is_that_of_the_design() -> None:
    control, scenario = python_control(), Scenario(FOLDER)
    table = scenario.spec.units["h_infinity"].graph
    assert table is not None
    node = table.graph().node
    (T_z,), (T_p,) = node("lead").value("T_z"), node("lead").value("T_p")
    W = node("lead").value("K")[0] * control.tf([T_z, 1.0], [T_p, 1.0])
    for name in ("pi_1", "pi_2"):
        W *= control.tf([1.0, node(name).value("Ki")[0]], [1.0, 0.0])
    w_n = 2 * np.pi * 500
    G0 = control.tf([w_n**2], [1.0, 1.4 * w_n, w_n**2])
    found = loop_shaping(G0 * control.tf(*control.pade(1.5 * scenario.spec.step, 2)), W)
    assert found.b_opt > 0.25, "a weight that does not ask for too much"
    points = 1j * np.geomspace(1.0, 1e6, 50)
    shipped = sum(control.tf(node(n).value("b"), node(n).value("a"))(points) for n in ("slow", "fast"))
    assert np.abs(shipped / found.robust(points) - 1).max() < 1e-5
    assert found.b_opt == pytest.approx(0.40, abs=0.005), "as its text says"
