"""The control side of a loop: the units from reference and measured output to the command.

The plant is the unit whose output the first metric with `against` evaluates. The actuator side of the plant consists of
the units upstream of the plant that belong to it: units at the rate of the plant, converters, delays for computing
time, and amplifiers. The sensor side consists of the downstream units that read only the plant and noise. The
controller consists of the units upstream of the command.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from hystfmu.base.errors import InputError
from hystfmu.graph import Graph
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import Link, Part, System

LATE = {"delay", "quantiser"}  # blocks of converters and of computing time
NOISE = {"noise", "disturbance"}


@dataclass(frozen=True)
class ControlSide:
    """The indices of the units of a controller in the order of the scenario, and the boundary of the controller.

    `command` and `measured` are indices of values; `measured` is None without feedback. `actuated` contains the units
    between command and plant, the plant first. `sensed` contains the plant and the units that measure its output. If
    `early` is True, the controller precedes the plant in the order, so that it reads the measured output of the
    previous step.
    """

    units: tuple[int, ...]
    command: int
    actuated: tuple[int, ...]
    measured: int | None
    sensed: frozenset[int]
    early: bool


def control_side(system: System) -> ControlSide:
    """Find the control side of a loop.

    Raises
    ------
    InputError
        No metric names the plant, or the number of commands or measured outputs is not one. Units of the controller
        have different rates, or a unit is a foreign FMU or runs at the rate of the plant. The coupling has no order.
    """
    case = system.case
    if case.coupling.scheme != "gauss_seidel":
        raise InputError(
            f"{case.where}: The coupling of a loop must be 'gauss_seidel' to export its controller. "
            f"Got {case.coupling.scheme!r} instead."
        )
    return _Sides(system).found()


class _Sides:
    def __init__(self, system: System) -> None:
        self.system, self.where = system, f"{system.case.where}: controller"
        self.owner, self.names = system.owners, system.names
        self.into: dict[int, list[Link]] = {k: [] for k in range(len(system.parts))}
        for link in system.links:
            self.into[link.to].append(link)
        self.sources = {k for k, p in enumerate(system.parts) if is_source(p)}

    @cached_property
    def plant(self) -> int:
        metric = next((m for m in self.system.case.metrics.values() if m.against is not None), None)
        if metric is None:
            raise InputError(f"{self.where}: A metric must have 'against', which names the plant. Got none.")
        return self.owner[self.system.columns[metric.signal]]

    def found(self) -> ControlSide:
        command, actuated = self._command()
        sensed = self._sensed()
        inside, bounds = self._control(command, sensed)
        self._check_rates(inside)
        read = sorted({n.source for n in bounds if self.owner[n.source] in sensed})
        if len(read) > 1:
            listed = ", ".join(self.names[place] for place in read)
            raise InputError(f"{self.where}: It must read one measured output. Got {listed}.")
        fresh = {self.system.fresh(n) for n in bounds if n.source in read}
        if len(fresh) > 1:
            raise InputError(
                f"{self.where}: All units that read {self.names[read[0]]} must stand after the plant in the order, or "
                "all before it. Got both."
            )
        return ControlSide(
            tuple(sorted(inside)), command, actuated, read[0] if read else None, sensed, fresh == {False}
        )

    def _fine(self, k: int) -> bool:
        return self.system.parts[k].period < self.system.case.ripple

    def _drivers(self, k: int) -> list[int]:
        """Return the values that a unit reads, except noise.

        Values of sources are omitted if there are other values.
        """
        read = {n.source for n in self.into[k]}
        driven = sorted(s for s in read if self.owner[s] not in self.sources)
        return driven or sorted(s for s in read if not is_noise(self.system.parts[self.owner[s]]))

    def _command(self) -> tuple[int, tuple[int, ...]]:
        """Search upstream from the plant; return the command and the units between it and the plant."""
        k, way, ends = self.plant, [self.plant], 0
        command = -1
        while True:
            acts = k == self.plant or self._fine(k) or acts_on_plant(self.system.parts[k])
            drivers = self._drivers(k)
            if len(drivers) != 1:
                if acts:
                    listed = ", ".join(self.names[s] for s in drivers) or "none"
                    raise InputError(f"{self.where}: One command must drive {self.system.parts[k].name}. Got {listed}.")
                break
            if acts:
                command, ends = drivers[0], len(way)
            k = self.owner[drivers[0]]
            if k in way or k in self.sources or controls(self.system, k):
                break
            way.append(k)
        if self.owner[command] in self.sources:
            name = self.system.parts[self.plant].name
            raise InputError(f"{self.where}: A controller must drive {name}. Got the source {self.names[command]}.")
        return command, tuple(way[:ends])

    def _sensed(self) -> frozenset[int]:
        """Return the plant, and the units that read only the plant and noise."""
        found = {self.plant}
        noise = {k for k in self.sources if is_noise(self.system.parts[k])}
        while new := {k for k in self.into if k not in found and self._measures(k, found, noise)}:
            found |= new
        return frozenset(found)

    def _measures(self, k: int, sensed: set[int], noise: set[int]) -> bool:
        read, fine = {self.owner[n.source] for n in self.into[k]}, self._fine(k)
        if not read & sensed or read - sensed - (self.sources if fine else noise):
            return False
        return fine or bool(read & noise) or types(self.system.parts[k]) <= LATE

    def _control(self, command: int, sensed: frozenset[int]) -> tuple[set[int], list[Link]]:
        """Return all units upstream of the command, and the connections that bring measured outputs and sources."""
        units: set[int] = set()
        bounds: list[Link] = []
        left = [self.owner[command]]
        while left:
            k = left.pop()
            if k in units:
                continue
            part = self.system.parts[k]
            if isinstance(part.graph, Foreign):
                raise InputError(f"{self.where}: Its units must be blocks, models or graphs. Got the FMU {part.name}.")
            if (part.substeps, part.hold) != (1, "zero"):
                raise InputError(f"{self.where}: {part.name} must have one step and hold its inputs. Got substeps.")
            units.add(k)
            for link in self.into[k]:
                source = self.owner[link.source]
                if source in self.sources or source in sensed:
                    bounds.append(link)
                else:
                    left.append(source)
        return units, bounds

    def _check_rates(self, units: set[int]) -> None:
        periods = {self.system.parts[k].period for k in units}
        if len(periods) > 1:
            rates = ", ".join(
                f"{p.name} {self.system.length(p):g} s" for p in (self.system.parts[k] for k in sorted(units))
            )
            raise InputError(f"{self.where}: Its units must have one step. Got {rates}.")


def types(part: Part) -> set[str]:
    """Return the types of the blocks of a unit; empty for a foreign FMU."""
    return {n.type for n in part.graph.nodes} if isinstance(part.graph, Graph) else set()


def is_source(part: Part) -> bool:
    """Return whether a unit is a source: it reads no other unit and has a source block."""
    if not isinstance(part.graph, Graph):
        return False
    return not part.inputs and any(n.block.family == "sources" for n in part.graph.nodes)


def is_noise(part: Part) -> bool:
    """Return whether a unit is a source of noise or of a disturbance."""
    return is_source(part) and bool(types(part) & NOISE)


def acts_on_plant(part: Part) -> bool:
    """Return whether a unit at the rate of the controller is hardware: converter, computing time or amplifier."""
    found = types(part)
    return bool(found) and (found <= LATE or "amplifier" in found)


def controls(system: System, k: int) -> bool:
    """Return whether a unit is a controller or an inverse, where the upstream search from the plant ends."""
    part = system.parts[k]
    if isinstance(part.graph, Foreign):
        return False
    if system.case.units[part.name].inverse_of is not None:
        return True
    return any(n.block.family in ("controllers", "inverses") for n in part.graph.nodes)


def boundary(system: System, side: ControlSide) -> Iterator[Link]:
    """Yield the connections into the controller from outside, in the order of its units."""
    inside = {system.parts[k].first + i for k in side.units for i in range(len(system.parts[k].outputs))}
    return (n for n in system.links if n.to in side.units and n.source not in inside)
