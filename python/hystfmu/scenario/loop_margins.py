"""Margins of the loop of a case, opened at the input of its plant.

The units of the loop are linear but for the hysteresis of the plant and its inverse.  These two together have local
slopes around 1 that depend on the path; the case itself is run to find the sector that they fill.  The loop is
L(z) = -slope K(z) G(z): K is the exact tangent of all other units, G the dynamics of the plant with static gain 1,
exact for the held command, with any delay, also a fraction of a step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm, solve_discrete_lyapunov

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.design.delays import StateSpace
from hystfmu.design.linear import linearise, python_control
from hystfmu.design.loop import Margins, Response, margins, response_matrix
from hystfmu.design.periodic import CORRECTION, ERROR, Periodic, opened
from hystfmu.design.sampled import sampled
from hystfmu.design.sector import CONTINUOUS, sector, static_gain
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.fused import fuse
from hystfmu.scenario.system.system import Link, Part, System

DELAYS = (0.0, 0.5, 1.0, 2.0)  # steps beyond those of the case
POINTS = 2048  # frequencies of what a repetitive part leaves of an error
SLOPES = 7  # of the sector at which stability is checked
MEMORY = ("operators", "inverses", "networks")  # families of the blocks that the slope stands for


@dataclass(frozen=True)
class OpenedLoop:
    """The loop of a case, opened at the input of its plant.

    Attributes
    ----------
    system : System
        Case made ready to run.
    controller : (A, B, C, D), shapes (n, n), (n, m), (m, n), (m, m)
        From the output of the plant to its input, step h; an output reads the input of the same step.  With a
        repetitive part m is 2: its correction is the second input, its error the second output.
    plant : (A, B, C, D), shapes (m, m), (m, 1), (1, m), (1, 1)
        Continuous dynamics with static gain 1; time in s.
    h : float
        Step (s).
    slopes : (float, float)
        Least and largest local slope of the plant over its inverse along the path of the case.
    hysteresis : tuple of str
        Models of the plant and of its inverse.
    periodic : Periodic, optional
        Repetitive part.
    """

    system: System
    controller: StateSpace
    plant: StateSpace
    h: float
    slopes: tuple[float, float]
    hysteresis: tuple[str, ...]
    periodic: Periodic | None = None

    def open_loop(self, slope: float, delay: float) -> Any:
        """Return L(z) for one slope and a delay in steps: a state space of python-control, or a Response."""
        if self.periodic is None:
            K, G = self._systems(delay)
            return -slope * K * G
        part = self.periodic

        def at(z: NDArray[np.complex128]) -> NDArray[np.complex128]:
            G, K = self._responses(slope, delay, z)
            return np.asarray(-G * part.closed(K, z))

        return Response(at, self.h, self.stable(slope, delay), part.frequencies(self.h))

    def _responses(self, slope: float, delay: float, z: Any) -> tuple[Any, Any]:
        """Return slope G(z), shape (n,), and K(z), shape (n, m, m)."""
        G = response_matrix(held(self.plant, self.h, delay), z)[:, 0, 0]
        return slope * G, response_matrix(self.controller, z)

    def _systems(self, delay: float) -> tuple[Any, Any]:
        """Return K(z) and G(z) for a delay in steps."""
        control = python_control()
        return tuple(control.ss(*part, self.h) for part in (self.controller, held(self.plant, self.h, delay)))

    def margins(self, slope: float = 1.0, delay: float = 0.0) -> Margins:
        """Return the margins for one slope and a delay in steps beyond those of the case."""
        return margins(self.open_loop(slope, delay))

    def radius(self, slope: float, delay: float) -> float:
        """Return the largest modulus of a pole of the closed loop; it is stable below 1.

        With a repetitive part it is that of the loop without it, or what is left of an error after a period,
        max abs(Q - L T), whichever is greater: below 1 the loop is stable, whatever the period.
        """
        A, B, C, D = (self.controller[0], self.controller[1][:, :1], self.controller[2][:1], self.controller[3][:1, :1])
        F, G, H, _ = held(self.plant, self.h, delay)
        closed = np.block([[A, B @ H], [slope * G @ C, F + slope * G @ D @ H]])
        inner = float(np.abs(np.linalg.eigvals(closed)).max())
        if self.periodic is None:
            return inner
        z = np.exp(1j * np.pi * (np.arange(POINTS) + 0.5) / POINTS)
        g, K = self._responses(slope, delay, z)
        around = K[:, 1, 1] + K[:, 1, 0] * g * K[:, 0, 1] / (1 - g * K[:, 0, 0])
        return max(inner, float(np.abs(self.periodic.left(z, around)).max()))

    def stable(self, slope: float, delay: float) -> bool:
        """Whether the closed loop is stable."""
        return self.radius(slope, delay) < 1

    def stable_to(self, delays: Sequence[float] = DELAYS) -> float:
        """Return the largest of these delays up to which every slope of the sector is stable; NaN if none."""
        found = np.nan
        for delay in sorted(delays):
            if not all(self.stable(slope, delay) for slope in np.linspace(*self.slopes, SLOPES)):
                break
            found = delay
        return float(found)

    def noise_gain(self, slope: float = 1.0, delay: float = 0.0) -> float:
        """Return the RMS of the command that white noise of RMS 1 at the sensor makes; infinite if unstable."""
        if not self.stable(slope, delay):
            return np.inf
        if self.periodic is not None:  # the mean over all frequencies
            z = np.exp(1j * self.h * self.periodic.frequencies(self.h))
            L = self.open_loop(slope, delay)(z)
            G, _ = self._responses(slope, delay, z)
            return float(np.sqrt(np.mean(np.abs(L / G / (1 + L)) ** 2)))
        K, G = self._systems(delay)
        closed = python_control().feedback(K, slope * G, sign=1)
        X = solve_discrete_lyapunov(closed.A, closed.B @ closed.B.T, "bilinear")
        return float(np.sqrt((closed.C @ X @ closed.C.T + closed.D @ closed.D.T)[0, 0]))


def open_loop(system: System, slopes: tuple[float, float] | None = None) -> OpenedLoop:
    """Open the loop of a case at the input of the unit whose output is tracked.

    Parameters
    ----------
    system : System
        Case made ready to run.
    slopes : (float, float), optional
        Sector of local slopes of the plant over its inverse; by default the case is run to find it.

    Raises
    ------
    InputError
        The case has no feedback, or in its loop a foreign FMU, several rates, a plant without linear dynamics, or units
        that are not linear at rest.
    """
    where = system.case.title
    plant, entry = _plant(system)
    around = _loop(system, plant)
    parts = [system.parts[k] for k in around]
    if any(isinstance(p.graph, Foreign) for p in (system.parts[plant], *parts)):
        raise InputError(f"{where}: The loop must have no foreign FMU to have margins. Got one.")
    if system.case.coupling.scheme != "gauss_seidel":
        raise InputError(f"{where}: The coupling must be gauss_seidel. Got {system.case.coupling.scheme} instead.")
    if {p.period for p in parts} != {system.case.ripple} or any(plant > k for k in around):
        raise InputError(f"{where}: The loop must have one rate, its plant first in the order. Got another order.")
    between = [k for k in around if _has_memory(system.parts[k].own)]
    slopes = slopes or _slopes(system, plant, entry, between)
    straight = tuple(replace(p, graph=_gain(p.own)) if k in between else p for k, p in enumerate(system.parts))
    graph, _ = fuse(replace(system, parts=straight), tuple(around))
    graph, periodic = opened(graph)
    measured = [i for i in graph.inputs if _source(system, i.name) == plant]
    ends = tuple(end for i in measured for end in i.to)
    maker = system.maker(entry)
    out = f"{maker.name}_{maker.outputs[entry.source - maker.first]}"
    command = next(o for o in graph.outputs if o.name == out)
    inputs = [Input("y", ends), *(i for i in graph.inputs if periodic and i.name == CORRECTION)]
    outputs = [Output("u", command.source), *(o for o in graph.outputs if periodic and o.name == ERROR)]
    controller = Graph(graph.nodes, graph.wires, inputs, outputs, sort=False)
    dynamics = linearise(_dynamics(system.parts[plant].own, where))
    try:
        A, B, C, D = sampled(_wired(controller, graph), system.case.step)
    except InputError as e:
        raise InputError(f"{where}: {e}") from None
    specs = [system.case.units[system.parts[k].name] for k in (plant, *between)]
    models = tuple(str(s.model or s.inverse_of or s.block) for s in specs)
    m = len(inputs)
    return OpenedLoop(system, (A, B[:, :m], C, D[:, :m]), dynamics, system.case.step, slopes, models, periodic)


def _wired(controller: Graph, graph: Graph) -> Graph:
    """Give every input that the loop leaves open its own input, so that the graph is complete."""
    taken = {end for i in controller.inputs for end in i.to}
    rest = [Input(i.name, i.to) for i in graph.inputs if not taken & set(i.to)]
    return Graph(controller.nodes, controller.wires, [*controller.inputs, *rest], controller.outputs, sort=False)


def _plant(system: System) -> tuple[int, Link]:
    """Return the unit whose output is tracked, and the connection through which the loop drives it."""
    case = system.case
    tracked = next((m.signal for m in case.metrics.values() if m.against is not None), None)
    if tracked is None:
        raise InputError(f"{case.title}: A metric must compare an output with a reference. Got none.")
    name = tracked.partition(".")[0]
    k = next(i for i, p in enumerate(system.parts) if p.name == name)
    after = _after(system, k)
    closing = [n for n in system.links if n.to == k and _owner(system, n) in after]
    if len(closing) != 1:
        raise InputError(f"{case.title}: One connection must close the loop at {name}. Got {len(closing) or 'none'}.")
    return k, closing[0]


def _loop(system: System, plant: int) -> list[int]:
    """Return the other units of the loop, in the order of evaluation."""
    after = _after(system, plant)
    before = {plant}
    for _ in system.parts:
        before |= {_owner(system, n) for n in system.links if n.to in before}
    return [k for k in range(len(system.parts)) if k in after and k in before and k != plant]


def _after(system: System, first: int) -> set[int]:
    found: set[int] = set()
    for _ in system.parts:
        found |= {n.to for n in system.links if _owner(system, n) in found | {first}}
    return found


def _owner(system: System, link: Link) -> int:
    return system.parts.index(system.maker(link))


def _source(system: System, name: str) -> int | None:
    """Return the unit that drives an input of a fused graph, named unit_input."""
    for n in system.links:
        part = system.parts[n.to]
        if name == f"{part.name}_{part.inputs[n.input]}":
            return _owner(system, n)
    return None


def _has_memory(graph: Graph) -> bool:
    return any(n.block.family in MEMORY for n in graph.nodes)


def _gain(graph: Graph) -> Graph:
    """Replace the inverse of a hysteresis by a gain of 1, which keeps its ports."""
    node = Node("gain", "scaling", {"n": 1})
    (first, *others) = graph.inputs
    if others or any(o.source.endswith("]") for o in graph.outputs):
        raise InputError(f"The inverse in a loop must have one input. Got {len(graph.inputs)}.")
    return Graph([node], (), [Input(first.name, ("gain.u",))], [Output(o.name, "gain.y") for o in graph.outputs])


def _dynamics(graph: Graph, where: str) -> Graph:
    """Return the linear dynamics behind the hysteresis of a plant as a chain with static gain 1."""
    chain = [Node("gain", "scaling", {"n": 1}, {"gain": 1 / _static_gain(graph)})]
    chain += [n for n in graph.nodes if n.block.rate == CONTINUOUS]
    if len(chain) == 1:
        raise InputError(f"{where}: The plant must have linear dynamics to have margins. Got a static one.")
    wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(chain)]
    return Graph(chain, wires, [Input("u", ("gain.u",))], [Output("y", f"{chain[-1].name}.y")])


def _static_gain(graph: Graph) -> float:
    """Return the product of the static gains of the dynamics of a plant."""
    return float(np.prod([static_gain(n) for n in graph.nodes if n.block.rate == CONTINUOUS]))


def _slopes(system: System, plant: int, entry: Link, between: Sequence[int]) -> tuple[float, float]:
    """Run the case and return the sector of slopes of plant over inverse along its path."""
    first = next((n for n in system.links if n.to == between[0]), entry) if between else entry
    column = next(name for name, place in system.columns.items() if place == first.source)
    try:
        v = Native(system, [column]).run()[column][:: system.case.ripple]
    except Stopped as e:
        raise InputError(f"{system.case.title}: The case must run to its end to have a sector of slopes. {e}") from None
    part = system.parts[plant]
    chain = [_driven(system.parts[k], system.parts[k].inputs[0]) for k in between]
    return sector(v, *chain, _driven(part, part.inputs[entry.input]), h=system.case.step)


def _driven(part: Part, port: str) -> Graph:
    """Return the graph of a unit with the input `port` first; the others start at the constants of the case."""
    inputs = [replace(i, start=part.constants.get(i.name, i.start)) for i in part.own.inputs]
    inputs.sort(key=lambda i: i.name != port)
    return Graph(part.own.nodes, part.own.wires, inputs, part.own.outputs, sort=False, step=part.own.step)


def held(plant: StateSpace, h: float, delay: float) -> StateSpace:
    """Discretise dynamics for a command that is held for a step h (s) and comes `delay` steps late, exactly.

    Source: Astrom & Wittenmark, Computer-Controlled Systems, 3rd ed., section 2.3.

    Parameters
    ----------
    plant : (A, B, C, D), shapes (n, n), (n, 1), (1, n), (1, 1)
        One input and one output, without direct feed-through; time in s.
    h : float
        Step (s).
    delay : float
        Delay in steps, also a fraction.

    Returns
    -------
    (A, B, C, D), shapes (n + q, n + q), (n + q, 1), (1, n + q), (1, 1)
        States of the plant, then the q past commands that still act.

    Raises
    ------
    InputError
        Direct feed-through: the output of a step would depend on a command of the same step.
    """
    A, B, C, D = plant
    if np.any(D):
        raise InputError("The dynamics of the plant must have no direct feed-through. Got some.")
    whole = int(np.floor(delay + 1e-12))
    part = max(delay - whole, 0.0) if delay - whole > 1e-9 else 0.0
    late, now = _over(A, B, part * h), _over(A, B, (1 - part) * h)
    n, past = len(A), whole + (part > 0)
    M, N = np.zeros((n + past, n + past)), np.zeros((n + past, 1))
    M[:n, :n] = now[0] @ late[0]
    weights = {whole: now[1], whole + 1: now[0] @ late[1]}  # of u(k - j)
    for j, w in weights.items():
        if j == 0:
            N[:n] += w
        elif j <= past:
            M[:n, n + j - 1 : n + j] += w
    if past:
        N[n] = 1.0
        M[n + 1 :, n:-1] = np.eye(past - 1)
    return M, N, np.hstack([C, np.zeros((1, past))]), np.zeros((1, 1))


def _over(A: Array, B: Array, t: float) -> tuple[Array, Array]:
    """Return e^(A t) and the integral of e^(A s) B over 0 .. t."""
    n = len(A)
    M = expm(np.block([[A, B], [np.zeros((1, n + 1))]]) * t)
    return M[:n, :n], M[:n, n:]
