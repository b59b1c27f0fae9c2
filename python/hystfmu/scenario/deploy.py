"""Export the controller of a loop: the units from reference and measured output to the command.

The plant is the unit whose output the first metric with `against` evaluates. Some units upstream of the plant belong to
the actuator side of the plant: units at the rate of the plant, converters, delays for computing time, and amplifiers.
The sensor side consists of the units downstream of the plant whose inputs come only from the plant and from sources of
noise. The controller consists of all units upstream of the command.

The controller is written as one graph with the ports r, y and u, as an FMU, or as C files. The inputs are the measured
output `y` and the outputs of sources that are connected to the controller. The inputs from the reference have the names
`r`, `r_ahead`, `r_dot` and `r_ddot`. An input from any other source has the name `unit_output`. A value at the input
`u_present` starts a bumpless transfer to this controller (see the block `bumpless_transfer`). Without this value, the
output is bit-identical to the command in the scenario.
"""

import re
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from hystfmu.base import InputError, together, write_bytes
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.model import Model
from hystfmu.scenario.outcome.metrics import unit_of
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import Link, Part, System, behind, build, fuse

LATE = {"delay", "quantiser"}  # blocks that represent converters and computing time
NOISE = {"noise", "disturbance"}


@dataclass(frozen=True)
class ControlSide:
    """Indices of the units of a controller in the order of the scenario, and the boundary of the controller.

    `command` and `measured` are the indices of the command and of the measured output among the values of the system.
    Without feedback, `measured` is None. `actuated` contains the plant, followed by the units between command and
    plant. `sensed` contains the plant and the units that measure the output of the plant. `bounds` contains the
    connections from outside into the controller, in the order of its units. If `early` is True, the controller precedes
    the plant in the order, so that its input is the measured output of the previous step.
    """

    units: tuple[int, ...]
    command: int
    actuated: tuple[int, ...]
    measured: int | None
    sensed: frozenset[int]
    bounds: tuple[Link, ...]
    early: bool


