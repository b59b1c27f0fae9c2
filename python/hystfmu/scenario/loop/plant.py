"""The plant of a loop: units in series, their linear dynamics, and the incremental gain of inverse and plant.

The incremental gain represents all parts with memory, including dynamics that the inverse compensates, such as creep.

The function `held` discretises the dynamics for a delayed command that is constant or a ramp in each step.
"""

import functools
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.core.library import block_types
from hystfmu.design.delays import StateSpace, is_fir
from hystfmu.design.linear import NO_STATES, in_series, linearise
from hystfmu.design.sector import CONTINUOUS, gain_of, slopes_along, without_filters
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.system import Link, Part, System, behind

TINY = 1e-9  # a fraction of a step below this value counts as 0


def ramp_of(dynamics: Sequence[Node], step: float) -> float:
    """Return the ramp time of a new command for dynamics in series (s).

    The ramp time is the step of the dynamics if their command changes on a ramp, otherwise 0.
    """
    if not dynamics:
        return 0.0
    first = dynamics[0]
    chosen = any(v.name == "hold" for v in first.block.parameters)
    ramps = first.value("hold")[0] == 1 if chosen else first.block.hold == "foh"
    return step if ramps else 0.0


def held(plant: StateSpace, h: float, delay: float, ramp: float = 0.0) -> StateSpace:
    """Discretise dynamics exactly for a command that is constant over each step h (s) and delayed by `delay` steps.

    Source: Astrom & Wittenmark, Computer-Controlled Systems, 3rd ed., section 2.3, for a command that jumps.

    Parameters
    ----------
    plant : (A, B, C, D), shapes (n, n), (n, 1), (1, n), (1, 1)
        Plant with one input and one output. The time is in s. A plant without states is a gain D.
    h : float
        Step (s).
    delay : float
        Delay in steps, which may be a fraction.
    ramp : float
        Time (s), at most h, in which the command changes linearly from its last value to the new value.

    Returns
    -------
    (A, B, C, D), shapes (n + q, n + q), (n + q, 1), (1, n + q), (1, 1)
        The states are the states of the plant, then the q delayed commands. If the plant has direct feed-through, its
        output uses the command at the end of a step. This is a past command, because the controller computes the next
        command from this output.

    Raises
    ------
    InputError
        The response overflows within a step.
    """
    return _held(tuple((m.shape, np.ascontiguousarray(m).tobytes()) for m in plant), h, delay, ramp)


@functools.lru_cache(maxsize=256)
def _held(content: tuple[tuple[tuple[int, ...], bytes], ...], h: float, delay: float, ramp: float) -> StateSpace:
    A, B, C, D = (np.frombuffer(data).reshape(shape) for shape, data in content)
    whole = int(np.floor(delay + TINY))
    part = delay - whole if delay - whole > TINY else 0.0
    # effect of u(k - whole), u(k - whole - 1) and u(k - whole - 2) on the states, and their weights at the end of the
    # step
    free, weights, end = np.eye(len(A)), np.zeros((len(A), 3)), np.zeros(3)
    for length, first, last in _lines(part, ramp / h):
        through, jump, line = _over(A, B, length * h)
        free, weights = through @ free, through @ weights + jump @ first[None] + line @ (last - first)[None]
        end = last if length > 0 else end
    through_now = D * end[None]
    n, used = len(A), np.flatnonzero(weights.any(0) | (np.arange(3) == 0))[-1]
    past = max(whole + int(used), whole + 1 + int(np.flatnonzero(through_now)[-1]) if D.any() else 0)
    M, N = np.zeros((n + past, n + past)), np.zeros((n + past, 1))
    M[:n, :n] = free
    for j, w in zip(range(whole, past + 1), weights.T, strict=False):  # weight of u(k - j)
        (N if j == 0 else M[:, n + j - 1 : n + j])[:n, 0] = w
    if not (np.isfinite(M).all() and np.isfinite(N).all()):
        raise InputError("The dynamics of the plant must stay finite over a step. Got some that overflow.")
    if past:
        N[n] = 1.0
        M[n + 1 :, n:-1] = np.eye(past - 1)
    out = np.hstack([C, np.zeros((1, past + 3))])
    out[:, n + whole : n + whole + 3] = through_now
    return M, N, out[:, : n + past], np.zeros((1, 1))


