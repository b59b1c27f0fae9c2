"""The expanded input space (x, z), z the output of a Prandtl-Ishlinskii model fitted to the data, and a network on it.

Zhao & Tan 2008 and Shen & Ma 2017 pair the input with an operator of a given shape; any sum of plays is such an operator
with another branch, so the one nearest to the data is taken, by non-negative least squares, and the network bends it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node
from hystfmu.identify import prandtl_ishlinskii, readout
from hystfmu.identify.options import Option
from hystfmu.identify.readout import Features, fit_readout

OPTIONS = (
    Option("N", 40, 1, 100000, text="number of plays"),
    Option("u0", None, -1e300, 1e300, text="initial memory: every play rests at this input; default the first input"),
    *readout.options(hidden=12, starts=3, iterations=150),
)


def build(data: Dataset, options: Mapping[str, Any], seed: int, progress: Callable[[float], None]) -> tuple[Graph, int]:
    """The graph ``(u, prandtl_ishlinskii) -> scaling -> mlp -> scaling`` and the number of its parameters."""
    chosen = {"N": options["N"], "w0_min": 0.0, "u0": options["u0"]}
    fitted, weights = prandtl_ishlinskii.build(data, chosen, seed, lambda f: progress(0.2 * f))
    nodes = [Node("input", "scaling", {"n": 1}), fitted.node("hysteresis")]
    front = Features(
        nodes, [("input.y", "hysteresis.u")], ["input.u"], ["input.y", "hysteresis.y"], data
    )
    graph, parameters, _ = fit_readout(front, data, options, seed, lambda f: progress(0.2 + 0.8 * f))
    return graph, parameters + weights - 1  # the offset of the fitted model is the network's
