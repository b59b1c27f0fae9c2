"""The start of an exported model: at a constant input the output stands still from the first instant."""

from itertools import pairwise
from pathlib import Path

import exported
import numpy as np
import pytest

from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.model import Model
from hystfmu.modelica import export_modelica
from hystfmu.modelica.realisation import IN_A_ROW, kinds, missing

VOLTS = 80.0
RESONANCE = {"a": [1.0, 300.0, 1e6], "b": [1e6], "start": "steady"}
LAGS = {"w": [0.03, 0.02], "T": [0.05, 0.8], "w0": 1.0, "start": "steady"}
HYSTERESIS = {
    "prandtl_ishlinskii": Node(
        "hysteresis", "prandtl_ishlinskii", {"n": 3}, {"r": [2.0, 9.0, 25.0], "w": [0.03, 0.02, 0.02], "w0": 0.06}
    ),
    "preisach": Node(
        "hysteresis", "preisach", {"n": 2}, {"lo": -100.0, "hi": 100.0, "E": [2.0, 6.0, 2.0], "offset": 1.0}
    ),
}


def behind(hysteresis: Node, *dynamics: Node) -> Model:
    """An operator from volts with dynamics behind it, one after the other."""
    nodes = (hysteresis, *dynamics)
    port = {n.name: f"{n.name}.{n.block.of('output')[0].name}" for n in nodes}
    wires = [(port[a.name], f"{b.name}.u") for a, b in pairwise(nodes)]
    graph = Graph(nodes, wires, [Input("u", ("hysteresis.u",), unit="V")], [Output("y", port[nodes[-1].name])])
    return Model("made", graph, 1e-3, "a chain", provenance={"span_u": [0.0, 160.0]})


def alternating(count: int) -> list[Node]:
    """Creep, dynamics, creep, ...: so many blocks that start in equilibrium."""
    return [
        Node(f"creep_{k}", "creep", {"n": 2}, LAGS) if k % 2 == 0 else
        Node(f"g_{k}", "transfer_function", {"na": 2, "nb": 0}, RESONANCE)
        for k in range(count)
    ]  # fmt: skip


def at_constant(model: Model, kind: str, folder: Path) -> dict[str, np.ndarray]:
    """Rows of a realisation of an exported model whose input stands at 80 V."""
    package = export_modelica(model, folder, "Piezo")
    rates = "tested.du = 0;" if kind != "Model" else ""
    (package / "Held.mo").write_text(
        f"within Piezo; model Held import HystFMU; {kind} tested; equation tested.u = {VOLTS}; {rates} "
        "annotation (experiment(StopTime = 0.1005, Interval = 0.001, Tolerance = 1e-10)); end Held;"
    )
    return exported.simulated(package, package / "Held.mo")


CASES = [
    ("prandtl_ishlinskii", "Model", 2), ("prandtl_ishlinskii", "Events", 2), ("prandtl_ishlinskii", "Events", IN_A_ROW),
    ("prandtl_ishlinskii", "Smooth", 4), ("preisach", "Events", 2),
]  # fmt: skip


@pytest.mark.turn("exported Modelica")
@pytest.mark.some(1)
@pytest.mark.parametrize(("hysteresis", "kind", "count"), CASES)
def test_constant_voltage_moves_nothing(hysteresis: str, kind: str, count: int, tmp_path: Path) -> None:
    check(hysteresis, kind, count, tmp_path)


def check(hysteresis: str, kind: str, count: int, folder: Path) -> None:
    """Simulate an exported chain at a constant voltage, and compare it with the model."""
    model = behind(HYSTERESIS[hysteresis], *alternating(count))
    y = at_constant(model, kind, folder)["tested.y"]
    expected = model.predict(np.full(len(y), VOLTS)).ravel()
    assert np.ptp(expected) <= 1e-12 * abs(expected[0])
    assert abs(expected[0]) > 1
    assert np.abs(y - expected[0]).max() <= 1e-9 * abs(expected[0])


def test_more_in_a_row_than_the_start_has_passes() -> None:
    model = behind(HYSTERESIS["prandtl_ishlinskii"], *alternating(IN_A_ROW + 1))
    assert missing(model.graph, "Events") == "more than 8 blocks with dynamics stand in a row; take Smooth"
    assert kinds(model.graph) == ["Smooth"]