def _lines(part: float, ramp: float) -> Iterator[tuple[float, Array, Array]]:
    """Yield the straight lines of the command in a step: duration, and weights of three commands at both ends.

    A new command arrives after the fraction `part` of the step, and the ramp to it takes the fraction `ramp`. This ramp
    may end in the next step.
    """
    new, last, older = np.eye(3)
    over = max(part + ramp - 1, 0.0)  # the part of the previous ramp that is left at the start of the step
    risen = 1.0 - over / ramp if ramp else 1.0
    yield over, (1 - risen) * older + risen * last, last
    yield part - over, last, last
    risen = (min(part + ramp, 1.0) - part) / ramp if ramp else 1.0
    yield min(part + ramp, 1.0) - part, last, (1 - risen) * last + risen * new
    yield 1 - min(part + ramp, 1.0), new, new


def _over(A: Array, B: Array, t: float) -> tuple[Array, Array, Array]:
    """Return e^(A t), the effect of an input of 1, and the effect of an input from 0 to 1, all for the time t."""
    # imported here, because the import is slow and a process for a foreign FMU does not need it
    from scipy.linalg import expm

    n = len(A)
    if not t > 0:
        return np.eye(n), np.zeros((n, 1)), np.zeros((n, 1))
    chain = np.zeros((n + 2, n + 2))
    chain[:n, :n], chain[:n, n : n + 1], chain[n, n + 1] = A * t, B * t, 1.0
    with np.errstate(over="ignore", invalid="ignore"):  # the caller reports an overflow as an error
        M = expm(chain)
    return M[:n, :n], M[:n, n : n + 1], M[:n, n + 1 :]


MEMORY = ("operators", "inverses", "networks")  # families of the blocks that the incremental gain represents
DELAY, LEVELS = "delay", "quantiser"
LIMITS = ("u_min", "u_max", "lo", "hi")
OFFSET = ("scaling", "sum")


@dataclass(frozen=True)
class PlantSide:
    """Units at the rate of the plant, in series from the command to the measured output."""

    links: tuple[Link, ...]  # connection that drives each unit; the first one is the command
    delay: float  # delay of the command (steps) due to delay units and to the order

    @property
    def entry(self) -> Link:
        """Connection of the command."""
        return self.links[0]

    @property
    def units(self) -> tuple[int, ...]:
        """Indices of the units. The output of the last unit is the tracked output."""
        return tuple(n.to for n in self.links)


def plant_side(system: System, plant: int, around: Sequence[int]) -> PlantSide:
    """Return the units at the rate of the plant, which must be in series, and the delay of the command (steps)."""
    case, owner = system.case, {p.name: k for k, p in enumerate(system.parts)}
    within = {plant, *around}
    fine = {k for k in within if system.parts[k].period < case.ripple} | {plant}
    links: list[Link] = []
    k, name = plant, system.parts[plant].name
    while k in fine:
        into = [n for n in system.links if n.to == k and owner[system.maker(n).name] in within]
        if len(into) != 1 or len(links) == len(fine):
            raise InputError(
                f"{case.title}: One connection must close the loop at {name} to have margins. Got {len(into)}."
            )
        links.insert(0, into[0])
        k, name = owner[system.maker(into[0]).name], system.maker(into[0]).name
    if fine - {n.to for n in links}:
        raise InputError(f"{case.title}: The units at the rate of the plant must be in series. Got others.")
    late = sum(_delay(system, system.parts[to.to]) for to in links)
    # at one place in the loop, a value is used before its update, so it is one fine step old
    readers = [n for n in system.links if system.maker(n) is system.parts[plant] and n.to in within - fine]
    held = sum(not system.fresh(n) for n in links) + any(not system.fresh(n) for n in readers) - 1
    return PlantSide(tuple(links), (late + max(held, 0)) / case.ripple if case.ripple > 1 else float(late))


