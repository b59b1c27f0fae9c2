"""Every Validation model against the C core: the same values, the inputs that the simulation recorded, every output."""

from __future__ import annotations

from pathlib import Path

import library
import numpy as np
import pytest
import simulate

from hystfmu.core import BlockType, block_types
from hystfmu.graph import Graph, Node

MODELS = sorted(
    n
    for n, c in library.classes().items()
    if n.startswith("HystFMU.Validation.") and c.short_name != "BacklashSumDynamics"  # in test_loops.py
)
TWINS = {t.class_name: t for t in block_types().values()}

HELD = {"TransferFunction", "Creep"}  # continuous, with an input that is held between samples
# |Modelica - C core| / max |C core|.  Sampled and static blocks: rounding of the last places.
ROUNDING = 1e-14
BOUNDS = {
    "TransferFunction": 1e-9,  # continuous: the solver at Tolerance = 1e-10 against the exact discretisation
    "TransferFunctionSteady": 1e-8,
    "Creep": 1e-9,
    "BoucWenKnee": 1e-9,  # n = 2.5: twenty Runge-Kutta steps for each sample against the series of the C core
}


def twin_of(c: library.Class) -> tuple[BlockType, dict[str, object]]:
    """The C block of a library class, and values that are not parameters of the class."""
    return (TWINS["Reference"], {"shape": "sine"}) if c.short_name == "Sine" else (TWINS[c.short_name], {})


@pytest.mark.parametrize("name", MODELS)
def test_model_agrees_with_the_c_core(name: str, tmp_path: Path) -> None:
    model = library.classes()[name]
    tested = model.tree.symbols["tested"]
    c = library.find(str(tested.type), name)
    assert c is not None
    kind, extra = twin_of(c)
    values = {k: library.evaluate(e, {}) for k, e in library.modifiers(tested.class_modification).items()}
    step = values.pop("Ts", library.experiment(model)["Interval"])
    dims = {d.name: values.pop(d.name) for d in kind.dims if d.name in values}
    if model.short_name == "TransferFunctionSteady":
        extra = {"hold": "foh"}  # its input is a ramp between the samples
    node = Node("tested", kind.name, dims, values | extra)

    trajectory = simulate.run(name, tmp_path / "result.npz")
    now, before = trajectory.at(step), trajectory.at(step, "left")
    u = columns(now, kind, node, "input")
    if model.short_name in HELD:
        # the input of row k is what was held from instant k - 1 to instant k, whose left limit is the output
        u = np.vstack([u[:1], u[:-1]])
        now = before
    expected = Graph.single(node).executor().run(u, sum(node.sizes[v.name] for v in kind.of("output")), step)
    got = columns(now, kind, node, "output")
    error = np.abs(got - expected).max(axis=0) / np.abs(expected).max(axis=0)
    print(f"{name}: {len(u)} samples, largest difference {error.max():.1e} of max |y|")
    assert len(u) >= 100
    assert np.ptp(expected, axis=0).min() > 0, "an output that does not move tests nothing"
    assert error.max() <= BOUNDS.get(model.short_name, ROUNDING)


def columns(values: dict[str, simulate.Array], kind: BlockType, node: Node, role: str) -> simulate.Array:
    blocks = [simulate.port(values, "tested", v.name, node.sizes[v.name]) for v in kind.of(role)]
    return np.hstack(blocks) if blocks else np.zeros((len(values["time"]), 0))