def control_side(system: System) -> ControlSide:
    """Return the units of the controller in a loop, and the boundary of the controller.

    Raises
    ------
    InputError
        No metric has `against`, so that the plant is unknown. The loop does not have exactly one command, or it has
        several measured outputs. Units of the controller have different rates. A unit of the controller is a foreign
        FMU or runs at the rate of the plant. The coupling scheme does not use the order of the units.
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
        self.into = [[n for n in system.links if n.to == k] for k in range(len(system.parts))]
        self.sources = {k for k, p in enumerate(system.parts) if is_source(p)}

    @cached_property
    def plant(self) -> int:
        metric = self.system.case.tracked
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
        units, measured = tuple(sorted(inside)), read[0] if read else None
        return ControlSide(units, command, actuated, measured, sensed, tuple(bounds), fresh == {False})

    def _fine(self, k: int) -> bool:
        return self.system.parts[k].period < self.system.case.ripple

    def _drivers(self, k: int) -> list[int]:
        """Return the indices of the values that are connected to the inputs of a unit, except noise.

        Outputs of sources are omitted if the unit also has inputs from other units.
        """
        read = {n.source for n in self.into[k]}
        driven = sorted(s for s in read if self.owner[s] not in self.sources)
        return driven or sorted(s for s in read if not is_noise(self.system.parts[self.owner[s]]))

    def _command(self) -> tuple[int, tuple[int, ...]]:
        """Return the command, and the units between the command and the plant."""
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
        """Return the plant, and the units downstream of it whose other inputs, if any, come from sources of noise."""
        found = {self.plant}
        noise = {k for k in self.sources if is_noise(self.system.parts[k])}
        while new := {k for k in range(len(self.into)) if k not in found and self._measures(k, found, noise)}:
            found |= new
        return frozenset(found)

    def _measures(self, k: int, sensed: set[int], noise: set[int]) -> bool:
        read, fine = {self.owner[n.source] for n in self.into[k]}, self._fine(k)
        if not read & sensed or read - sensed - (self.sources if fine else noise):
            return False
        return fine or bool(read & noise) or types(self.system.parts[k]) <= LATE

    def _control(self, command: int, sensed: frozenset[int]) -> tuple[set[int], list[Link]]:
        """Return all units upstream of the command, and the connections from measured outputs and sources to them."""
        given, home = {*self.sources, *sensed}, self.owner[command]
        upstream = [(n.to, self.owner[n.source]) for n in self.system.links if self.owner[n.source] not in given]
        units = behind(upstream, home) | {home}
        for part in (self.system.parts[k] for k in sorted(units)):
            if isinstance(part.graph, Foreign):
                raise InputError(f"{self.where}: Its units must be blocks, models or graphs. Got the FMU {part.name}.")
            if (part.substeps, part.hold) != (1, "zero"):
                raise InputError(f"{self.where}: {part.name} must have one step and hold its inputs. Got substeps.")
        return units, [n for n in self.system.links if n.to in units and self.owner[n.source] in given]

    def _check_rates(self, units: set[int]) -> None:
        periods = {self.system.parts[k].period for k in units}
        if len(periods) > 1:
            rates = ", ".join(
                f"{p.name} {self.system.length(p):g} s" for p in (self.system.parts[k] for k in sorted(units))
            )
            raise InputError(f"{self.where}: Its units must have one step. Got {rates}.")


def types(part: Part) -> set[str]:
    """Return the types of the blocks in a unit, or an empty set for a foreign FMU."""
    return {n.type for n in part.graph.nodes} if isinstance(part.graph, Graph) else set()


def is_source(part: Part) -> bool:
    """Return whether a unit is a source, that is, has no connected input and contains a source block."""
    if not isinstance(part.graph, Graph):
        return False
    return not part.inputs and any(n.block.family == "sources" for n in part.graph.nodes)


def is_noise(part: Part) -> bool:
    """Return whether a unit is a source of noise or of a disturbance."""
    return is_source(part) and bool(types(part) & NOISE)


def acts_on_plant(part: Part) -> bool:
    """Return whether a unit is a converter, a delay for computing time, or an amplifier."""
    found = types(part)
    return bool(found) and (found <= LATE or "amplifier" in found)


def controls(system: System, k: int) -> bool:
    """Return whether a unit is a controller or an inverse. The upstream search from the plant ends at such a unit."""
    part = system.parts[k]
    if isinstance(part.graph, Foreign):
        return False
    if system.case.units[part.name].inverse_of is not None:
        return True
    return any(n.block.family in ("controllers", "inverses") for n in part.graph.nodes)


NOT_GIVEN = 1e300  # value of `u_present` that means "no value", like an infinite limit
HANDOVER_STEPS = 1000  # default duration of a bumpless transfer (steps)
PORTS = {"r": "r", "r_lead": "r_ahead", "dr_lead": "r_dot", "ddr_lead": "r_ddot"}
_RATES = {"r_dot": "/s", "r_ddot": "/s2"}


@dataclass(frozen=True)
class Controller:
    """The controller of a case, as one model.

    Attributes
    ----------
    model : Model
        Graph of the controller, with the sampling step of the controller.
    case : Case
    signals : dict of str to str
        Maps the name of each port to the corresponding output of the scenario, `unit.output`.
    units : tuple of str
        Units of the scenario inside the controller.
    left_out : tuple of str
        Units of the scenario outside the controller.
    """

    model: Model
    case: Case
    signals: dict[str, str]
    units: tuple[str, ...]
    left_out: tuple[str, ...]


def controller(case: Case) -> Controller:
    """Return the controller of a case as one model.

    Raises
    ------
    InputError
        The loop is not suitable (see `control_side`), or the units form an algebraic loop in one graph.
    """
    system = build(case)
    side = control_side(system)
    step = {system.length(system.parts[k]) for k in side.units}.pop()
    graph, signals = _graph(system, side, step)
    names = tuple(system.parts[k].name for k in side.units)
    model = Model(case.scenario, graph, step, _text(system, side))
    return Controller(model, case, signals, names, tuple(n for n in case.order if n not in names))


def _text(system: System, side: ControlSide) -> str:
    names = ", ".join(system.parts[k].name for k in side.units)
    steps = _late(system, side)
    acts = f"its design has u act {steps:g} step{'' if steps == 1 else 's'} after the sample" if steps else ""
    return f"Controller of {system.case.title} ({names})" + (f"; {acts}" if acts else "")


def _late(system: System, side: ControlSide) -> float:
    """Return the sum of the delays between command and plant (steps), which are not part of the controller."""
    between = [system.parts[k] for k in side.actuated[1:]]
    graphs = [(p.graph, p.period) for p in between]
    late = sum(n.dims["n"] * t for g, t in graphs if isinstance(g, Graph) for n in g.nodes if n.type == "delay")
    return late / system.parts[side.units[0]].period


@dataclass(frozen=True)
class _Source:
    """An input of the controller, with the corresponding output of the scenario."""

    name: str
    unit: str
    text: str
    end: str


def _graph(system: System, side: ControlSide, step: float) -> tuple[Graph, dict[str, str]]:
    fused, outside = fuse(system, side.units)
    by_input = {(n.to, n.input): n.source for n in side.bounds}
    names = system.names
    sources = _sources(system, side)
    inputs: list[Input] = []
    taken: dict[str, list[str]] = {}
    for at, port in zip(outside, fused.inputs, strict=True):
        if at in by_input:
            taken.setdefault(sources[by_input[at]].name, []).extend(port.to)
        # the input is constant, with another value than an unconnected input
        elif any(port.start != _start(fused, end) for end in port.to):
            inputs.append(replace(port, text=f"{port.start:g} in the scenario"))
    known = {s.name: s for s in sources.values()}
    first = [Input(name, tuple(taken[name]), s.unit, text=s.text) for name, s in known.items() if name in taken]
    command = names[side.command]
    unit = unit_of(system, command) or _plant_unit(system, side)
    parts = [system.parts[k] for k in side.units]
    home = {f"{p.name}_{n.name}": p.name for p in parts for n in p.own.nodes}
    whole = Graph(fused.nodes, fused.wires, [*first, *inputs], fused.outputs, sort=False)
    graph = _with_handover(whole, command.replace(".", "_", 1), unit, HANDOVER_STEPS * step, home)
    signals = {name: s.end for name, s in known.items() if name in taken} | {"u": command}
    return _shorter(graph, parts), signals


def _start(graph: Graph, end: str) -> float:
    """Return the value of an unconnected input of a block."""
    block, _, variable = end.partition(".")
    rows = {v.name: v for v in graph.node(block).block.of("input")}
    return rows[variable.partition("[")[0]].start


def _plant_unit(system: System, side: ControlSide) -> str:
    """Return the unit of measure of the input of the plant, if it is stated."""
    last = system.parts[side.actuated[-1]]
    link = next(n for n in system.links if n.to == side.actuated[-1] and n.source == side.command)
    return unit_of(system, f"{last.name}.{last.inputs[link.input]}")


def _sources(system: System, side: ControlSide) -> dict[int, _Source]:
    """Return the inputs of the controller by the indices of their values. The first inputs are r and y."""
    read = sorted({n.source for n in side.bounds})
    owner, names = {place: system.parts[k] for place, k in system.owners.items()}, system.names
    tracked = system.case.tracked
    assert tracked is not None
    measure = unit_of(system, names[side.measured]) if side.measured is not None else ""
    measure = measure or unit_of(system, tracked.signal)
    reference = _reference(system, tracked.against, [owner[p] for p in read if p != side.measured])
    ahead = system.length(owner[side.measured]) if side.early and side.measured is not None else 0.0
    found: dict[int, _Source] = {}
    for place in read:
        part, end = owner[place], names[place]
        own = end.partition(".")[2]
        if is_noise(part):
            raise InputError(f"{system.case.where}: controller: It must not read noise. Got {end}.")
        if place == side.measured:
            found[place] = _Source("y", measure, f"measured output ({end} of the scenario)", end)
        elif part is reference and (types(part) == {"reference"} or end == tracked.against):
            lead = _lead(part, own)
            name = "r" if own == "r_lead" and lead == 0 else PORTS.get(own, "r")
            rate = measure and measure + _RATES.get(name, "")
            found[place] = _Source(name, rate, _reference_text(name, lead + ahead, end), end)
        else:
            text = f"{system.case.units[part.name].text} ({end} of the scenario)".removeprefix(" ")
            found[place] = _Source(f"{part.name}_{own}", unit_of(system, end), text, end)
    order = ["r", "y", *PORTS.values()]
    ranked = sorted(found.items(), key=lambda item: order.index(item[1].name) if item[1].name in order else len(order))
    return dict(ranked)


def _reference(system: System, against: str | None, read: list[Part]) -> Part | None:
    """Return the source of the reference: the unit in `against`, or the first unit of `read` with a reference block."""
    named = next(p for p in system.parts if against is not None and against.startswith(f"{p.name}."))
    if is_source(named):
        return named
    return next((p for p in read if "reference" in types(p)), None)


def _lead(part: Part, output: str) -> float:
    """Return the preview time of an output of a reference block (s)."""
    if types(part) != {"reference"} or output == "r":
        return 0.0
    return float(part.own.nodes[0].value("lead")[0])


def _reference_text(name: str, lead: float, end: str) -> str:
    what = {"r_dot": "first derivative of the wanted output", "r_ddot": "second derivative of the wanted output"}
    when = f" {lead:.6g} s ahead of the sample" if lead else ""
    hint = "; if the future value is not known, set the value of r" if name == "r_ahead" else ""
    return f"{what.get(name, 'wanted output')}{when} ({end} of the scenario){hint}"


def _with_handover(graph: Graph, output: str, measure: str, seconds: float, home: dict[str, str]) -> Graph:
    """Insert the bumpless transfer after the command, or in front of a unit that only limits the command.

    Inputs of later blocks that were connected to this signal are connected to the output of the bumpless transfer.
    `home` maps each block to its unit.
    """
    command = next(o.source for o in graph.outputs if o.name == output)
    end = _before_limits(graph, command, home)
    names = [n.name for n in graph.nodes]
    last = max(i for i, name in enumerate(names) if home[name] == home[_block(end)])
    node, later = Node("handover", "bumpless_transfer", {}, {"T": seconds}), set(names[last + 1 :])
    wires = [("handover.u" if a == end and _block(b) in later else a, b) for a, b in graph.wires]
    text = "present command of the device, for a start without a jump; 1e300: none"
    inputs = [*graph.inputs, Input("u_present", ("handover.u_present",), measure, NOT_GIVEN, text)]
    outputs = [Output("u", "handover.u" if command == end else command, measure, "command")]
    nodes = [*graph.nodes[: last + 1], node, *graph.nodes[last + 1 :]]
    return Graph(nodes, [*wires, (end, "handover.u_c")], inputs, outputs, sort=False)


def _block(end: str) -> str:
    return end.partition(".")[0]


def _before_limits(graph: Graph, command: str, home: dict[str, str]) -> str:
    """Return the signal in front of a unit that only limits the command.

    Return the command if there is no such unit, or if such a unit precedes its source in the order.
    """
    node, order = graph.node(_block(command)), [n.name for n in graph.nodes]
    alone = list(home.values()).count(home[node.name]) == 1 and node.type == "scaling" and node.sizes["u"] == 1
    if not alone or (node.value("gain")[0], node.value("offset")[0]) != (1.0, 0.0):
        return command
    source = next((a for a, b in graph.wires if _block(b) == node.name), command)
    return source if order.index(_block(source)) < order.index(node.name) else command


def _shorter(graph: Graph, parts: list[Part]) -> Graph:
    """Return short names for blocks: a single block of a unit gets the name of the unit."""
    new = {f"{p.name}_{p.own.nodes[0].name}": p.name for p in parts if len(p.own.nodes) == 1}

    def renamed(end: str) -> str:
        block, dot, rest = end.partition(".")
        return new.get(block, block) + dot + rest

    nodes = [Node(renamed(n.name), n.type, n.dims, n.values) for n in graph.nodes]
    wires = [(renamed(a), renamed(b)) for a, b in graph.wires]
    inputs = [replace(i, to=tuple(map(renamed, i.to))) for i in graph.inputs]
    outputs = [replace(o, source=renamed(o.source)) for o in graph.outputs]
    return Graph(nodes, wires, inputs, outputs, sort=False)


def write_target(case: Case, folder: str | Path, name: str | None = None) -> tuple[list[Path], Controller]:
    """Write the controller of a case as a header and one C file, which uses neither FMI nor memory allocation.

    `name` is the name of the files and the prefix of every public symbol. The default is the name of the scenario. An
    InputError is raised if the controller cannot be separated from the case, the name is not valid in C, or a file
    cannot be written.
    """
    from hystfmu.fmu.write.sources import target_files

    found, name = controller(case), case.scenario if name is None else name
    if not re.fullmatch("[A-Za-z][A-Za-z0-9_]*", name):
        raise InputError(f"The name must be a letter followed by letters, digits or _. Got {name!r} instead.")
    assert found.model.step is not None
    files = target_files(found.model.graph, name, found.model.step, found.model.text)
    with together():
        for file, content in files.items():
            write_bytes(Path(folder) / file, content)
    return [Path(folder) / file for file in files], found