def _edges(graph: Graph) -> list[tuple[str, str]]:
    """Return the connections of a graph as pairs of the names of its nodes."""
    return [(a.partition(".")[0], b.partition(".")[0]) for a, b in graph.wires]


def _delay(system: System, part: Part) -> int:
    """Return the number of steps by which a unit delays its input.

    An InputError is raised if several delays are not in series, for example in a selection of delays.
    """
    delays = [n for n in part.own.nodes if n.type == DELAY]
    edges = _edges(part.own)
    for a, b in combinations([n.name for n in delays], 2):
        if b not in behind(edges, a) and a not in behind(edges, b):
            raise InputError(
                f"{system.case.title}: The delays of {part.name} must be in series to have margins. Got others."
            )
    return sum(n.dims["n"] for n in delays)


def has_memory(graph: Graph) -> bool:
    """Return whether a unit is an inverse or a hysteresis model, which the incremental gain represents."""
    return any(n.block.family in MEMORY and n.block.rate != CONTINUOUS for n in graph.nodes)


def lone_dynamics(system: System, side: PlantSide, between: Collection[int]) -> set[str]:
    """Return the types of the dynamics that an inverse compensates although the plant side does not have them.

    These dynamics act on the command like a controller. Trap: if they are included in the sector, its values are wrong.
    For example, an inverse with creep in front of a plant without creep seemed to have incremental gains from -6 to 10.
    """
    return _undone(system, between) - {n.type for link in side.links for n in system.parts[link.to].own.nodes}


def as_gain(part: Part, lone: Collection[str] = ()) -> Graph:
    """Return the graph of an inverse with a gain of 1 instead of the inverse hysteresis.

    Blocks that invert dynamics whose type is in `lone`, and the FIR filters of an inverse of dynamics, remain in the
    graph, scaled to a static gain of 1.
    """
    n = len(part.inputs)
    kept = [m for m in part.own.nodes if m.block.inverts in lone or is_fir(m)]
    k = float(np.prod([1 / m.value("theta")[:-1].sum() if is_fir(m) else _gain_undone(m) for m in kept]))
    kept = [m.with_values(theta=[*m.value("theta")[:-1], 0.0]) if is_fir(m) else m for m in kept]
    gain = Node("gain", "sum", {"n": n}, {"k": [k] + [0.0] * (n - 1)})
    nothing = Node("nothing", "scaling", {"n": 1}, {"gain": 0.0})
    ends = ["gain.u"] if n == 1 else [f"gain.u[{i + 1}]" for i in range(n)]
    chain = [gain, *kept]
    wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(chain)]
    outputs = [Output(name, "nothing.y" if i else f"{chain[-1].name}.y") for i, name in enumerate(part.outputs)]
    inputs = [Input(name, (end,)) for name, end in zip(part.inputs, ends, strict=True)]
    return Graph([*chain, nothing], [*wires, ("gain.y", "nothing.u")], inputs, outputs, sort=False)


def _gain_undone(node: Node) -> float:
    """Return the static gain of the dynamics that a block inverts."""
    return gain_of(Node(node.name, str(node.block.inverts), node.dims, node.values))


def for_small_signals(graph: Graph) -> Graph:
    """Return a graph without quantisers and constant offsets. A gain of 1 replaces each quantiser.

    The gain of 1 is valid for signals of many levels. Trap: with an offset of 50, the differences of the linearisation
    lose digits.
    """
    for n in graph.nodes:
        if n.type == LEVELS:
            graph = graph.replace(Node(n.name, "scaling", {"n": 1}))
        elif n.type in OFFSET:
            graph = graph.replace(replace(n, values={k: v for k, v in n.values.items() if k != "offset"}))
    return graph


