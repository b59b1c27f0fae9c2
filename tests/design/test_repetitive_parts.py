"""Repetitive parts: filters against closed forms and against the block in a loop, responses against spectra."""

import numpy as np
import pytest

from hystfmu import Graph, Input, InputError, Node, Output, Unit
from hystfmu.design import repetitive_filters
from hystfmu.design.delays import sampled
from hystfmu.design.linear import python_control
from hystfmu.design.loop import response_of
from hystfmu.design.repetitive import cut_memories

H = 1e-3
G = 0.8


def loop_of(gain: float, steps: int = 2) -> object:
    """Open loop L = T / (1 - T) of T = gain z^-steps."""
    a = np.zeros(steps + 1)
    a[0], a[-1] = 1.0, -gain
    return python_control().tf([gain], a, H)


def test_filter_of_a_delay_undoes_it_and_leaves_one_minus_gain() -> None:
    found = repetitive_filters([loop_of(G)], 150.0, gain=0.4, n_q=9, n_l=40)
    both = np.concatenate([found.q[:0:-1], found.q])
    assert both.sum() == pytest.approx(1.0, abs=1e-12)
    expected = np.zeros(81)
    expected[40 + 2 - 9 : 40 + 2 + 10] = 0.4 / G * both  # two steps ahead
    assert found.l == pytest.approx(expected, abs=1e-12)
    w = np.linspace(0.0, np.pi, 20001)
    Q = found.q[0] + 2 * np.cos(np.outer(w, np.arange(1, 10))) @ found.q[1:]
    assert found.contraction == pytest.approx([0.6 * np.abs(Q).max()], rel=1e-4)


def test_several_loops_share_the_filter_of_least_squares() -> None:
    """T_i = g_i z^-2: L = gain Q z^2 sum g / sum g^2, and 1 - gain g_i sum g / sum g^2 is left of Q."""
    g = np.array([0.5, 1.0])
    found = repetitive_filters([loop_of(v) for v in g], 150.0, gain=0.4)
    share = 1 - 0.4 * g * g.sum() / (g @ g)
    assert found.contraction == pytest.approx(share * found.contraction[0] / share[0], rel=1e-9)
    assert found.contraction[0] == pytest.approx(share[0], rel=0.02)  # max abs(Q) is 1 but for its ripple


def test_error_ratio_is_that_of_the_block_in_the_loop() -> None:
    n, f = 25, 31.0
    found = repetitive_filters([loop_of(G)], 150.0, gain=0.4, n_q=4, n_l=12)
    unit = Unit(Graph.single(Node("b", "repetitive", {"n": n, "n_q": 4, "n_l": 12}, {"q": found.q, "l": found.l})))
    unit.initialize(0.0, y_d=0.0, y=0.0, active=1.0)
    r, given, error = np.sin(2 * np.pi * f * H * np.arange(4000)), [0.0, 0.0], []
    for k, r_k in enumerate(r):
        y = G * given[-2]
        error.append(r_k - y)
        unit.set("y_d", r_k), unit.set("y", y)
        unit.do_step(k * H, H)
        given.append(unit.get("r"))
    without = np.abs(1 - G * np.exp(-2j * np.pi * f * H * 2))
    amplitude = np.sqrt(2 * np.mean(np.square(error[2000:])))  # a whole number of cycles
    assert found.error_ratio(loop_of(G), np.array([2 * np.pi * f]), n)[0] == pytest.approx(
        amplitude / without, rel=1e-6
    )


@pytest.mark.parametrize(("loops", "cutoff", "words"), [([], 100.0, "at least one"), ([loop_of(G)], 600.0, "cutoff")])
def test_no_loop_and_a_cutoff_too_high_are_refused(loops: list[object], cutoff: float, words: str) -> None:
    with pytest.raises(InputError, match=words):
        repetitive_filters(loops, cutoff)


# ---- response of a controller ----------------------------------------------------------------------------------------
N = 12
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
