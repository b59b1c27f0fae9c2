"""Roles of the signals of a loop. They follow from the connections, not from the names of the units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from hystfmu.base.errors import InputError
from hystfmu.graph import Node
from hystfmu.scenario.loop.opened import OpenedLoop
from hystfmu.scenario.system.system import Link, System, behind

REFERENCE = "reference"  # block whose signal may repeat
COMMAND, RANGE = ("u_min", "u_max"), ("lo", "hi")  # limits of controllers, and of units behind them
NONE, INSIDE = 1e300, 1e-6


@dataclass(frozen=True)
class Limit:
    """A limit of the command on its way to the plant.

    Attributes
    ----------
    signal : str
        Limited output; empty for the command itself.
    low, high : float
        Limits; -1e300 and 1e300 mean no limit.
    keys : (str, str)
        Names of the limits in `set` of a case.
    clipped : bool
        Whether the signal is saturated by the limit. It has then reached a limit if its distance is at most a millionth
        of the range.
    """

    signal: str
    low: float
    high: float
    keys: tuple[str, str]
    clipped: bool = False

    def ends(self, said: Mapping[str, Any]) -> tuple[float, float]:
        """Return the limits of the signal, with the values in `set` of a case."""
        low, high = (float(said.get(k, v)) for k, v in zip(self.keys, (self.low, self.high), strict=True))
        inside = INSIDE * (high - low) if self.clipped and high - low < NONE else 0.0
        return low + inside, high - inside


@dataclass(frozen=True)
class Roles:
    """Names of the signals of a loop in a scenario.

    Attributes
    ----------
    reference : str
        Reference: output with which the tracked output is compared.
    measured : str
        Tracked output behind the sensor and its converter, as the controllers read it.
    command : str
        Input that the controllers drive: the input of the inverse, or of the plant if there is no inverse.
    driver : str
        Output that is connected to `command`.
    sources : tuple of str
        Units of the block `reference` that produce the reference.
    limits : tuple of Limit
        Limits of the command.
    """

    reference: str
    measured: str
    command: str
    driver: str
    sources: tuple[str, ...]
    limits: tuple[Limit, ...] = field(default=(), compare=False)


def roles(opened: OpenedLoop) -> Roles:
    """Find the roles of the signals of an opened loop.

    An InputError is raised if the path from the plant to the controllers branches and no single signal is read by all
    controllers.
    """
    system = opened.system
    signal, against = next((m.signal, m.against) for m in system.case.metrics.values() if m.against is not None)
    assert against is not None
    owner = {p.name: k for k, p in enumerate(system.parts)}
    plant, maker = owner[signal.partition(".")[0]], owner[against.partition(".")[0]]
    forward = [(system.owners[n.source], n.to) for n in system.links]
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


def _measured(system: System, place: int, plant: int, led: set[int]) -> int:
    """Follow the tracked output through units up to the first unit that depends on the reference."""
    forward = [(system.owners[n.source], n.to) for n in system.links]
    acting = behind([(b, a) for a, b in forward], plant)
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
    """Yield the limits of the command of the controllers, and the limits of units between command and plant."""
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
