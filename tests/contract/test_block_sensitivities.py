"""Sensitivities of every block by its parameters, start states and inputs, against differences of whole runs."""

from __future__ import annotations

import numpy as np
from excitation import STEP, every_block, perturbed, rows, some

from hystfmu.base.errors import InputError
from hystfmu.core.executor import SEED, Executor
from hystfmu.core.library import block_types
from hystfmu.graph import Graph, Input, Node, Output

ROWS = 60
STEPPED = {"in_range"}  # the output is 0 or 1: no derivative differs from 0


def behind_scaling(n: Node) -> Graph:
    """The node behind a gain and an offset for each of its inputs, with all its outputs."""
    inputs, outputs = (
        [f"b.{v.name}" + (f"[{k + 1}]" if n.sizes[v.name] > 1 else "") for v in rows for k in range(n.sizes[v.name])]
        for rows in (n.block.of("input"), n.block.of("output"))
    )
    sources = [Node(f"a{k}", "scaling", {"n": 1}) for k in range(max(len(inputs), 1))]
    return Graph(
        [*sources, n],
        [(f"{source.name}.y", end) for source, end in zip(sources, inputs, strict=False)],
        [Input(f"u{k}", (f"{source.name}.u",)) for k, source in enumerate(sources)],
        [Output(f"y{k}", end) for k, end in enumerate(outputs)],
    )


def differences(x: Executor, u: np.ndarray, n_y: int, place: int, size: float) -> list[np.ndarray]:
    """One-sided differences of the run by moving a parameter up and down; twice the same at a limit, 0 between two."""
    value, y, found = x.get(place), x.run(u, n_y, STEP), []
    for s in (size, -size):
        try:
            x.set(place, value + s)
            found.append((x.run(u, n_y, STEP) - y) / s)
        except InputError:
            pass
        x.set(place, value)
    return (2 * (found or [np.zeros_like(y)]))[:2]


@every_block
def test_sensitivities_are_the_derivatives_of_the_run(name: str) -> None:
    """A column for each element of a parameter, then all in one, where two sides show that there is no kink."""
    block, compared = block_types()[name], 0
    real = {v.name for v in block.parameters if v.type == "real"}
    for n in [perturbed(n, real) for n in some(block) if not block.trial][:4]:
        graph = behind_scaling(n)
        x, n_y = Executor(graph.to_bytes()), graph.n_outputs
        u = rows(block, dict(n.dims), ROWS)
        u = u if u.shape[1] else np.zeros((ROWS, 1))
        free = [p for p in graph.ports if p.is_parameter and p.var.type == "real"]
        free = [p for p in free if graph.nodes[p.node].name == "b" or p.var.name in ("gain", "offset")]
        places = [k for p in free for k in range(p.reference, p.reference + min(p.size, 3))]
        sizes = np.array([0.3 * abs(x.get(k)) or 0.3 for k in places])
        seeds = np.array([(k, i, s) for i, (k, s) in enumerate(zip(places, sizes, strict=True))], dtype=SEED)
        y, dy = x.sensitivities(u, n_y, STEP, seeds)
        assert y.tobytes() == x.run(u, n_y, STEP).tobytes()
        both = [differences(x, u, n_y, k, 1e-6 * s) for k, s in zip(places, sizes, strict=True)]
        above, below = (np.stack(side, axis=2) * sizes for side in zip(*both, strict=True))
        central = (above + below) / 2
        scale = np.abs(central).max(axis=(0, 1)) + 1e-3 * np.abs(y).max()
        smooth = np.abs(above - below) <= 1e-4 * scale
        assert np.mean(smooth) > 0.8
        assert np.quantile((np.abs(dy - central) / scale)[smooth], 0.98) < 2e-5, n.values
        compared += int(np.count_nonzero(central[smooth]))
        seeds["column"] = 0
        _, total = x.sensitivities(u, n_y, STEP, seeds)
        wrong = np.abs(total[..., 0] - dy.sum(axis=2)) / scale.sum()
        assert np.quantile(wrong[smooth.all(axis=2)], 0.98) < 2e-5, n.values
    assert compared or block.trial or name in STEPPED
