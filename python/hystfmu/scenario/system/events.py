"""Events of references and disturbances: discontinuities, kinks and reversals, known before the run.

With `events = "located"`, a step ends on each event between two communication points. If the steps of a unit cannot be
divided, the outputs of the unit are constant until its next grid point. If such a unit is a source, its event takes
effect at the next grid point of the source, and the function `missed` reports this time. A discontinuity needs two step
ends, the first one directly before it. Otherwise the discontinuity would take effect at the beginning of the step in a
unit that uses the values at the end of the step.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.graph import Node
from hystfmu.scenario.system.case import MOST_STEPS
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import Part, System

NEAR = 1e-9  # relative tolerance of a time, as in `hyst_reached` of the core; here also relative to the step
SHORTEST = 2e-12  # shortest step (s); own FMUs accept steps from 1e-12 s on

Values = Callable[[Part, Node, str], Array]
"""Return the present values of a parameter of a block of a unit."""


@dataclass(frozen=True)
class Event:
    """Increasing times (s) at which an output of a source has a discontinuity, a kink or a reversal.

    `parameter` is the name of the parameter that determines the times, for messages. `shift` is the preview time of the
    output (s), by which `times` are earlier than the events of the reference. It increases the rounding errors of the
    times in the block.
    """

    part: Part
    parameter: str
    times: Array
    discontinuity: bool
    shift: float = 0.0


def in_file(part: Part, node: Node, name: str) -> Array:
    """Return the values of the parameter `name` of a block, as stated in the scenario."""
    return node.value(name)


def missed(system: System) -> list[str]:
    """Return one line for every source with a discontinuity between two steps of the source.

    The line states the time at which the discontinuity takes effect.
    """
    lines = []
    for event in _events(system, in_file):
        part = event.part
        if not event.discontinuity or event.shift or (system.case.coupling.events == "located" and part.any_step):
            continue
        h = system.length(part) / part.substeps
        off = event.times / h
        late = event.times[np.abs(off - np.round(off)) > NEAR * (1 + off)]
        if len(late):
            name, then = f"{system.case.title}: {part.name}.{event.parameter}", math.ceil(late[0] / h) * h
            lines.append(
                f"{name}: the discontinuity at {late[0]:.9g} s is between two steps of {h:g} s "
                f"and takes effect at {then:.9g} s"
            )
    return lines


def cuts(system: System, values: Values = in_file) -> tuple[Array, Array]:
    """Return the times at which fine steps are divided.

    The function `values` returns the values of a parameter. By default, these are the values in the scenario.

    Returns
    -------
    steps : array of int64, shape (n,)
        Number of the fine step that contains each time, from 1 on, not decreasing.
    times : array, shape (n,)
        Increasing times (s), each inside of its fine step.
    """
    found = [e for e in _events(system, values) if e.part.any_step] if system.case.coupling.events == "located" else []
    if not found:
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    spans: list[tuple[float, float, float]] = []
    for e in found:
        room = np.maximum(NEAR * (system.h + np.abs(e.times) + abs(e.shift)), SHORTEST)
        after = system.rows(e.times)
        on = (system.at(after) - e.times <= room) | (e.times - system.at(after - 1) <= NEAR * e.times)
        begins = e.times - 2 * room if e.discontinuity else e.times
        spans += zip(begins[~on].tolist(), e.times[~on].tolist(), room[~on].tolist(), strict=True)
    joined: list[tuple[float, float, float]] = []  # start, end and time resolution `near` of each event (s)
    for begin, end, near in sorted(spans):
        if joined and begin - joined[-1][1] <= near:  # events closer than `near` are joined
            joined[-1] = joined[-1][0], max(joined[-1][1], end), near
        else:
            joined.append((begin, end, near))
    found_at: list[tuple[int, float]] = []
    rows = system.rows(np.array([end for _, end, _ in joined]))
    edges = zip(rows.tolist(), system.at(rows - 1).tolist(), system.at(rows).tolist(), strict=True)
    for (begin, end, near), (n, before, grid) in zip(joined, edges, strict=True):
        last = found_at[-1][1] if found_at and found_at[-1][0] == n else before
        # a discontinuity directly after a grid point or a division begins at this point
        if begin - last > near and begin < end:
            found_at.append((n, begin))
            last = begin
        end = max(end, last + near)
        if grid - end > near:
            found_at.append((n, end))
    if len(found_at) + system.n_steps > MOST_STEPS:
        raise InputError(f"{system.case.where}: more than {MOST_STEPS} fine steps and events")
    return np.array([n for n, _ in found_at], dtype=np.int64), np.array([t for _, t in found_at], dtype=np.float64)


def _events(system: System, values: Values) -> Iterator[Event]:
    """Yield the events between the start and the end of the run."""
    for part in system.parts:
        if isinstance(part.graph, Foreign):
            continue
        for node in part.graph.nodes:
            if node.type == "disturbance" and values(part, node, "step")[0] != 0:
                yield from _inside(system, part, "t_step", values(part, node, "t_step"), True)
            elif node.type == "reference":
                yield from _reference(system, part, node, values)


def _inside(
    system: System, part: Part, parameter: str, times: Array, discontinuity: bool, shift: float = 0.0
) -> Iterator[Event]:
    times = times - shift
    times = times[(times > 0) & (times < system.case.stop)]
    if len(times):
        yield Event(part, parameter, times, discontinuity, shift)


def _reference(system: System, part: Part, node: Node, values: Values) -> Iterator[Event]:
    """Yield the events of a reference block with the shape `steps`, `triangle` or `random_reversals`.

    If an output with preview is connected, its events are also included.
    """
    read = {end for end, place in system.columns.items() if place in {n.source for n in system.links}}
    inner = len(part.own.nodes) > 1  # connections inside a graph are not analysed

    def used(output: str) -> bool:
        return inner or f"{part.name}.{output}" in read

    lead = float(values(part, node, "lead")[0])
    lead_r, lead_dr, lead_ddr = used("r_lead"), used("dr_lead"), used("ddr_lead")
    parameter, times, lowest = _pieces(system, part, node, values, min(lead, 0.0), system.case.stop + max(lead, 0.0))
    yield from _inside(system, part, parameter, times, lowest == "r")
    if lead_r or lead_dr or lead_ddr:
        discontinuity = {"r": lead_r, "dr": lead_dr, "ddr": lead_ddr, "": False}[lowest]
        yield from _inside(system, part, parameter, times, discontinuity, lead)


def _pieces(system: System, part: Part, node: Node, values: Values, begin: float, end: float) -> tuple[str, Array, str]:
    """Return the times (s) at which the reference or one of its derivatives has a discontinuity.

    The first result is the name of the parameter that determines the times. The second result contains the times. The
    third result is the lowest derivative that is discontinuous: "r" (the reference itself), "dr", "ddr" or "" (none).
    """
    (shape,) = (v for v in node.block.vars if v.name == "shape")
    kind = shape.choices[int(values(part, node, "shape")[0])]
    f = float(values(part, node, "frequency")[0])
    if kind == "steps":
        levels, T = values(part, node, "levels"), float(values(part, node, "T")[0])
        return "T", np.asarray(T * (np.flatnonzero(np.diff(levels)) + 1), dtype=np.float64), "r"
    if f > 0 and 2 * f * (end - begin) > MOST_STEPS:
        raise InputError(f"{system.case.where}: {part.name}.frequency: more than {MOST_STEPS} reversals; got {f:g} Hz")
    if kind == "triangle" and f > 0:
        turns = float(values(part, node, "phase")[0]) / (2 * math.pi)
        reach = float(values(part, node, "turn")[0]) / 4 / f  # a turn-around may begin before the run, and end in it
        first = math.ceil(2 * (turns + f * (begin - reach)) - 0.5)
        halves = np.arange(first, first + math.ceil(2 * f * (end - begin + 2 * reach)) + 1, dtype=np.float64)
        extrema = (halves / 2 + 0.25 - turns) / f
        if reach > 0:  # the events are at the joints of the parabolas of the turn-arounds and the straight lines
            return "frequency", np.ravel(np.column_stack([extrema - reach, extrema + reach])), "ddr"
        return "frequency", extrema, "dr"
    if kind == "random_reversals" and f > 0:
        return "frequency", np.arange(node.dims["m"] + 1, dtype=np.float64) / (2 * f), "ddr"
    return "", np.zeros(0), ""
