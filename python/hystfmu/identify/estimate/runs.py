"""Simulations of a graph for given parameter values: the output and its derivatives with respect to parameters."""

from collections.abc import Mapping, Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import ArrayLike

from hystfmu.base import Array, Indices, InputError
from hystfmu.core.executor import SEED, Executor
from hystfmu.graph import Graph

Values = Mapping[str, ArrayLike]
"""Parameter values by the names ``node.parameter``. A value is a number or an array with all elements."""
DIFFERENCE = 1e-6  # finite difference for blocks without sensitivities, relative to the given change


class Runs:
    """A graph with one output, loaded into the C core. Values that the core refuses raise an InputError."""

    def __init__(self, graph: Graph) -> None:
        self._executor = Executor(graph.to_bytes())
        self._ports = {
            f"{graph.nodes[p.node].name}.{p.var.name}": (p.node, p.reference, p.size)
            for p in graph.ports
            if p.is_parameter
        }
        self._last: dict[str, Array] = {}
        self._implicit = any(node.block.trial for node in graph.nodes)

    def put(self, values: Values) -> None:
        """Set parameter values."""
        for name, given in values.items():
            if np.array_equal(given, self._last.get(name, ())):
                continue
            _, reference, size = self._ports[name]
            self._last.pop(name, None)
            for k, value in enumerate(np.broadcast_to(np.ravel(given), (size,)).tolist(), reference):
                self._executor.set(k, value)
            self._last[name] = np.array(given)

    def run(self, inputs: Array, h: float) -> Array:
        """Return the output (n,) for the inputs (n, n_inputs) with the step h (s), from the initial state."""
        return self._executor.run(inputs, 1, h)[:, 0]

    def sensitivities(
        self,
        inputs: Array,
        h: float,
        changes: Sequence[Mapping[str, Array]],
        rows: Indices,
        step: float = DIFFERENCE,
    ) -> tuple[Array, Array]:
        """Return the output (k,) and its derivatives (k, changes) on the rows `rows` (k,), in rising order.

        Each element of `changes` is a direction: a change for each element of some parameters. An empty direction has
        the derivative 0. For blocks without sensitivities, the derivatives are finite differences. Their step is `step`
        times the change, and `step` should be 1 for linear parameters.
        """
        if self._implicit:
            return self._differences(inputs, h, changes, rows, step)
        found: list[tuple[int, bool, int, list[tuple[int, int, float]]]] = []
        for column, change in enumerate(changes):
            seeds = [
                (node, reference + int(k), float(sizes[k]))
                for name, sizes in change.items()
                for node, reference, _ in (self._ports[name],)
                for k in np.flatnonzero(sizes)
            ]
            if seeds:
                found.append((min(seeds)[0], len(seeds) == 1, column, sorted(seeds)))
        found.sort(key=lambda one: one[:3])
        listed = [(reference, k, size) for k, one in enumerate(found) for _, reference, size in one[3]]
        y, dy = self._executor.sensitivities(inputs, 1, h, np.array(listed, dtype=SEED), rows, step)
        order = [one[2] for one in found]
        if order == list(range(len(changes))):
            return y[:, 0], dy[:, 0]
        whole = np.zeros((len(y), len(changes)))
        whole[:, order] = dy[:, 0]
        return y[:, 0], whole

    def _differences(
        self, inputs: Array, h: float, changes: Sequence[Mapping[str, Array]], rows: Indices, step: float
    ) -> tuple[Array, Array]:
        """Return the output and its derivatives by finite differences of whole simulations.

        This is needed for graphs with an implicit inverse, for which the core has no sensitivities.
        """
        y, before = self.run(inputs, h)[rows], dict(self._last)
        dy = np.zeros((len(y), len(changes)))
        for column, change in enumerate(changes):
            for part in (step, -step):
                with suppress(InputError):
                    self.put(
                        {
                            name: before[name] + part * np.reshape(x, np.shape(before[name]))
                            for name, x in change.items()
                        }
                    )
                    dy[:, column] = (self.run(inputs, h)[rows] - y) / part
                    break
            self.put(before)
        return y, dy
