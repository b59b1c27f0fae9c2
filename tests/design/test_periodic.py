"""The response of a controller with a repetitive part against the spectrum of its simulated impulse response."""

from __future__ import annotations

import numpy as np
import pytest

from hystfmu.design import sampled
from hystfmu.design.loop import response_of
from hystfmu.design.repetitive import cut_memories
from hystfmu.graph import Graph, Input, Node, Output

H, N = 1e-3, 12
FILTERS = {"q": [0.3, 0.2, 0.1], "l": [0.05, 0.1, 0.2, 0.4, -0.1]}


def controller(parts: int = 1) -> Graph:
    """Repetitive part, then a PD controller; `held` lets its own output act on the measurement."""
    nodes = [Node(f"r{k}", "repetitive", {"n": N, "n_q": 2, "n_l": 2}, FILTERS) for k in range(parts)]
    nodes += [Node("pid", "pid", {}, {"Kp": 0.7, "Kd": 1e-3, "tau": 2e-3}), Node("held", "delay")]
    nodes = [nodes[-1], Node("measured", "sum", {"n": 2}, {"k": [1.0, 0.2]}), *nodes[:-1]]
    wires = [("r0.r", "pid.y_d"), ("pid.u", "held.u"), ("held.y", "measured.u[2]"), ("measured.y", "pid.y")]
    wires += [("measured.y", f"r{k}.y") for k in range(parts)]
    ends = [Input("y", ("measured.u[1]",)), Input("active", tuple(f"r{k}.active" for k in range(parts)), start=1.0)]
    return Graph(nodes, wires, [*ends, Input("y_d", ("r0.y_d",))], [Output("u", "pid.u")], sort=False)


def test_response_is_the_spectrum_of_the_impulse_response() -> None:
    graph = controller()
    rows = np.zeros((4000, 3))
    rows[:, 1] = 1.0
    rows[5, 0] = 1.0
    u = graph.run(rows, H)[5:]
    assert np.abs(u[-100:]).max() < 1e-12 < np.abs(u[N : 3 * N]).max()
    angles = np.linspace(0.01, np.pi, 37)
    z = np.exp(1j * angles)
    inner, (part,) = cut_memories(graph)
    A, B, C, D = sampled(inner, H)
    places = [i.name for i in inner.inputs].index("y"), [i.name for i in inner.inputs].index("r0_w")
    K, R = response_of((A, B[:, places], C, D[:, places]), z), part.response(angles)
    closed = K[:, 0, 0] + K[:, 0, 1] * R * K[:, 1, 0] / (1 - K[:, 1, 1] * R)
    assert closed == pytest.approx(u @ z[None] ** -np.arange(len(u))[:, None], abs=1e-7)


def test_a_graph_without_the_block_stays_and_one_with_two_has_two_memories() -> None:
    plain = Graph.single(Node("pid", "pid"))
    assert cut_memories(plain) == (plain, ())
    assert len(cut_memories(controller(2))[1]) == 2
