"""Sector of local slopes: what an imperfect inverse leaves of the hysteresis of a plant.

A loop closed around an inverse and its plant sees their local slope, which depends on the path.  A controller has to be
stable for every slope of the sector.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.design.linear import linearise
from hystfmu.graph import Graph, Node
from hystfmu.model import Model

MOVED = 1e-3  # of the largest step of the path: smaller ones say nothing about a slope
CONTINUOUS = "continuous"  # rate of the blocks that count with their static gain


def sector(path: Array, *chain: Graph | Model, h: float) -> tuple[float, float]:
    """Return the least and the largest local slope of units in series along a path.

    Parameters
    ----------
    path : array, shape (n,)
        Input of the first unit, one value per step.
    *chain : Graph or Model
        Units in series, for example the inverse and the plant.  The first input of each is driven, the others keep
        their start values; its first output counts.  Linear dynamics count with their static gain.
    h : float
        Step (s).

    Returns
    -------
    least, largest : float
        Slopes of the last output over the path.

    Raises
    ------
    InputError
        The path does not move.
    """
    graphs = [without_dynamics(unit.graph if isinstance(unit, Model) else unit) for unit in chain]
    return slopes_along(path, *graphs, h=h)


def slopes_along(path: Array, *chain: Graph, h: float) -> tuple[float, float]:
    """Return the sector of units in series whose dynamics, if any, count as they are; see `sector`."""
    v = np.asarray(path, float)
    y = v
    for graph in chain:
        sizes = [p.size for p in graph.ports if p.kind == "input"]
        rows = np.tile(np.repeat([i.start for i in graph.inputs], sizes), (len(y), 1))
        rows[:, 0] = y
        y = graph.executor().run(rows, graph.n_outputs, h)[:, 0]
    dv, dy = np.diff(v), np.diff(y)
    largest = np.abs(dv).max(initial=0.0)
    if not largest > 0:
        raise InputError("The path must move to have slopes. Got a constant one.")
    moved = np.abs(dv) > MOVED * largest
    found = dy[moved] / dv[moved]
    return float(found.min()), float(found.max())


def without_dynamics(graph: Graph) -> Graph:
    """Replace the linear dynamics of a graph by their static gains."""
    for n in graph.nodes:
        if n.block.rate == CONTINUOUS:
            graph = graph.replace(Node(n.name, "scaling", {"n": 1}, {"gain": gain_of(n)}))
    return graph


def gain_of(node: Node) -> float:
    """Return the gain that stands for a linear block: the static one, or 1 where that is 0 or infinite.

    An integrator and a block that holds no output have none; their gain stays with the dynamics.
    """
    gain = static_gain(node)
    return gain if np.isfinite(gain) and gain != 0 else 1.0


def static_gain(node: Node) -> float:
    """Return the gain of a linear block at rest, D - C A^-1 B; infinite for an integrator."""
    A, B, C, D = linearise(Graph.single(node))
    if not len(A):
        return float(D[0, 0])
    try:
        return float((D - C @ np.linalg.solve(A, B))[0, 0])
    except np.linalg.LinAlgError:
        return np.inf