def without_limits(graph: Graph) -> Graph:
    """Return a graph whose controllers and scalings have no limits.

    Small signals do not reach these limits, and a state of rest may be outside the limits.
    """
    for n in graph.nodes:
        if any(key in n.values for key in LIMITS):
            graph = graph.replace(replace(n, values={k: v for k, v in n.values.items() if k not in LIMITS}))
    return graph


def dynamics(system: System, side: PlantSide, between: Collection[int]) -> tuple[StateSpace, float]:
    """Return the linear dynamics of the plant side, and the ramp time of a new command (s).

    The dynamics are scaled to the static gain 1 if they have a static gain. If there are no dynamics, the result is a
    gain of 1. For dynamics in parallel with a hysteresis, such as creep, the slope of the hysteresis at rest is used.
    """
    undone = _undone(system, between)
    found: StateSpace = (*NO_STATES, np.ones((1, 1)))
    ramp: float | None = None
    for link in side.links:
        part = system.parts[link.to]
        graph = _driven(part, link.input, _output(system, link, side))
        way = [n for n in _on_the_way(graph) if n.type not in undone]
        if not way:
            continue
        if ramp is None:
            ramp = ramp_of(way, system.case.step * part.period / system.case.ripple / part.substeps)
        found = in_series(_with_gain_one(_in_parallel(graph, undone)) if _parallel(graph, way) else _chain(way), found)
    return found, ramp or 0.0


def _chain(way: Sequence[Node]) -> StateSpace:
    """Return the series connection of dynamics, scaled to a static gain of 1."""
    gain = Node("gain", "scaling", {"n": 1}, {"gain": 1 / float(np.prod([gain_of(n) for n in way]))})
    nodes = [gain, *(Node(f"part{i}", n.type, n.dims, n.values) for i, n in enumerate(way))]
    wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(nodes)]
    return linearise(Graph(nodes, wires, [Input("u", ("gain.u",))], [Output("y", f"{nodes[-1].name}.y")]))


def _in_parallel(graph: Graph, undone: Collection[str]) -> StateSpace:
    """Return the state space of a unit from its first input to its first output, with hysteresis linearised at rest."""
    passed = (DELAY, LEVELS)
    still = _gains(graph, lambda n: gain_of(n) if n.type in undone else 1.0 if n.type in passed else None)
    A, B, C, D = linearise(still)
    return A, B[:, :1], C[:1], D[:1, :1]


def _with_gain_one(system: StateSpace) -> StateSpace:
    """Return dynamics divided by their static gain, if they have one."""
    A, B, C, D = system
    gain = float((D - C @ np.linalg.solve(A, B))[0, 0]) if np.linalg.matrix_rank(A) == len(A) else 1.0
    return (A, B, C / gain, D / gain) if gain else system


def command_of(system: System, side: PlantSide, between: Sequence[int]) -> Link:
    """Return the connection of the command to the first inverse, or to the plant if there is no inverse."""
    return next((n for n in system.links if between and n.to == between[0] and n.input == 0), side.entry)


def slopes_of(system: System, side: PlantSide, between: Sequence[int]) -> tuple[float, float]:
    """Simulate the case, and return the sector of the incremental gain along its path. The run must not stop."""
    first = command_of(system, side, between)
    column = system.names[first.source]
    try:
        v = Native(system, [column]).run()[column][:: system.case.ripple]
    except Stopped as e:
        raise InputError(f"{system.case.title}: The case of a sector must run to its end. {e}") from None
    undone, lone = _undone(system, between), lone_dynamics(system, side, between)
    inverses = [_without(lone, _driven(system.parts[k], 0, 0)) for k in between]
    driven = [_driven(system.parts[n.to], n.input, _output(system, n, side)) for n in side.links]
    return slopes_along(v, *inverses, *(_at_rest(g, undone) for g in driven), h=system.case.step)


