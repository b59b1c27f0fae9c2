"""Roles of the signals of a loop, from its connections and not from the names of its units."""

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
        Output that is limited; empty: the command itself.
    low, high : float
        Limits; -1e300 and 1e300 mean no limit.
    keys : (str, str)
        Their names in `set` of a case.
    clipped : bool
        The signal is limited, not stopped: it has reached a limit if it is within a millionth of the range.
    """

    signal: str
    low: float
    high: float
    keys: tuple[str, str]
    clipped: bool = False

    def ends(self, said: Mapping[str, Any]) -> tuple[float, float]:
        """Return the limits of the signal, with the values that `set` of a case states."""
        low, high = (float(said.get(k, v)) for k, v in zip(self.keys, (self.low, self.high), strict=True))
        inside = INSIDE * (high - low) if self.clipped and high - low < NONE else 0.0
        return low + inside, high - inside


@dataclass(frozen=True)
class Roles:
    """Signals of a loop, as a scenario names them.

    Attributes
    ----------
    reference : str
        Output with which the tracked one is compared.
    measured : str
        Tracked output as the controllers read it, behind the sensor and its converter.
    command : str
        Input that the controllers drive: that of the inverse, or without one that of the plant side.
    driver : str
        Output that is connected to it.
    sources : tuple of str
        Units of the block `reference` from which the reference comes.
    limits : tuple of Limit
        Of the command.
    """

    reference: str
    measured: str
    command: str
    driver: str
    sources: tuple[str, ...]
    limits: tuple[Limit, ...] = field(default=(), compare=False)


def roles(opened: OpenedLoop) -> Roles:
    """Find the roles of the signals of an opened loop.

    Units between plant and controllers that branch without a signal that all controllers read are refused.
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
    """Follow the tracked output through units that do not depend on the reference, up to the first unit that does."""
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
    """Yield the limits of the controllers' command, and those of units between it and the plant."""
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
