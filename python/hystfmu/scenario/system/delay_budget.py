"""The delay budget of a system: every hold and every delayed value, from order, wiring and rates."""

from __future__ import annotations

from dataclasses import dataclass

from hystfmu.scenario.system.system import System


@dataclass(frozen=True)
class Delay:
    """Delay of a signal: `steps` of the base step, on the connection or in the unit `where`."""

    where: str
    steps: float
    text: str


def delay_budget(system: System) -> list[Delay]:
    """Every delay in the system, from coupling, order, wiring and rates: held values, delay blocks, the command.

    A connection to a unit that is earlier in the order carries the value of the last step; with Jacobi coupling every
    connection does, with iterative coupling none. For a unit without direct feed-through (a plant with dynamics) this
    value is the command since its sample: there is no delay except the hold. For a unit with direct feed-through it is
    one step late. A straight line through the last two values compensates both to first order.
    """
    owner = {p.first + i: (k, n) for k, p in enumerate(system.parts) for i, n in enumerate(p.outputs)}
    ripple = system.case.ripple
    found: list[Delay] = []
    for link in system.links:
        to, (k, name) = system.parts[link.to], owner[link.source]
        source = system.parts[k]
        if system.fresh(link):
            continue
        where = f"{source.name}.{name} -> {to.name}.{to.inputs[link.input]}"
        held = source.period / ripple
        if to.hold == "first":
            found.append(Delay(where, 0.0, "one step late, made up for by a straight line through the last two values"))
        elif system.feeds_through(to, link.input):
            why = "all units read first" if k < link.to else "the reader stands earlier in the order"
            found.append(Delay(where, held, f"one step of its source late: {why}"))
        else:
            found.append(Delay(where, held / 2, "held between samples: half a step on average"))
    for part in system.parts:
        for node in part.graph.nodes:
            if node.type == "delay":
                steps = node.dims["n"] * part.period / ripple
                found.append(Delay(part.name, steps, f"delay block of {node.dims['n']} steps of the unit"))
    return found
