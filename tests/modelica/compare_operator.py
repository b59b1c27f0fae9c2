"""A Validation model of an operator or inverse against the C core and the plain numpy form.

The inputs are those that the simulation recorded.  Sampled: the rows just after the instants k Ts.  Events: every
instant, since the memory sees the whole input; an instant has one input, that after its events.  Smooth: every row, and
the true input at a fine grid between them, so that no extremum is missed by the two discrete forms.
"""

from __future__ import annotations

from pathlib import Path

import library
import numpy as np
import numpy_forms
import simulate
import twin
import validation_signal
from outcome import NAN, Outcome, against_reference, relative

from hystfmu.graph import Node

Array = simulate.Array
KINDS = ("Sampled", "Events", "Smooth")
ROUNDING = 1e-12  # Sampled and Events, |difference| / max |output|
TUBE = {"Sampled": 1e-9, "Events": 1e-9, "Smooth": 1e-5}
THIN = 3  # every third row for the plain forms, which look at the whole history at each
# Smooth: the solver at Tolerance = 1e-10, corners of the input's rate included; plays with a corner rounded over
# width = 1e-3, weights up to 10 in sum; Zhao-Tan and Ma have the 50 pieces of their branch besides.
SMOOTH = {"BoucWen": 1e-5, "BoucWenKnee": 1e-5, "Duhem": 1e-5, "Creep": 1e-5, "CreepSteady": 1e-5}
WIDTH, POLYGON = 1e-3, 2e-3
# plain Runge-Kutta with a corner at 0; a staircase of many loops
NUMPY_BOUNDS = {"BoucWen": 1e-7, "BoucWenKnee": 1e-7, "Duhem": 1e-7, "DuhemSteps": 1e-7, "Preisach": 1e-5}
FAST = {"PlayBank", "StopBank", "BacklashSum", "PrandtlIshlinskii", "Creep", "BoucWen", "Duhem"}  # in numpy
GRAPHS = {"ImplicitInverse"}  # its unit is a graph: compare_implicit.py
FORGETS = {"PrandtlIshlinskiiForgets"}  # a full memory: the numpy form has no limit


def is_operator(name: str) -> bool:
    """Is it a Validation model of an operator or inverse?"""
    return is_realisation(name, "Validation") and name.rsplit(".", 1)[-1] not in GRAPHS


def is_realisation(name: str, package: str) -> bool:
    """Is it a class in Sampled, Events or Smooth of Operators, Inverse or Validation?"""
    parts = name.split(".")
    return len(parts) == 4 and parts[1] == package and parts[2] in KINDS


def bound(kind: str, short_name: str) -> float:
    """What |Modelica - C core| / max |C core| may be."""
    if kind != "Smooth":
        return ROUNDING
    if short_name in SMOOTH:
        return SMOOTH[short_name]
    return POLYGON if short_name in ("ZhaoTan", "ConstraintFactor") else WIDTH


def values_of(node: Node) -> dict[str, object]:
    """Every parameter of a node in plain numbers, defaults included; a choice is its word."""
    found: dict[str, object] = dict(node.dims)
    for v in node.block.parameters:
        value = node.value(v.name)
        found[v.name] = (
            v.choices[int(value[0])] if v.choices else np.asarray(value) if v.size != "1" else float(value[0])
        )
    return found


def run_c(block: str, node: Node, u: Array, h: float) -> Array:
    """Outputs of the class `block` for the rows of u, by the C core."""
    y = twin.run(node, u[:, None], h)
    return u[:, None] - y if block == "StopBank" else y


def compare(name: str, out: Path) -> Outcome:
    """Simulate a Validation model of an operator and hold it against the three."""
    kind, short_name = name.split(".")[2:]
    block, node, h = twin.tested(library.classes()[name])
    trajectory = simulate.run(name, out)
    rows = trajectory.at(h) if kind == "Sampled" else trajectory.instants() if kind == "Events" else trajectory.values
    u = twin.columns(rows, node, "input")[:, 0]
    ports = [("s" if block == "StopBank" else v.name, node.sizes[v.name]) for v in node.block.of("output")]
    got = np.hstack([simulate.port(rows, "tested", port, size) for port, size in ports])
    if kind == "Smooth":
        driven, keep, step = validation_signal.fine(name, rows["time"], 2e-5)
        plain_driven, plain_keep, plain_step = validation_signal.fine(
            name, rows["time"], 2e-5 if block in FAST else 1e-4
        )
    else:
        driven, keep, step = plain_driven, plain_keep, plain_step = u, np.arange(len(u)), h
    expected = run_c(block, node, driven, step)[keep]
    assert np.ptp(expected, axis=0).min() > 0, "an output that does not move tests nothing"
    plain = NAN
    if short_name not in FORGETS:
        form = numpy_forms.outputs(block, plain_driven, values_of(node), plain_step, plain_keep[::THIN])
        plain = relative(got[::THIN], form)
    return Outcome(
        name,
        len(got),
        trajectory.events,
        trajectory.seconds,
        against_reference(name, rows["time"], got),
        TUBE[kind],
        relative(got, expected),
        bound(kind, short_name),
        plain,
        max(bound(kind, short_name), NUMPY_BOUNDS.get(short_name, 0.0)),
    )
