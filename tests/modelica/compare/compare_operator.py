"""A Validation model of an operator or inverse against the C core, whose oracles are in tests/blocks.

The inputs are those that the simulation recorded.  Sampled: the rows just after the instants k Ts.  Events: every
instant, since the memory sees the whole input; an instant has one input, that after its events.  Smooth: every row, and
the true input at a fine grid between them, so that no extremum is missed by the discrete form.
"""

import library
import numpy as np
import simulate
import twin
import validation_signal
from outcome import Outcome, against_reference, relative

from hystfmu.graph import Node

Array = simulate.Array
KINDS = ("Sampled", "Events", "Smooth")
ROUNDING = 1e-12  # Sampled and Events, |difference| / max |output|
TUBE = {"Sampled": 1e-9, "Events": 1e-9, "Smooth": 1e-5}
# Smooth: the solver at Tolerance = 1e-10, corners of the input's rate included; plays with a corner rounded over
# width = 1e-3, weights up to 10 in sum; a branch of 50 pieces besides
SOLVER, WIDTH, POLYGON = 1e-5, 1e-3, 2e-3
GRAPHS = {"ImplicitInverse"}  # its unit is a graph: compare_implicit.py


def is_operator(name: str) -> bool:
    """Is it a Validation model of an operator or inverse?"""
    return is_realisation(name, "Validation") and name.rsplit(".", 1)[-1] not in GRAPHS


def is_realisation(name: str, package: str) -> bool:
    """Is it a class in Sampled, Events or Smooth of Operators, Inverse or Validation?"""
    parts = name.split(".")
    return len(parts) == 4 and parts[1] == package and parts[2] in KINDS


def bound(c: library.Class) -> float:
    """What |Modelica - C core| / max |C core| of a class may be."""
    if ".Smooth." not in c.name:
        return ROUNDING
    own = library.parameters(c)
    return POLYGON if "plays" in own else WIDTH if "width" in own else SOLVER


def run_c(block: str, node: Node, u: Array, h: float) -> Array:
    """Outputs of the class `block` for the rows of u, by the C core."""
    y = twin.run(node, u[:, None], h)
    return u[:, None] - y if block == "StopBank" else y


def compare(name: str) -> Outcome:
    """Simulate a Validation model of an operator and compare it with the unit."""
    kind = name.split(".")[2]
    model = library.classes()[name]
    block, node, h = twin.tested(model)
    tested = library.find(str(model.tree.symbols["tested"].type), name)
    assert tested is not None
    limit = bound(tested)
    trajectory = simulate.run(name)
    rows = trajectory.at(h) if kind == "Sampled" else trajectory.instants() if kind == "Events" else trajectory.values
    u = twin.columns(rows, node, "input")[:, 0]
    ports = [("s" if block == "StopBank" else v.name, node.sizes[v.name]) for v in node.block.of("output")]
    got = np.hstack([simulate.port(rows, "tested", port, size) for port, size in ports])
    if kind == "Smooth":
        driven, keep, step = validation_signal.fine(name, rows["time"], 2e-5)
    else:
        driven, keep, step = u, np.arange(len(u)), h
    expected = run_c(block, node, driven, step)[keep]
    assert np.ptp(expected, axis=0).min() > 0, "an output that does not move tests nothing"
    reference, tube = against_reference(name, rows["time"], got, TUBE[kind])
    return Outcome(
        name, len(got), trajectory.events, trajectory.seconds, error_c=relative(got, expected), bound_c=limit,
        error_reference=reference, tube=tube,
    )  # fmt: skip
