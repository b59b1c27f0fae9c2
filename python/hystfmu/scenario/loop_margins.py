"""Margins of the loop of a case, opened at the input of its plant or at a named signal.

The units of the loop are linear, except for the hysteresis of the plant and its inverse. Together these have local
slopes around 1 that depend on the path; a run of the case gives the sector of slopes. The loop is L(z) = -slope K(z)
G(z): K is the exact tangent of all other units. G is the dynamics of the plant with static gain 1, exact for a held or
ramped command with any delay, also a fraction of a step. A memory of one period enters K by its frequency response.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.design.delays import StateSpace, close
from hystfmu.design.frequency import Complex, beside, grid, least, on_grid, response_of
from hystfmu.design.linear import NO_STATES, python_control
from hystfmu.design.loop import Margins, margins_of
from hystfmu.design.period_memory import PeriodMemory, cut_memories
from hystfmu.design.sampled import sampled, trimmed
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.scenario.loop.held import held
from hystfmu.scenario.loop.plant import (
    PlantSide,
    as_gain,
    command_of,
    dynamics,
    for_small_signals,
    has_memory,
    lone_dynamics,
    plant_side,
    slopes_of,
    without_limits,
)
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.fused import fuse
from hystfmu.scenario.system.system import Link, System

DELAYS = (0.0, 0.5, 1.0, 2.0)  # steps beyond those of the case
SLOPES = 7  # of the sector at which stability is checked
FALLING = ("sliding_mode", "super_twisting")  # blocks whose gain is largest for a small signal
DOUBLINGS = 64  # of the steps over which the noise of a loop adds up
NO_SLOPE = 1e-3  # of the largest slope: a smaller one is none
COMMAND = "variation_ratio"  # kind of a metric that compares commands
LIMITED = "excess"  # output that is 0 within the limits of an amplifier


@dataclass(frozen=True)
class OpenedLoop:
    """The loop of a case, opened at the input of its plant or at a named signal.

    Attributes
    ----------
    system : System
        Case made ready to run.
    controller : (A, B, C, D), shapes (n, n), (n, q), (q, n), (q, q)
        All units except the plant, step h; an output reads the input of the same step. The first input is the output of
        the plant, the first output the command; then come the corrections and errors of the memories.
    plant : (A, B, C, D), shapes (m, m), (m, 1), (1, m), (1, 1)
        Continuous dynamics with static gain 1; time in s.
    h : float
        Step (s).
    slopes : (float, float)
        Least and largest local slope of the plant over its inverse along the path of the case.
    hysteresis : tuple of str
        Models of the plant and of its inverse.
    side : PlantSide
        Units at the rate of the plant; their delay is that of the case.
    memories : tuple of PeriodMemory
        Learning or repetitive control in the loop, at most one.
    at : str
        Signal at which the loop is opened; empty: the input of the plant.
    broken : (A, B, C, D), optional
        Controller that is opened at this signal, with a second input and a second output.
    falling : bool
        The gain of the loop decreases with the amplitude; the margins hold for the largest gain.
    inverted : bool
        The loop contains an inverse.
    ramp : float
        Ramp time of a new command for the dynamics of the plant (s).
    command : Link, optional
        Connection that carries the command: into the inverse, or without one into the plant.
    """

    system: System
    controller: StateSpace
    plant: StateSpace
    h: float
    slopes: tuple[float, float]
    hysteresis: tuple[str, ...]
    side: PlantSide
    memories: tuple[PeriodMemory, ...] = ()
    at: str = ""
    broken: StateSpace | None = None
    falling: bool = False
    inverted: bool = True
    ramp: float = 0.0
    command: Link | None = None

    @functools.cached_property
    def nominal(self) -> float:
        """Slope for which margins hold: 1, unless the loop has no inverse and the plant never has this slope.

        Then the slope of the plant, for example in um/V, is part of the loop gain, and margins hold for its largest
        value.

        Raises
        ------
        InputError
            The case stops.
        """
        if self.inverted:
            return 1.0
        low, high = slopes_of(self.system, self.side, ())
        return 1.0 if low <= 1 <= high else max(low, high, key=abs)

    @property
    def key(self) -> tuple[object, ...]:
        """Key of the data that determine the margins: equal loops have equal keys."""
        matrices = tuple((m.shape, m.tobytes()) for m in (*self.controller, *self.plant))
        laws = tuple((m.n, m.q.tobytes(), m.l.tobytes(), m.lifted) for m in self.memories)
        return self.h, self.ramp, self.hysteresis, f"{self.nominal:.3g}", self.side.delay, self.at, matrices, laws

    def open_loop(self, slope: float, delay: float) -> Any:
        """Return L(z) at the input of the plant as a state space of python-control.

        Parameters
        ----------
        slope : float
            Slope of plant over inverse.
        delay : float
            Delay in steps beyond that of the case.
        """
        control = python_control()
        A, B, C, D = self.controller
        K = control.ss(A, B[:, :1], C[:1], D[:1, :1], self.h)
        return -slope * K * control.ss(*self.held(delay), self.h)

    def held(self, delay: float) -> StateSpace:
        """Return G(z) for a delay in steps beyond that of the case."""
        return held(self.plant, self.h, self.side.delay + delay, self.ramp)

    def margins(self, slope: float | None = None, delay: float = 0.0) -> Margins:
        """Return the margins for one slope, by default `nominal`, and a delay in steps beyond those of the case."""
        slope = self.nominal if slope is None else slope
        return margins_of(*self._resolved(slope, delay), self.h, lambda gain: self._stable_with(gain, slope, delay))

    def _stable_with(self, gain: float, slope: float, delay: float) -> bool:
        """Return whether the loop is stable with a further gain at the opened signal."""
        if self.broken is None:
            return self.stable(gain * slope, delay)
        return self.stable(slope, delay) if gain == 1 else self._closed_break(gain).stable(slope, delay)

    def _closed_break(self, gain: float) -> OpenedLoop:
        """Return the loop with a gain between the two sides of the opened signal."""
        assert self.broken is not None
        A, B, C, D = self.broken
        order = [0, *range(2, len(D)), 1]  # the broken signal goes last
        system = A, B[:, order], C[order], D[np.ix_(order, order)]
        return replace(self, controller=close(system, (*NO_STATES, np.array([[gain]]))), broken=None, at="")

    def _resolved(self, slope: float, delay: float) -> tuple[Callable[[Array], Complex], Array, Complex]:
        """Return L as a function of angles, the grid with angles around each narrow resonance, and L there."""

        def L(angles: Array) -> Complex:
            return self.response_at(angles, slope, delay)

        angles, values = self._angles, self.response(slope, delay)
        more = np.setdiff1d(beside(self.poles(slope, delay), self._angles), angles)
        if not len(more):
            return L, angles, values
        at = np.searchsorted(angles, more)
        return L, np.insert(angles, at, more), np.insert(values, at, L(more))

    def poles(self, slope: float, delay: float) -> Complex:
        """Return the poles of the open and of the closed loop, without memories."""
        closed = self._closed_from_plant(slope, delay)
        systems = [(self.broken or self.controller)[0], self.held(delay)[0], closed]
        return np.concatenate([np.linalg.eigvals(A) for A in systems])

    def _closed_from_plant(self, slope: float, delay: float) -> Array:
        A, B, C, D = self._from_plant()
        F, G, H, _ = self.held(delay)
        return np.block([[A, B @ H], [slope * G @ C, F + slope * G @ D @ H]])

    def response_at(self, angles: Array, slope: float = 1.0, delay: float = 0.0) -> Complex:
        """Return L at angles omega h, shape (m,)."""
        z = np.exp(1j * angles)
        K, G = response_of(self.broken or self.controller, z), response_of(self.held(delay), z)[:, 0, 0]
        return self._broken(K, slope * G, angles)

    def response(self, slope: float = 1.0, delay: float = 0.0) -> Complex:
        """Return L on the grid of `angles`, shape (m,)."""
        return self._broken(
            on_grid(self.broken or self.controller, self._period), slope * self._late(delay), self._angles
        )

    @property
    def _period(self) -> int:
        return self.memories[0].n if self.memories else 0

    @property
    def _angles(self) -> Array:
        return grid(self._period)

    def _late(self, delay: float) -> Complex:
        return on_grid(self.held(delay), self._period)[:, 0, 0]

    def _closed(self, angles: Array, K: Complex) -> Complex:
        """Close the memories around the response of the controller."""
        if not self.memories:
            return K
        R = self.memories[0].response(angles)[:, None, None]
        return np.asarray(K[:, :-1, :-1] + K[:, :-1, -1:] * R * K[:, -1:, :-1] / (1 - R * K[:, -1:, -1:]))

    def _broken(self, K: Complex, G: Complex, angles: Array) -> Complex:
        """Return L from the responses of controller and plant."""
        K = self._closed(angles, K)
        if self.broken is None:
            return np.asarray(-K[:, 0, 0] * G)
        return np.asarray(-(K[:, 1, 1] + K[:, 1, 0] * G * K[:, 0, 1] / (1 - K[:, 0, 0] * G)))

    def radius(self, slope: float, delay: float) -> float:
        """Return the largest modulus of a pole of the closed loop; it is stable below 1.

        With a memory of n steps, the bound factor^(1/n) represents the additional poles.
        """
        largest = float(np.abs(np.linalg.eigvals(self._closed_from_plant(slope, delay))).max())
        if not self.memories or largest >= 1:
            return largest
        return max(largest, float(self.learning(slope, delay) ** (1 / self._period)))

    def stable(self, slope: float, delay: float) -> bool:
        """Return whether the closed loop is stable."""
        plain = replace(self, memories=())
        if plain.radius(slope, delay) >= 1:
            return False
        if not self.memories:
            return True
        factor = self._factor(slope, delay)
        if np.abs(factor).max() < 1 or self.memories[0].lifted:
            return bool(np.abs(factor).max() < 1)
        # 1 - z^-n factor is regular outside the unit circle: it winds around 0 as often as it has zeros there
        return _turns(1 - np.exp(-1j * self._period * self._angles) * factor) == 0

    def learning(self, slope: float | None = None, delay: float = 0.0) -> float:
        """Return the largest modulus of Q - L T, the factor of the corrections per period; NaN without a memory."""
        slope = self.nominal if slope is None else slope
        return float(np.abs(self._factor(slope, delay)).max()) if self.memories else np.nan

    def _factor(self, slope: float, delay: float) -> Complex:
        K, G = on_grid(self.controller, self._period), slope * self._late(delay)
        return self.memories[0].factor(self._angles, _error(K, G))

    def learnt(self, angles: Array, slope: float | None = None, delay: float = 0.0) -> Complex:
        """Return the response from a correction of the memory to the reduction of the error, shape (m,).

        The memory itself is not included: it multiplies errors by abs(Q - L T) per period, where T is this response.

        Parameters
        ----------
        angles : array, shape (m,)
            omega h.
        slope, delay
            As `margins`.

        Raises
        ------
        InputError
            The loop has no memory.
        """
        if not self.memories:
            raise InputError(f"{self.system.case.title}: The loop must have a memory of a period. Got none.")
        z = np.exp(1j * angles)
        slope = self.nominal if slope is None else slope
        return -_error(response_of(self.controller, z), slope * response_of(self.held(delay), z)[:, 0, 0])

    def worst_peak_db(self, delay: float = 0.0) -> float:
        """Return the largest peak of the sensitivity over the sector of slopes (dB); infinite if one is unstable."""
        if not self.stable_at(delay):
            return np.inf
        return max(self._peak_db(float(slope), delay) for slope in np.linspace(*self.slopes, SLOPES))

    def _peak_db(self, slope: float, delay: float) -> float:
        L, angles, values = self._resolved(slope, delay)
        return float(-20 * np.log10(least(lambda a: np.abs(1 + L(a)), angles, np.abs(1 + values))))

    def stable_at(self, delay: float) -> bool:
        """Return whether every slope of the sector is stable.

        A slope of 0, for example of an inverse at its limit, opens the loop, and nothing grows. Therefore a slope close
        to 0 is tested instead, at which a conditionally stable loop becomes unstable.
        """
        least = NO_SLOPE * max(map(abs, self.slopes))
        found = [float(s) if abs(s) >= least else least for s in np.linspace(*self.slopes, SLOPES)]
        return all(self.stable(slope, delay) for slope in found)

    def stable_to(self, delays: Sequence[float] = DELAYS) -> float:
        """Return the largest of these delays up to which every slope of the sector is stable; NaN if none."""
        found = np.nan
        for delay in sorted(delays):
            if not self.stable_at(delay):
                break
            found = delay
        return float(found)

    def noise_gain(self, slope: float | None = None, delay: float = 0.0) -> float:
        """Return the RMS of the command for white noise of RMS 1 at the sensor; infinite if unstable."""
        slope = self.nominal if slope is None else slope
        if not self.stable(slope, delay):
            return np.inf
        if self.memories:
            K = self._closed(self._angles, on_grid(self.controller, self._period))[:, 0, 0]
            power = np.abs(K / (1 - slope * K * self._late(delay))) ** 2
            return float(np.sqrt(np.trapezoid(power, self._angles) / np.pi))
        _, B, C, D = self._from_plant()
        _, G, H, _ = self.held(delay)
        M = self._closed_from_plant(slope, delay)
        N, out = np.vstack([B, slope * G @ D]), np.hstack([C, D @ H])
        X = _covariance(M, N)
        return float(np.sqrt((out @ X @ out.T + D @ D.T)[0, 0])) if np.isfinite(X).all() else np.inf

    def _from_plant(self) -> StateSpace:
        """Return the controller from the output of the plant to its input, without memories."""
        A, B, C, D = self.controller
        return A, B[:, :1], C[:1], D[:1, :1]


def _error(K: Complex, G: Complex) -> Complex:
    """Return the response from the correction of a memory to its error, in the loop of K and G without it."""
    return np.asarray(K[:, -1, -1] + K[:, -1, 0] * G * K[:, 0, -1] / (1 - K[:, 0, 0] * G))


def _covariance(M: Array, N: Array) -> Array:
    """Return the solution X of X = M X M' + N N' for a stable M, by doubling, which keeps X positive."""
    X, P = N @ N.T, M
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(DOUBLINGS):
            if not np.abs(P).max() > 1e-150:
                return X
            X, P = X + P @ X @ P.T, P @ P
    return np.full_like(X, np.inf)  # a pole that rounding alone keeps below 1


def _turns(f: Complex) -> int:
    """Return the number of encirclements of 0 by a response on (0, pi] and its conjugate."""
    return round(float(np.angle(f[1:] / f[:-1]).sum()) / np.pi)


def open_loop(system: System, slopes: tuple[float, float] | None = None, at: str = "") -> OpenedLoop:
    """Open the loop of a case at the input of the unit whose output is tracked, or at another signal.

    Parameters
    ----------
    system : System
        Case made ready to run.
    slopes : (float, float), optional
        Sector of local slopes of the plant over its inverse; by default the case is run to find it.
    at : str
        Signal `unit.output` at which the loop is opened, for all units that read it.

    Raises
    ------
    InputError
        The case has no feedback, its loop has a foreign FMU, several rates, a plant without linear dynamics or units
        that are not linear at rest, or there is no such signal.
    """
    where = system.case.title
    plant = _plant(system)
    within = _loop(system, plant)
    if any(isinstance(system.parts[k].graph, Foreign) for k in within):
        raise InputError(f"{where}: The loop must have no foreign FMU, whose equations are not known. Got one.")
    if len(outputs := _outputs(system, within)) > 1:
        raise InputError(
            f"{where}: The loop must have one input and one output to have margins. Got {len(outputs)} outputs with "
            f"references of their own: {', '.join(outputs)}."
        )
    scheme = system.case.coupling.scheme
    if scheme != "gauss_seidel":
        raise InputError(
            f"{where}: The coupling must be gauss_seidel, whose order the loop follows. Got {scheme} instead."
        )
    side = plant_side(system, plant, within)
    around = [k for k in within if k not in side.units]
    if any(system.parts[k].period != system.case.ripple for k in around):
        raise InputError(f"{where}: The controllers must have one rate to have margins. Got several.")
    for name in (system.parts[k].name for k in side.units if system.parts[k].period > system.case.ripple):
        raise InputError(
            f"{where}: The plant must step as often as its controllers to have margins. Got {name} slower."
        )
    for name in (system.parts[k].name for k in within if system.case.units[system.parts[k].name].hold != "zero"):
        raise InputError(f"{where}: The units of the loop must hold their inputs to have margins. Got lines at {name}.")
    between = [k for k in around if has_memory(system.parts[k].own)]
    slopes = slopes or slopes_of(system, side, between)
    graph = _controllers(system, plant, around, {k: lone_dynamics(system, side, [k]) for k in between})
    maker = system.maker(side.entry)
    out = f"{maker.name}_{maker.outputs[side.entry.source - maker.first]}"
    command = next(o for o in graph.outputs if o.name == out)
    measured = _measured(system, plant, graph)
    y = Input("y", tuple(end for i in measured for end in i.to))
    rest = [i for i in graph.inputs if i not in measured]  # what the loop leaves open
    controller = Graph(graph.nodes, graph.wires, [y, *rest], [Output("u", command.source)], sort=False)
    linear, ramp = dynamics(system, side, between)
    opened, memories = _linear(system, controller, 1)
    broken = None
    if at and at.partition(".")[0] not in {system.parts[k].name for k in side.units}:
        other = _break(controller, graph, at, tuple(system.parts[k].name for k in around), where)
        broken, _ = _linear(system, other, 2)
    specs = [system.case.units[system.parts[k].name] for k in (plant, *between)]
    models = tuple(str(s.model or s.inverse_of or s.block) for s in specs)
    return OpenedLoop(
        system,
        opened,
        linear,
        system.case.step,
        slopes,
        models,
        side,
        memories,
        at,
        broken,
        any(n.type in FALLING for n in controller.nodes),
        bool(between),
        ramp,
        command_of(system, side, between),
    )


def _linear(system: System, controller: Graph, ports: int) -> tuple[StateSpace, tuple[PeriodMemory, ...]]:
    """Return the state space of a controller and its memories; of its inputs only the first ones belong to the loop."""
    where = system.case.title
    controller, memories = cut_memories(controller)
    if len(memories) > 1:
        raise InputError(f"{where}: The loop must have one memory of a period at most. Got {len(memories)}.")
    try:
        A, B, C, D = _tangent(_Content(controller.to_bytes(), controller), system.case.step)
    except InputError as e:
        raise InputError(f"{where}: {e}") from None
    inputs = [k for k in range(B.shape[1]) if k < ports or k >= B.shape[1] - len(memories)]
    return trimmed((A, B[:, inputs], C, D[:, inputs])), memories


def _controllers(system: System, plant: int, around: Sequence[int], between: Mapping[int, set[str]]) -> Graph:
    """Return the units of the loop except the plant as one graph.

    Hysteresis and quantisers become gains of 1. Dynamics that only an inverse has remain.
    """
    n = len(system.parts)
    if system.case.ripple == 1:  # one rate: the order goes round, and the plant may stand anywhere
        around = sorted(around, key=lambda k: (k - plant) % n)
    straight = [replace(p, graph=as_gain(p, between[k])) if k in between else p for k, p in enumerate(system.parts)]
    return for_small_signals(fuse(replace(system, parts=tuple(straight)), tuple(around))[0])


def _measured(system: System, plant: int, graph: Graph) -> list[Input]:
    """Return the inputs of the controllers that read the tracked output of the plant.

    Raises
    ------
    InputError
        They read another output of the plant that depends on small signals.
    """
    tracked = system.columns[_tracked(system)]
    found = []
    for i in graph.inputs:
        link = next((n for n in system.links if i.name == _input_name(system, n)), None)
        if link is None or system.maker(link) is not system.parts[plant]:
            continue
        name = system.parts[plant].outputs[link.source - system.parts[plant].first]
        if link.source == tracked:
            found.append(i)
        elif name != LIMITED:
            raise InputError(f"{system.case.title}: The loop must close over one output of the plant. Got {name} too.")
    return found


@dataclass(frozen=True)
class _Content:
    """A graph that equals another one with the same bytes."""

    content: bytes
    graph: Graph = field(compare=False)


@functools.lru_cache(maxsize=64)
def _tangent(controller: _Content, h: float) -> StateSpace:
    """Return the state space of a controller, computed once for all cases that have it."""
    return sampled(without_limits(controller.graph), h)


def _break(controller: Graph, graph: Graph, at: str, units: Sequence[str], where: str) -> Graph:
    """Open a controller at a signal: its readers read a new input instead, with the same delay."""
    unit, _, output = at.partition(".")
    source = next((o.source for o in graph.outputs if unit in units and o.name == f"{unit}_{output}"), None)
    if source is None:
        raise InputError(f"{where}: The signal must be an output of {', '.join(units)}. Got {at!r} instead.")
    own = f"{unit}_"
    behind = Node("behind_break", "scaling", {"n": 1})
    maker = source.partition(".")[0]
    nodes = [m for n in controller.nodes for m in ([n, behind] if n.name == maker else [n])]
    inside = {n.name for n in controller.nodes if n.name.startswith(own)}
    wires = [
        (f"{behind.name}.y" if a == source and b.partition(".")[0] not in inside else a, b) for a, b in controller.wires
    ]
    first, *rest = controller.inputs
    (u,) = controller.outputs
    if wires == list(controller.wires) and u.source != source:
        raise InputError(f"{where}: A unit of the loop must read the signal. Got {at!r}, which none reads.")
    inputs = [first, Input("behind", (f"{behind.name}.u",)), *rest]
    outputs = [Output("u", f"{behind.name}.y" if u.source == source else u.source), Output("before", source)]
    return Graph(nodes, wires, inputs, outputs, sort=False)


def _tracked(system: System) -> str:
    """Return the signal that a metric compares with a reference."""
    tracked = next((m.signal for m in system.case.metrics.values() if m.against is not None), None)
    if tracked is None:
        raise InputError(f"{system.case.title}: A metric must compare an output with a reference. Got none.")
    return tracked


def _outputs(system: System, within: Sequence[int]) -> list[str]:
    """Return the outputs of a loop that follow their own references from outside the loop."""
    names = {system.parts[k].name for k in within}
    found = {
        m.against.partition(".")[0]: m.signal
        for m in system.case.metrics.values()
        if m.against is not None and m.kind != COMMAND and m.signal.partition(".")[0] in names
    }
    return list(dict.fromkeys(y for r, y in found.items() if r not in names))


def _plant(system: System) -> int:
    """Return the unit whose output is tracked."""
    name = _tracked(system).partition(".")[0]
    return next(i for i, p in enumerate(system.parts) if p.name == name)


def _loop(system: System, plant: int) -> list[int]:
    """Return the units of the feedback path of the plant, in the order of evaluation."""
    owner = {p.name: k for k, p in enumerate(system.parts)}
    edges = [(owner[system.maker(n).name], n.to) for n in system.links]
    after, before = _reached(edges, plant), _reached([(b, a) for a, b in edges], plant)
    if plant not in after:
        name = system.parts[plant].name
        raise InputError(
            f"{system.case.title}: The case must have feedback. Got an open loop: {name} does not act on itself."
        )
    return [k for k in range(len(system.parts)) if k in after & before]


def _reached(edges: Sequence[tuple[int, int]], first: int) -> set[int]:
    """Return the units downstream of a unit; the unit itself only if it acts on itself."""
    found: set[int] = set()
    while more := {b for a, b in edges if a in found | {first}} - found:
        found |= more
    return found


def _input_name(system: System, link: Link) -> str:
    """Return the name of the driven input in a fused graph."""
    part = system.parts[link.to]
    return f"{part.name}_{part.inputs[link.input]}"
