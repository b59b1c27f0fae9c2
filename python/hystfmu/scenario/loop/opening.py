"""Open the loop of a case at the input of the plant or at another signal.

The units of the loop are linear, except for the hysteresis of the plant and its inverse. The incremental gain of
inverse and hysteresis in series is near 1 and depends on the path. The sector of the incremental gain is computed from
a simulation of the case.

The open loops of a scenario are compared with the limits in `[margins]`, and the margins of each case are reported.
Margins are computed once for all cases with the same loop. The sector needs an additional simulation, so only `hystfmu
margins` computes it. A loop without an inverse needs this simulation for its gain. If the simulation is long, no
margins are reported for such a loop.
"""

import functools
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import lru_cache

from hystfmu.base import InputError
from hystfmu.design.delays import StateSpace, sampled, trimmed
from hystfmu.design.repetitive import PeriodMemory, cut_memories
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.scenario.loop.opened import DELAYS, OpenedLoop
from hystfmu.scenario.loop.plant import (
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
from hystfmu.scenario.outcome.result import LoopFigures
from hystfmu.scenario.system.case import Cases
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import Link, System, behind, build, fuse

FALLING = ("sliding_mode", "super_twisting")  # blocks whose gain is largest for a small signal
COMMAND = "variation_ratio"  # kind of a metric that compares commands
LIMITED = "excess"  # output of a unit that is 0 while the command is inside the limits of an amplifier


def open_loop(system: System, slopes: tuple[float, float] | None = None, at: str = "") -> OpenedLoop:
    """Open the loop of a case at the input of the unit whose output is tracked, or at another signal.

    Parameters
    ----------
    system : System
        The case, built by `build`.
    slopes : (float, float), optional
        Sector of the incremental gain. By default it is computed from a simulation of the case.
    at : str
        Signal `unit.output` at which the loop is opened. It is disconnected from all inputs of other units.

    Raises
    ------
    InputError
        The case has no feedback, or the signal does not exist. The loop has a foreign FMU, several rates, a plant
        without linear dynamics, or units that are not linear at rest.
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
    rest = [i for i in graph.inputs if i not in measured]  # inputs that are not part of the loop
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
    """Return the state space of a controller with its first `ports` inputs, and its period memories."""
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

    Gains of 1 replace hysteresis and quantisers. Dynamics that occur only in an inverse are not replaced.
    """
    n = len(system.parts)
    if system.case.ripple == 1:  # with one rate, the order is cyclic, and the plant may be at any position
        around = sorted(around, key=lambda k: (k - plant) % n)
    straight = [replace(p, graph=as_gain(p, between[k])) if k in between else p for k, p in enumerate(system.parts)]
    return for_small_signals(fuse(replace(system, parts=tuple(straight)), tuple(around))[0])


def _measured(system: System, plant: int, graph: Graph) -> list[Input]:
    """Return the inputs of the controllers that are connected to the tracked output of the plant.

    An InputError is raised if another connected output of the plant also varies with small signals.
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
    """A graph as key of a cache. Graphs with the same bytes are equal."""

    content: bytes
    graph: Graph = field(compare=False)


@functools.lru_cache(maxsize=64)
def _tangent(controller: _Content, h: float) -> StateSpace:
    """Return the state space of a controller, which is computed once for all cases with this controller."""
    return sampled(without_limits(controller.graph), h)


def _break(controller: Graph, graph: Graph, at: str, units: Sequence[str], where: str) -> Graph:
    """Return a controller opened at the signal `at`. A new input drives the units that were connected to it."""
    unit, _, output = at.partition(".")
    source = next((o.source for o in graph.outputs if unit in units and o.name == f"{unit}_{output}"), None)
    if source is None:
        raise InputError(f"{where}: The signal must be an output of {', '.join(units)}. Got {at!r} instead.")
    own = f"{unit}_"
    later = Node("behind_break", "scaling", {"n": 1})
    maker = source.partition(".")[0]
    nodes = [m for n in controller.nodes for m in ([n, later] if n.name == maker else [n])]
    inside = {n.name for n in controller.nodes if n.name.startswith(own)}
    wires = [
        (f"{later.name}.y" if a == source and b.partition(".")[0] not in inside else a, b) for a, b in controller.wires
    ]
    first, *rest = controller.inputs
    (u,) = controller.outputs
    if wires == list(controller.wires) and u.source != source:
        raise InputError(f"{where}: A unit of the loop must read the signal. Got {at!r}, which none reads.")
    inputs = [first, Input("behind", (f"{later.name}.u",)), *rest]
    outputs = [Output("u", f"{later.name}.y" if u.source == source else u.source), Output("before", source)]
    return Graph(nodes, wires, inputs, outputs, sort=False)


def _tracked(system: System) -> str:
    """Return the signal that a metric compares with a reference."""
    tracked = system.case.tracked
    if tracked is None:
        raise InputError(f"{system.case.title}: A metric must compare an output with a reference. Got none.")
    return tracked.signal


def _outputs(system: System, within: Sequence[int]) -> list[str]:
    """Return the outputs of a loop that follow references from outside the loop."""
    names = {system.parts[k].name for k in within}
    found = {
        m.against.partition(".")[0]: m.signal
        for m in system.case.metrics.values()
        if m.against is not None and m.kind != COMMAND and m.signal.partition(".")[0] in names
    }
    return list(dict.fromkeys(y for r, y in found.items() if r not in names))


def _plant(system: System) -> int:
    """Return the unit to which the tracked output belongs."""
    name = _tracked(system).partition(".")[0]
    return next(i for i, p in enumerate(system.parts) if p.name == name)


def _loop(system: System, plant: int) -> list[int]:
    """Return the units of the feedback path of the plant, in the order of evaluation."""
    edges = system.edges
    after, before = behind(edges, plant), behind([(b, a) for a, b in edges], plant)
    if plant not in after:
        name = system.parts[plant].name
        raise InputError(
            f"{system.case.title}: The case must have feedback. Got an open loop: {name} does not act on itself."
        )
    return [k for k in range(len(system.parts)) if k in after & before]


def _input_name(system: System, link: Link) -> str:
    """Return the name of the driven input in a fused graph."""
    part = system.parts[link.to]
    return f"{part.name}_{part.inputs[link.input]}"


MOST_STEPS = 100_000  # largest number of steps in the additional simulation for the gain of a loop without an inverse


def loop_figures(system: System) -> LoopFigures | None:
    """Return the margins of the loop of a case, opened at the input of the plant, or None if there are none."""
    try:
        opened = open_loop(system, (1.0, 1.0))
        if not opened.inverted and system.n_steps > MOST_STEPS:
            return None
        return _figures(_Loop(opened.key, opened))
    except InputError:
        return None


@dataclass(frozen=True)
class _Loop:
    """An open loop as key of a cache. Loops with the same key are equal."""

    key: tuple[object, ...]
    opened: OpenedLoop = field(compare=False)


@lru_cache(maxsize=256)
def _figures(loop: _Loop) -> LoopFigures:
    found = loop.opened.margins()
    if not found.stable:
        return LoopFigures(stable=False, Ms_db=None, delay_steps=None)
    return LoopFigures(stable=True, Ms_db=found.Ms_db + 0.0, delay_steps=found.delay_steps)


@dataclass(frozen=True)
class LoopVerdict:
    """Verdict on one limit of a loop. `limit` is its key in the scenario file.

    `value` is the value of the loop, or None if the loop is unstable. `bound` is the required value. If `expected` is
    True, the scenario states that this loop is unstable.
    """

    scenario: str
    limit: str
    where: str
    value: float | None
    bound: float
    at_least: bool
    expected: bool = False

    @property
    def within(self) -> bool:
        """True if the limit is met."""
        if self.value is None:
            return self.expected
        return self.value >= self.bound if self.at_least else self.value <= self.bound

    @property
    def word(self) -> str:
        """Verdict as one word."""
        if self.expected:
            return "expected"
        return "ok" if self.within else "BROKEN"

    def line(self) -> str:
        """Return the verdict as one line."""
        side = "at least" if self.at_least else "at most"
        got = "an unstable loop" if self.value is None else f"{self.value:.4g}"
        return f"{self.scenario}: margins.{self.limit}: must be {side} {self.bound:g} at {self.where}. Got {got}."


def opened_loops(scenario: Cases) -> dict[str, OpenedLoop | InputError]:
    """Return the open loop of each case, or the reason why a case has no loop.

    If the scenario states the slopes (incremental gains), no case is simulated.
    """
    spec = scenario.spec.margins
    slopes = None if spec is None or spec.slopes is None else (spec.slopes[0], spec.slopes[1])
    found: dict[str, OpenedLoop | InputError] = {}
    for case in scenario.cases:
        try:
            found[case.name] = open_loop(build(case), slopes)
        except InputError as e:
            found[case.name] = e
    return found


def verdicts_of(scenario: Cases, opened: Mapping[str, OpenedLoop | InputError]) -> list[LoopVerdict]:
    """Compare the open loops of a scenario with its limits. The argument is the result of `opened_loops`.

    An InputError is raised for a limit of a case without a loop.
    """
    spec = scenario.spec.margins
    if spec is None:
        return []
    name, where = scenario.spec.name, f"{scenario.origin}: margins"
    case = spec.case or scenario.cases[0].name
    verdicts = []
    if spec.Ms_db is not None:
        loop = opened.get(case, InputError(""))
        if isinstance(loop, InputError):
            why = f" {loop}" if str(loop) else ""
            raise InputError(f"{where}.case: The case must have a loop. Got {case!r} instead.{why}")
        found = loop.margins()
        verdicts.append(
            LoopVerdict(name, "Ms_db", case, found.Ms_db if found.stable else None, spec.Ms_db, at_least=False)
        )
    if spec.stable_to_steps is not None:
        loops = {c: o for c, o in opened.items() if not isinstance(o, InputError)}
        corners = {c: o for c, o in loops.items() if any(fnmatchcase(c, pattern) for pattern in spec.corners)}
        if not corners:
            raise InputError(f"{where}.corners: A case with a loop must have such a name. Got {spec.corners} instead.")
        reached: dict[str, float] = {}
        kept: dict[tuple[object, ...], float] = {}
        for c, o in corners.items():
            wide = replace(o, slopes=(spec.slopes[0], spec.slopes[1])) if spec.slopes else o
            key = (*wide.key, wide.slopes)
            if key not in kept:
                kept[key] = wide.stable_to(sorted({*DELAYS, spec.stable_to_steps}))
            reached[c] = kept[key]
        worst = min(reached, key=lambda c: -1.0 if math.isnan(reached[c]) else reached[c])
        value = None if math.isnan(reached[worst]) else reached[worst]
        at = f"{worst}, the worst of {len(corners)}"
        verdicts.append(LoopVerdict(name, "stable_to_steps", at, value, spec.stable_to_steps, at_least=True))
    return verdicts


def stability_of(
    scenario: Cases, opened: Mapping[str, OpenedLoop | InputError], lost: Collection[str]
) -> list[LoopVerdict]:
    """Return a verdict for each case whose loop is unstable without additional delay.

    The case fails unless the scenario expects an unstable loop. `lost` contains the names of these cases: their loop is
    unstable for the nominal or for another incremental gain in the sector. `opened` is the result of `opened_loops`. An
    InputError is raised if a case that the scenario expects to be unstable is stable or does not exist.
    """
    name, expected = scenario.spec.name, scenario.spec.margins.expected_unstable if scenario.spec.margins else []
    known = {c.name for c in scenario.cases}
    for case in expected:
        if case not in known or (case in opened and case not in lost):
            why = "is stable, or has no loop" if case in known else "does not exist"
            raise InputError(
                f"{scenario.origin}: margins.expected_unstable: The case must have an unstable loop. "
                f"Got {case!r}, which {why}."
            )
    verdicts = []
    for case in lost:
        loop = opened[case]
        assert not isinstance(loop, InputError)
        at = f"{case}, sector {loop.slopes[0]:.2f} to {loop.slopes[1]:.2f}"
        verdicts.append(LoopVerdict(name, "stable_to_steps", at, None, 0.0, at_least=True, expected=case in expected))
    return verdicts
