"""Jumps of references and disturbances that fall between two steps: they take effect at the next one, and this says so.

No scheme here cuts a step at an event: a unit sees a jump at the end of its step, as sampled hardware would.
"""

from __future__ import annotations

import math

from hystfmu.graph import Node
from hystfmu.scenario.foreign import Foreign
from hystfmu.scenario.system import System

NEAR = 1e-9  # of a step: `hyst_reached` of the core counts a time as reached


def missed(system: System) -> list[str]:
    """One line for every parameter whose jump the steps of its unit miss: its time, and when it takes effect."""
    lines = []
    for part in system.parts:
        if isinstance(part.graph, Foreign):
            continue
        h = system.length(part) / part.substeps
        for node in part.graph.nodes:
            parameter, times = _jumps(node)
            late = [t for t in times if 0 < t < system.case.stop and abs(t / h - round(t / h)) > NEAR * (1 + t / h)]
            if late:
                name, then = f"{system.case.title}: {part.name}.{parameter}", math.ceil(late[0] / h) * h
                lines.append(
                    f"{name}: the jump at {late[0]:.9g} s is between two steps of {h:g} s "
                    f"and takes effect at {then:.9g} s"
                )
    return lines


def _jumps(node: Node) -> tuple[str, list[float]]:
    """The parameter that times the jumps of a block, and their times."""
    if node.type == "disturbance" and node.value("step")[0] != 0:
        return "t_step", [float(node.value("t_step")[0])]
    if node.type == "reference":
        (shape,) = (v for v in node.block.vars if v.name == "shape")
        levels = node.value("levels")
        if shape.choices[int(node.value("shape")[0])] == "steps":
            return "T", [k * float(node.value("T")[0]) for k in range(1, len(levels)) if levels[k] != levels[k - 1]]
    return "", []
