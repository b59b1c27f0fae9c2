"""Loops of a scenario for which a controller must be designed, and the signals of a loop by their role.

A corner is a worst-case parameter set: a case with an incremental gain of inverse and plant, an additional delay, and
shifted natural frequencies of the plant. The roles of the signals are reference, measured output and command. They are
found from the connections, not from the names of the units.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from hystfmu.base import Array, Complex, InputError
from hystfmu.design.loop import beside
from hystfmu.design.plants import Plant, PlantSet
from hystfmu.design.race import Aim
from hystfmu.design.structures import Design
from hystfmu.graph import Node
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.loop.opened import OpenedLoop
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.spec import MarginsSpec
from hystfmu.scenario.system.system import Link, System, behind

REFERENCE = "reference"  # name of the block that produces a periodic reference
# names of the limits of controllers, and of limits of units after the controllers
COMMAND, RANGE = ("u_min", "u_max"), ("lo", "hi")
NONE, INSIDE = 1e300, 1e-6


@dataclass(frozen=True)
class Limit:
    """A limit of the command between the controller and the plant."""

    signal: str  # name of the limited output; empty if the command itself is limited
    low: float  # smallest and largest value; -1e300 and 1e300 mean no limit
    high: float
    keys: tuple[str, str]  # names of the two limits in the key `set` of a case
    # True if the limit saturates the signal. A saturated signal has reached the limit if its distance from the limit is
    # at most a millionth of the range.
    clipped: bool = False

    def ends(self, said: Mapping[str, Any]) -> tuple[float, float]:
        """Return the limits of the signal (smallest, largest) for the values in the key `set` of a case."""
        low, high = (float(said.get(k, v)) for k, v in zip(self.keys, (self.low, self.high), strict=True))
        inside = INSIDE * (high - low) if self.clipped and high - low < NONE else 0.0
        return low + inside, high - inside


@dataclass(frozen=True)
class Roles:
    """Names of reference, measured output and command of a loop in a scenario, and limits of the command."""

    reference: str  # output of the reference, with which the tracked output is compared
    measured: str  # tracked output after the sensor and its converter, which is the input of the controllers
    command: str  # input of the inverse, or of the plant if there is no inverse
    driver: str  # output that is connected to `command`
    sources: tuple[str, ...]  # units of the block `reference` that produce the reference
    limits: tuple[Limit, ...] = field(default=(), compare=False)  # all limits of the command


def roles(opened: OpenedLoop) -> Roles:
    """Find reference, measured output and command of an opened loop from its connections, and limits of the command.

    An InputError is raised if the path from the plant to the controllers has branches, so that the controllers do not
    have one common measured input.
    """
    system = opened.system
    tracked = system.case.tracked
    assert tracked is not None
    signal, against = tracked.signal, str(tracked.against)
    owner = {p.name: k for k, p in enumerate(system.parts)}
    plant, maker = owner[signal.partition(".")[0]], owner[against.partition(".")[0]]
    forward = system.edges
    led = behind([e for e in forward if e[0] != plant], maker) | {maker}
    back = behind([(b, a) for a, b in forward], maker) | {maker}
    command = opened.command or opened.side.entry
    target = system.parts[command.to]
    return Roles(
        against,
        system.names[_measured(system, system.columns[signal], plant, led)],
        f"{target.name}.{target.inputs[command.input]}",
        system.names[command.source],
        tuple(system.parts[k].name for k in sorted(back) if _is_reference(system, k)),
        tuple(_limits(system, command, opened.side.entry)),
    )


def first_loop(
    systems: Mapping[str, System], nominal: str | None, period: float | None = None
) -> tuple[str, OpenedLoop]:
    """Return the case that a design starts from, and the open loop of this case for the incremental gain 1.

    This is the case `nominal`, which `[margins]` names, or else the first case with a loop. If a period (s) is given,
    it is the first case with a loop and a reference of this period, if there is one. An InputError is raised if no case
    has a loop.
    """
    why: InputError | None = None
    loops: dict[str, OpenedLoop] = {}
    for name in [*([nominal] if nominal is not None else []), *systems]:
        try:
            loops.setdefault(name, open_loop(systems[name], (1.0, 1.0)))
        except InputError as e:
            why = why or e
            continue
        if period is None:
            break
        frequency, _ = reference_of(systems[name], roles(loops[name]))
        if abs(frequency * period - 1) < systems[name].case.step / period:
            return name, loops[name]
    if not loops:
        assert why is not None
        raise why
    return next(iter(loops.items()))


def reference_of(system: System, of: Roles) -> tuple[float, str]:
    """Return the frequency (Hz) and the shape of the reference, or 0 and "" if no block `reference` produces it."""
    for part in system.parts:
        if part.name in of.sources:
            (node,) = part.own.nodes
            (shape,) = (v for v in node.block.parameters if v.name == "shape")
            return float(node.value("frequency")[0]), shape.choices[int(node.value("shape")[0])]
    return 0.0, ""


def _measured(system: System, place: int, plant: int, led: set[int]) -> int:
    """Return the last signal on the path from the tracked output to the first unit that depends on the reference."""
    acting = behind([(b, a) for a, b in system.edges], plant)
    while True:
        readers = {n.to for n in system.links if n.source == place and n.to in acting}
        if len(readers) != 1 or readers & led:
            return place
        (unit,) = readers
        outputs = {n.source for n in system.links if system.owners[n.source] == unit and n.to in acting}
        if len(outputs) != 1:
            raise InputError(
                f"{system.case.title}: One output of {system.parts[unit].name} must be the measured one. Got "
                f"{len(outputs)} that act on the plant."
            )
        (place,) = outputs


def _limits(system: System, command: Link, entry: Link) -> Iterator[Limit]:
    """Yield the limits of the command in the last controller, and in the units between the command and the plant."""
    last = system.maker(command)
    for n in getattr(last.graph, "nodes", ()):
        if set(COMMAND) <= {v.name for v in n.block.parameters}:
            low, high = (float(n.value(k)[0]) for k in COMMAND)
            inner = "" if len(last.own.nodes) == 1 else f"{n.name}_"
            keys = (f"{last.name}.{inner}u_min", f"{last.name}.{inner}u_max")
            for signal in ("", system.names[command.source]):
                yield Limit(signal, max(low, -NONE), min(high, NONE), keys, clipped=bool(signal))
    link = entry
    while link.source != command.source and system.owners[link.source] != command.to:
        part = system.maker(link)
        into = [n for n in system.links if n.to == system.parts.index(part)]
        if len(into) != 1:
            return
        nodes: list[Node] = list(getattr(part.graph, "nodes", ()))
        if len(nodes) == 1 and set(RANGE) <= {v.name for v in nodes[0].block.parameters}:
            low, high = (float(nodes[0].value(k)[0]) for k in RANGE)
            if low > -NONE or high < NONE:
                yield Limit(system.names[into[0].source], low, high, (f"{part.name}.lo", f"{part.name}.hi"))
        (link,) = into


def _is_reference(system: System, k: int) -> bool:
    graph = system.parts[k].graph
    return [n.type for n in getattr(graph, "nodes", ())] == [REFERENCE]


@dataclass(frozen=True)
class Corner:
    """A loop for which a controller must be designed.

    `name` contains the case and its variation, `opened` is the open loop, and `slope` is the incremental gain. `delay`
    is the additional delay compared with the case (steps).
    """

    name: str
    opened: OpenedLoop
    slope: float
    delay: float

    def learnt(self, angles: Array) -> Complex:
        """Return the frequency response from a correction to the resulting reduction of the error."""
        return self.opened.learnt(angles, self.slope, self.delay)

    def without_memory(self, angles: Array) -> Complex:
        """Return the frequency response of the open loop without a period memory."""
        return replace(self.opened, memories=()).response_at(angles, self.slope, self.delay)

    @property
    def stable(self) -> bool:
        """True if the closed loop without a period memory is stable."""
        return replace(self.opened, memories=()).stable(self.slope, self.delay)


def corners(
    opened: Mapping[str, OpenedLoop], limits: MarginsSpec | None, off: float, *, stable: bool = True
) -> list[Corner]:
    """Return the corners of a scenario. The first one is the nominal loop.

    `opened` maps the name of each case to its open loop. `limits` contains the incremental gains and delays. `off` is
    the largest relative error of the natural frequencies of the plant. If `stable` is True, an InputError is raised for
    a loop that is unstable without learning.
    """
    found: list[Corner] = []
    seen: set[tuple[object, ...]] = set()
    for k, (case, one) in enumerate(opened.items()):
        named = limits is not None and any(fnmatchcase(case, pattern) for pattern in limits.corners)
        slopes, late = {one.nominal}, 0.0
        if limits is None or limits.slopes is None:
            slopes |= set(one.slopes)
        elif named:
            slopes |= set(limits.slopes)
        if named and limits is not None:
            late = limits.stable_to_steps or 0.0
        for name, other in ((case, one), *(_off(case, one, off) if k == 0 else ())):
            for slope in sorted(slopes):
                for delay in sorted({0.0, late / 2, late}):
                    key = (*replace(other, memories=()).key, slope, delay)
                    if key not in seen:
                        seen.add(key)
                        found.append(Corner(name, other, float(slope), delay))
    for corner in found if stable else ():
        if not corner.stable:
            raise InputError(
                f"{corner.opened.system.case.scenario}: The loop without learning must be stable. Got an unstable loop "
                f"at {corner.name} for the gain {corner.slope:g} and {corner.delay:g} further steps of delay."
            )
    return found


def _off(case: str, opened: OpenedLoop, off: float) -> Iterator[tuple[str, OpenedLoop]]:
    """Yield four open loops with their names, in which the natural frequencies of the plant are multiplied by a factor.

    The factors are 1 - off, 1 - off / 2, 1 + off / 2 and 1 + off. Nothing is yielded if `off` is 0 or the plant is
    static.
    """
    A, B, C, D = opened.plant
    for f in (1 - off, 1 - off / 2, 1 + off / 2, 1 + off) if off and len(A) else ():
        yield f"{case}, modes {100 * (f - 1):+.3g} %", replace(opened, plant=(f * A, f * B, C, D))


LOWEST, POINTS = 1e-5, 200  # lowest angle over pi, and number of angles without the additional ones at resonances
TONES = 15  # largest number of tones of the reference in the design
MISSED = 0.01  # error of hysteresis model and inverse, as a fraction of the reference
PROBE = 1e-3  # angle over pi at which the delay is computed from the phase
LAST = 2  # smallest number of rows


@dataclass(frozen=True)
class LoopPlant(Plant):
    """All parts of a loop except the controller, as a plant with static gain 1.

    `opened` is the open loop with a controller of gain 1. `more` is the additional delay compared with the case
    (steps).
    """

    opened: OpenedLoop | None = field(default=None, repr=False)
    more: float = 0.0

    def response(self, z: Complex, h: float) -> Complex:
        """Return the frequency response for an incremental gain of 1, at z on the unit circle, shape (m,)."""
        assert self.opened is not None
        return self.opened.response_at(np.angle(z).ravel(), 1.0, self.more).reshape(np.shape(z))


def loop_plants(found: Sequence[Corner], slopes: tuple[float, float]) -> PlantSet:
    """Return the set of plants of the corners `found`, in which the controller has the gain 1; the first is nominal.

    `slopes` is the sector of the incremental gain, divided by the nominal incremental gain.
    """
    one: dict[tuple[str, float], Corner] = {}
    for c in found:
        one.setdefault((c.name, c.delay), c)
    plants = []
    for (name, delay), c in one.items():
        told = f"{name}, {delay:g} further step{'s' * (delay != 1)} of delay" if delay else name
        plants.append(LoopPlant(name=told, opened=c.opened, more=delay))
    h = found[0].opened.h
    poles = np.concatenate([np.linalg.eigvals(p.opened.held(p.more)[0]) for p in plants if p.opened is not None])
    base = np.geomspace(LOWEST, 1.0, POINTS) * np.pi
    angles = np.tile(np.union1d(base, beside(poles, base)), (len(plants), 1))
    response = np.array([p.response(np.exp(1j * a), h) for p, a in zip(plants, angles, strict=True)])
    return PlantSet(h, tuple(plants), slopes, angles, response)


def known(opened: OpenedLoop) -> Design:
    """Return the plant and the delay of an opened loop as data for the design of a controller structure.

    A pair of complex poles is a mode with a part of the static gain. A real pole counts as a part without dynamics. The
    delay is a whole number of steps.
    """
    A, B, C, _ = opened.plant
    f_n, zeta, share = [], [], []
    if len(A):
        poles, V = np.linalg.eig(A)
        residues = (C @ V).ravel() * np.linalg.solve(V, B.astype(complex)).ravel()
        for p, c in zip(poles, residues, strict=True):
            if p.imag > 0:
                f_n.append(float(abs(p) / (2 * np.pi)))
                zeta.append(float(-p.real / abs(p)))
                share.append(float((2 * -c / p).real))
        order = np.argsort(f_n)
        f_n, zeta, share = ([v[i] for i in order] for v in (f_n, zeta, share))
    modes = Plant(tuple(f_n), tuple(zeta), tuple(share))
    angle = np.array([PROBE * np.pi])
    z = np.exp(1j * angle)
    turned = float(np.angle(opened.response_at(angle) / modes.response(z, opened.h))[0])
    late = max(round(-turned / float(angle[0])), 0)
    return Design(Plant(modes.f_n, modes.zeta, modes.share, late * opened.h), opened.h, computing=0)


def aim(system: System, of: Roles) -> Aim:
    """Return the disturbances of the loop in a case: tones of the reference, model error and sensor noise.

    The model error is a fixed fraction of the tones.
    """
    h = system.case.step
    try:
        r = Native(system, [of.reference]).run()[of.reference][:: system.case.ripple]
    except Stopped:
        r = np.zeros(LAST)
    r = r[max(len(r) - _rows(system, of, h), 0) :]
    power = np.abs(np.fft.rfft(r - r.mean())) ** 2 * 2 / len(r) ** 2
    chosen = np.sort(np.argsort(power)[::-1][: min(TONES, len(power) - 1)])
    chosen = chosen[chosen > 0] if (chosen > 0).any() else np.array([1])
    sigma = [n.value("sigma")[0] for p in system.parts for n in getattr(p.graph, "nodes", ()) if n.type == "noise"]
    noise = float(np.sqrt(np.square(sigma).sum())) if sigma else 0.0
    return Aim(chosen / (len(r) * h), MISSED**2 * power[chosen], power[chosen], noise)


def _rows(system: System, of: Roles, h: float) -> int:
    """Return the number of rows in the whole periods of the reference, or in the run without a whole period."""
    frequency, _ = reference_of(system, of)
    rows = round(system.case.stop / h)
    whole = int(rows * h * frequency) / frequency if frequency and rows * h * frequency >= 1 else rows * h
    return max(round(whole / h), LAST)


def sector(opened: Mapping[str, OpenedLoop], stated: Sequence[float] | None, nominal: float) -> tuple[float, float]:
    """Return the sector of the incremental gain, divided by the nominal incremental gain. The sector contains 1.

    The values are those in `stated` (table `[margins]`), or else those along the paths of the cases.
    """
    found = [v / nominal for v in stated or [v for o in opened.values() for v in o.slopes]]
    return min(*found, 1.0), max(*found, 1.0)
