"""State-space models of sampled graphs: exact linearisation of one step at rest, with delays as states.

The core stores all values that change during a run in one vector. Each column of the matrices A, B, C and D is a
difference quotient of one step, for a small change of one element of this vector or of one input at rest. At rest all
values of a controller are zero. Therefore the differences lose no digits, and a small change stays in the linear range
of a switching term. A hysteresis has no tangent at rest, so the caller must replace the hysteresis by a gain.

In discrete form, a delay of n steps has exactly n states. In continuous form, a delay has no finite order, so a Pade
approximant can replace the delay.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from hystfmu.base import Array, InputError, Mask
from hystfmu.graph import Graph, Input, Node, Output

DELAY, WEIGHTS = "delay", "polynomial_narx"
StateSpace = tuple[Array, Array, Array, Array]


@dataclass(frozen=True)
class Cut:
    """A graph without its delays.

    The last inputs of this graph are the outputs of the removed delays. The last outputs are the inputs of the delays.
    """

    graph: Graph
    steps: tuple[int, ...]


def cut(graph: Graph, sort: bool = True) -> Cut:
    """Cut the delays out of a graph. Two gains of 1 replace each delay.

    The first gain drives an additional output. An additional input drives the second gain. If `sort` is True, the
    blocks are sorted again, which a continuous graph requires. If it is False, the order of the blocks does not change,
    as a sampled graph requires.
    """
    graph = unfolded(graph, sort)
    delays = [n for n in graph.nodes if n.type == DELAY]
    if not delays:
        return Cut(graph, ())
    names = {n.name for n in delays}
    after = {n.name: f"{n.name}_after" for n in delays}
    nodes: list[Node] = []
    for n in graph.nodes:
        nodes += [n] if n.name not in names else [Node(name, "scaling", {"n": 1}) for name in (n.name, after[n.name])]

    def behind(end: str) -> str:
        name, _, port = end.partition(".")
        return f"{after[name]}.{port}" if name in names else end

    late = [Input(f"{n.name}_in", (f"{after[n.name]}.u",), start=float(n.value("y0")[0])) for n in delays]
    taken = [Output(f"{n.name}_out", f"{n.name}.y") for n in delays]
    outputs = [Output(o.name, behind(o.source), o.unit, o.text) for o in graph.outputs]
    wires = [(behind(a), b) for a, b in graph.wires]
    opened = Graph(nodes, wires, [*graph.inputs, *late], [*outputs, *taken], sort=sort, step=graph.step)
    return Cut(opened, tuple(n.dims["n"] for n in delays))


def is_fir(node: Node) -> bool:
    """Return whether a block is an FIR filter: a `polynomial_narx` of degree 1 that depends only on its input."""
    return node.type == WEIGHTS and node.dims["q"] == 1 and not (node.dims["n_f"] or node.dims["n_y"])


def unfolded(graph: Graph, sort: bool = True) -> Graph:
    """Return a graph in which one-step delays and a sum replace each FIR filter. For `sort` see `cut`."""
    nodes: list[Node] = []
    wires, own, to = list(graph.wires), list[tuple[str, str]](), dict[str, str]()
    for n in graph.nodes:
        if not is_fir(n):
            nodes.append(n)
            continue
        count, theta = n.dims["n_u"], n.value("theta")
        line = [Node(f"{n.name}_0", "scaling", {"n": 1})]
        past = {"y0": _at_start(graph, f"{n.name}.u", sort)}
        line += [Node(f"{n.name}_{i}", DELAY, {"n": 1}, past) for i in range(1, count + n.dims["n_k"])]
        nodes += [*line, Node(n.name, "sum", {"n": count}, {"k": theta[:-1], "offset": theta[-1]})]
        wires += [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(line)]
        to[f"{n.name}.u"] = f"{n.name}_0.u"
        taps = [f"{part.name}.y" for part in line[n.dims["n_k"] :]]
        ends = [f"{n.name}.u"] if count == 1 else [f"{n.name}.u[{i}]" for i in range(1, count + 1)]
        own += zip(taps, ends, strict=True)
    if not to:
        return graph
    wires = [*((a, to.get(b, b)) for a, b in wires), *own]
    inputs = [replace(i, to=tuple(to.get(end, end) for end in i.to)) for i in graph.inputs]
    return Graph(nodes, wires, inputs, graph.outputs, sort=sort, step=graph.step)


def _at_start(graph: Graph, end: str, sort: bool) -> float:
    """Return the value of an input of a block when the inputs of the graph have their start values."""
    for i in graph.inputs:
        if end in i.to:
            return float(i.start)
    source = next(a for a, b in graph.wires if b == end)
    first = np.array([[i.start for i in graph.inputs]])
    return float(Graph(graph.nodes, graph.wires, graph.inputs, [Output("v", source)], sort=sort).run(first).item())


def close(system: StateSpace, line: StateSpace) -> StateSpace:
    """Return `system` with `line` as feedback from the last outputs of `system` to its last inputs.

    Each argument is (A, B, C, D), for example a cut graph and its delays. With direct feed-through, the algebraic loop
    must be solvable. In the returned state space, the states of `system` precede the states of `line`.
    """
    A, B, C, D = system
    F, G, H, K = line
    q = len(K)
    m, p = B.shape[1] - q, C.shape[0] - q
    B1, B2, C1, C2 = B[:, :m], B[:, m:], C[:p], C[p:]
    D11, D12, D21, D22 = D[:p, :m], D[:p, m:], D[p:, :m], D[p:, m:]
    # w = H z + K v, v = C2 x + D21 u + D22 w
    solve = np.linalg.inv(np.eye(q) - K @ D22)
    from_x, from_z, from_u = solve @ K @ C2, solve @ H, solve @ K @ D21
    v_x, v_z, v_u = C2 + D22 @ from_x, D22 @ from_z, D21 + D22 @ from_u
    states = np.block([[A + B2 @ from_x, B2 @ from_z], [G @ v_x, F + G @ v_z]])
    inputs = np.vstack([B1 + B2 @ from_u, G @ v_u])
    return states, inputs, np.hstack([C1 + D12 @ from_x, D12 @ from_z]), D11 + D12 @ from_u


def shift_registers(steps: tuple[int, ...]) -> StateSpace:
    """Return parallel delays by whole numbers of steps. A delay of n steps has n states and is exact."""
    return _side_by_side([_register(n) for n in steps])


def _register(n: int) -> StateSpace:
    take, give = np.zeros((n, 1)), np.zeros((1, n))
    take[0], give[0, -1] = 1, 1
    return np.eye(n, k=-1), take, give, np.zeros((1, 1))


def pade(seconds: list[float], order: int, control: Any) -> StateSpace:
    """Return parallel Pade approximants of the delays `seconds` (s), with `order` states each."""
    parts = [control.ss(control.tf(*control.pade(T, order))) for T in seconds]
    return _side_by_side([(p.A, p.B, p.C, p.D) for p in parts])


def _side_by_side(parts: Sequence[StateSpace]) -> StateSpace:
    # imported here, because the import is slow and a process for a foreign FMU does not need it
    from scipy.linalg import block_diag

    A, B, C, D = (block_diag(*matrices) for matrices in zip(*parts, strict=True))
    return A, B, C, D


SMALL = 1e-12  # size of the change of a state or input in the differences
KINDS = ("input", "output")
SETTLED = 3  # number of steps at rest before the differences, after which the start-up of filters is over
GROWN = 1e6 * SMALL  # largest output for which the response still counts as small
# number of steps, and largest allowed relative difference, of the comparison with a simulation of the graph
CHECKED, SAME = 40, 1e-4


def sampled(graph: Graph, h: float) -> StateSpace:
    """Linearise one step h (s) of a graph at rest with all inputs zero. Delays become states.

    Parameters
    ----------
    graph : Graph
        Graph of controllers, observers, filters and delays.
    h : float
        Step (s).

    Returns
    -------
    A, B, C, D : array, shapes (n, n), (n, m), (p, n), (p, m)
        State space x[k] = A x[k-1] + B u[k], y[k] = C x[k-1] + D u[k]. The output y[k] depends on the input u[k] of the
        same step.

    Raises
    ------
    InputError
        The graph is not linear at rest.
    """
    opened = cut(graph, sort=False)
    system = trimmed(_differences(opened.graph, h))
    if opened.steps:
        system = close(system, shift_registers(opened.steps))
    _check(graph, h, system)
    return system


def _differences(graph: Graph, h: float) -> StateSpace:
    executor = graph.executor()
    inputs, outputs = (
        [p.reference + k for p in graph.ports if p.kind == kind for k in range(p.size)] for kind in KINDS
    )
    for reference in inputs:
        executor.set(reference, 0.0)
    executor.start(0.0)
    for k in range(SETTLED):
        executor.step((k + 1) * h, h)
    rest = executor.state
    n, m = len(rest), len(inputs)

    def step(x: Array, u: Array) -> Array:
        executor.state = rest + x
        for reference, value in zip(inputs, u.tolist(), strict=True):
            executor.set(reference, value)
        executor.step((SETTLED + 1) * h, h)
        return np.concatenate([executor.state, [executor.get(r) for r in outputs]])

    def column(k: int) -> Array:
        away = np.zeros(n + m)
        away[k] = SMALL
        up, down = (step(s * away[:n], s * away[n:]) for s in (1, -1))
        return np.asarray((up - down) / (2 * SMALL))

    T = np.column_stack([column(k) for k in range(n + m)])
    return T[:n, :n], T[:n, n:], T[n:, :n], T[n:, n:]


def trimmed(system: StateSpace) -> StateSpace:
    """Return a state space without uncontrollable and unobservable states, such as stored parameters and times."""
    A, B, C, D = system
    moved = _closure(A != 0, (B != 0).any(axis=1))
    shown = _closure((A != 0).T, (C != 0).any(axis=0))
    keep = np.flatnonzero(moved & shown)
    return A[np.ix_(keep, keep)], B[keep], C[:, keep], D


def _closure(edges: Mask, first: Mask) -> Mask:
    found = first.copy()
    while True:
        more = found | (edges[:, found].any(axis=1) if found.any() else found)
        if (more == found).all():
            return found
        found = more


def _check(graph: Graph, h: float, system: StateSpace) -> None:
    """Raise an InputError if a graph and its linearisation `system` respond differently to small signals."""
    A, B, C, D = system
    m, p = B.shape[1], C.shape[0]
    u = np.zeros((CHECKED, m))
    u[2:] = SMALL * np.random.default_rng(0).choice([-1.0, 1.0], (CHECKED - 2, m))
    at_rest = graph.executor().run(np.zeros((CHECKED, m)), p, h)
    moved = graph.executor().run(u, p, h) - at_rest
    x, said = np.zeros(len(A)), np.empty((CHECKED, p))
    for k in range(CHECKED):
        said[k] = C @ x + D @ u[k]
        x = A @ x + B @ u[k]
    # the response of an unstable graph grows until it reaches the limits of the blocks
    small = np.maximum.accumulate(np.abs(said).max(axis=1)) <= GROWN
    said, moved = said[small], moved[small]
    size = float(np.abs(said).max())
    if not (np.isfinite(moved).all() and np.abs(moved - said).max() <= SAME * size + 1e-3 * SMALL * (size == 0)):
        names = ", ".join(dict.fromkeys(n.type for n in graph.nodes))
        raise InputError(f"The blocks must be linear at rest to have margins. Got {names}, which are not.")