def _without(lone: Collection[str], graph: Graph) -> Graph:
    """Return a graph in which static gains replace dynamics of the types in `lone`, their inverses, and FIR filters."""
    inverted = _gains(without_filters(graph), lambda n: 1 / _gain_undone(n) if n.block.inverts in lone else None)
    return _gains(inverted, lambda n: gain_of(n) if n.type in lone else None)


def _gains(graph: Graph, gain: Callable[[Node], float | None]) -> Graph:
    """Return a graph in which static gains replace the nodes for which `gain` returns a number."""
    for n in graph.nodes:
        if (k := gain(n)) is not None:
            graph = graph.replace(Node(n.name, "scaling", {"n": 1}, {"gain": k}))
    return graph


def _undone(system: System, between: Collection[int]) -> set[str]:
    """Return the types of the dynamics that inverses in front of the plant compensate.

    A block inverts these dynamics, or they belong to the model of an implicit inverse.
    """
    found: set[str] = set()
    for k in between:
        graph = system.parts[k].own
        edges = _edges(graph)
        found |= {n.block.inverts for n in graph.nodes if n.block.inverts}
        for tried in (n.name for n in graph.nodes if n.block.trial):
            ring = behind(edges, tried) & behind([(b, a) for a, b in edges], tried)
            found |= {n.type for n in graph.nodes if n.name in ring}
    return {t for t in found if block_types()[t].rate == CONTINUOUS}


def _output(system: System, link: Link, side: PlantSide) -> int:
    """Return the output of a unit of the plant side that is connected to the next unit."""
    unit = system.parts[link.to]
    after = next((n.source for n in side.links if n.to != link.to and system.maker(n) is unit), None)
    if after is None:
        tracked = next(m.signal for m in system.case.metrics.values() if m.against is not None)
        after = system.columns[tracked]
    return after - unit.first


def _on_the_way(graph: Graph) -> list[Node]:
    """Return the dynamics between the driven input of a unit and the output that is connected to the next unit."""
    edges, ends, last = _ways(graph)
    after, before = behind(edges, *ends) | ends, behind([(b, a) for a, b in edges], last) | {last}
    return [n for n in graph.nodes if n.block.rate == CONTINUOUS and n.name in after & before]


def _parallel(graph: Graph, way: Sequence[Node]) -> bool:
    """Return whether the driven input of a unit also reaches its output in parallel with some of these dynamics."""
    edges, ends, last = _ways(graph)
    return any(last in behind([e for e in edges if n.name not in e], *ends) | ends for n in way if n.name != last)


def _ways(graph: Graph) -> tuple[list[tuple[str, str]], set[str], str]:
    """Return the connections of a graph, the block inputs driven by its first input, and its first block output."""
    edges = _edges(graph)
    return edges, {end.partition(".")[0] for end in graph.inputs[0].to}, graph.outputs[0].source.partition(".")[0]


def _at_rest(graph: Graph, undone: Collection[str]) -> Graph:
    """Return a graph in which static gains replace dynamics, except those that the inverse compensates.

    The graph has no delays and no quantisation.
    """
    passed = _gains(graph, lambda n: 1.0 if n.type in (DELAY, LEVELS) else None)
    return _gains(passed, lambda n: gain_of(n) if n.block.rate == CONTINUOUS and n.type not in undone else None)


def _driven(part: Part, port: int, output: int) -> Graph:
    """Return the graph of a unit with the given input and output first. All other inputs are constant."""
    inputs = [replace(i, start=part.constants.get(i.name, i.start)) for i in part.own.inputs]
    inputs.sort(key=lambda i: i.name != part.inputs[port])
    outputs = sorted(part.own.outputs, key=lambda o: o.name != part.outputs[output])
    return Graph(part.own.nodes, part.own.wires, inputs, outputs, sort=False, step=part.own.step)
