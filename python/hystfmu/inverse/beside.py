"""Blocks that covariates drive, in parallel with the chain of a model, and inverses of sums and products that they
enter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Node

ENTERED = ("sum", "product")


@dataclass(frozen=True)
class Inverted:
    """Inverse of a block, whose first input is the output of the block, and the wires into its other inputs."""

    node: Node
    wires: list[tuple[str, str]]


def driven_beside(g: Graph) -> set[str]:
    """Return the names of the blocks that do not depend on the first input; none without covariates."""
    if len(g.inputs) == 1:
        return set()
    reached: set[str] = set()
    new = {end.split(".")[0] for end in g.inputs[0].to}
    while new:
        reached |= new
        new = {b.split(".")[0] for a, b in g.wires if a.split(".")[0] in new} - reached
    return {n.name for n in g.nodes} - reached


def takes_beside(g: Graph, n: Node, alone: set[str]) -> bool:
    """Return whether a block is a sum or product of the chain and of parallel signals."""
    return n.type in ENTERED and any(a.split(".")[0] in alone and b.split(".")[0] == n.name for a, b in g.wires)


def inverted_beside(g: Graph, n: Node, alone: set[str]) -> Inverted | None:
    """Solve a sum or a product for the input that the chain drives; None for another block.

    Raises
    ------
    InputError
        A weight of 0, or a factor that may be 0.
    """
    if not takes_beside(g, n, alone):
        return None
    size = n.sizes["u"]
    drives = {b: a for a, b in g.wires}
    ends = [drives.get(f"{n.name}.u[{k + 1}]") for k in range(size)]
    (own,) = (k for k, a in enumerate(ends) if a is not None and a.split(".")[0] not in alone)
    others = [k for k in range(size) if k != own]
    if n.type == "sum":
        weights = n.value("k")
        if weights[own] == 0:
            raise InputError(f"The weight of {ends[own]} in {n.name} must not be 0 for an inverse. Got 0.")
        own_weight, offset = float(weights[own]), float(n.value("offset")[0])
        solved = np.concatenate([[1.0], -weights[others]]) / own_weight
        node = Node(n.name, n.type, {"n": size}, {"k": solved, "offset": -offset / own_weight})
    else:
        factors = n.dims["n"]
        if own >= factors or n.dims["m"] > 0:
            raise InputError(f"The block {n.name!r} must have factors only for an inverse. Got a divisor.")
        for k in others:
            _refuse_zero(g, ends[k], n)
        node = Node(n.name, n.type, {"n": 1, "m": size - 1}, {"least": n.value("least")})
    wires = [(a, f"{n.name}.u[{i}]") for i, k in enumerate(others, 2) if (a := ends[k]) is not None]
    return Inverted(node, wires)


def _refuse_zero(g: Graph, end: str | None, n: Node) -> None:
    """Raise unless a factor is a sum of limited covariates that keeps its sign."""
    factor = None if end is None else g.node(end.split(".")[0])
    drives = {b: a for a, b in g.wires}
    limited = None if factor is None else drives.get(f"{factor.name}.u")
    scaling = None if limited is None else g.node(limited.split(".")[0])
    if factor is not None and factor.type == "sum" and scaling is not None and scaling.type == "scaling":
        at = [scaling.value(e) * scaling.value("gain") + scaling.value("offset") for e in ("lo", "hi")]
        reach = [factor.value("k") * a for a in at]
        offset = float(factor.value("offset")[0])
        low, high = (offset + float(pick(*reach).sum()) for pick in (np.minimum, np.maximum))
        if low > 0 or high < 0:
            return
        got = f"one from {low:.3g} to {high:.3g}"
    else:
        got = "one without limits"
    raise InputError(f"The factor {end} of {n.name} must keep its sign for an inverse. Got {got}.")
