"""Load the units of a case and connect them."""

from __future__ import annotations

import math

from hystfmu.base.errors import InputError
from hystfmu.scenario.system.case import Case, split_end
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import Link, Part, System, signals
from hystfmu.scenario.system.unit_graph import (
    SIZE,
    delayed,
    load_unit,
    parameter_names,
    scalar_names,
    sizes,
    start_values,
    with_values,
)


def build(case: Case) -> System:
    """Load the units of a case and connect them.

    Raises
    ------
    InputError
        A block, a port or a parameter is unknown, a value is out of range, or an input has no source. A path leads out
        of the folder of the scenarios. The final states of a foreign FMU are required.
    """
    parts: list[Part] = []
    columns: dict[str, int] = {}
    overridden: set[str] = set()
    for name in case.order:
        spec = case.units[name]
        where = f"{case.where}: units.{name}"
        if (size := f"{name}.{SIZE}") in sizes(case):
            overridden |= {size} & case.overrides.keys()
            steps = case.overrides.get(size, spec.set.get(SIZE))
            spec = spec if steps is None else delayed(spec, steps, case.ripple, f"{where}.set.{SIZE}")
        try:
            graph = load_unit(case, spec, where)
            graph = with_values(graph, spec.set)
            for key, value in case.overrides.items():
                unit, parameter = split_end(key, "--set")
                if unit == name and key not in overridden and parameter in parameter_names(graph):
                    graph = with_values(graph, {parameter: value})
                    overridden.add(key)
        except InputError as e:
            message = str(e)
            raise InputError(message if message.startswith(case.origin) else f"{where}: {message}") from None
        inputs, outputs = scalar_names(graph, "input"), scalar_names(graph, "output")
        for key in spec.inputs:
            if key not in inputs:
                raise InputError(f"{where}.inputs: no input {key!r}; there are {list(inputs)}")
        period = 1 if spec.fine else case.ripple * spec.every
        first = len(columns)
        columns.update({f"{name}.{o}": first + i for i, o in enumerate(outputs)})
        constants = {k: float(v) for k, v in spec.inputs.items()}
        runs_as = spec.runs_as
        driven = {split_end(to, where)[1] for to in case.connections if to.startswith(f"{name}.")}
        if spec.block is not None and not isinstance(graph, Foreign):  # a default that the table states is one
            said = zip(inputs, start_values(graph, "input"), strict=True)
            constants = {k: v for k, v in said if v != 0 and k not in driven} | constants
        if isinstance(graph, Foreign):  # an unconnected input keeps its start value
            kept = zip(inputs, start_values(graph, "input"), strict=True)
            constants = {
                k: _kept(v, f"{where}: {k}") for k, v in kept if k not in driven | constants.keys()
            } | constants
            runs_as = "fmu2" if graph.fmi == 2 else "fmu3"
        parts.append(Part(name, graph, runs_as, period, inputs, outputs, constants, first, spec.substeps, spec.hold))
    links = _links(case, parts, columns)
    system = System(case, tuple(parts), links, len(columns), columns, frozenset(overridden))
    _check_lines(system)
    if case.final_states and system.foreign:
        name = system.foreign[0].name
        raise InputError(f"{case.origin}: final_states: {name} is a foreign FMU, whose states are not known")
    where = case.where
    for key, ends in signals(case):
        for end in ends:
            system.column(end, f"{where}: {key}")
    return system


def _kept(start: float, where: str) -> float:
    """Return the start value of an unconnected input of a foreign FMU as a number."""
    if not math.isfinite(start) or float(start) != start:
        raise InputError(f"{where}: its start value {start} cannot be carried: connect it or give it a constant value")
    return float(start)


def _check_lines(system: System) -> None:
    """Check that the sources of a first-order hold step as often as the reader."""
    for link in system.links:
        part, where = system.parts[link.to], f"{system.case.where}"
        if part.hold == "zero":
            continue
        source = system.maker(link)
        if source.period > part.period:
            raise InputError(
                f"{where}: units.{part.name}.hold: 'first' needs sources that step as often; {source.name} is slower"
            )


def _links(case: Case, parts: list[Part], columns: dict[str, int]) -> tuple[Link, ...]:
    where = f"{case.where}: connections"
    index = {p.name: i for i, p in enumerate(parts)}
    links: list[Link] = []
    for to, source in case.connections.items():
        unit, port = split_end(to, where)
        if unit not in index:
            raise InputError(f"{where}: no unit {unit!r}; there are {list(index)}")
        part = parts[index[unit]]
        if port not in part.inputs:
            raise InputError(f"{where}: no input {to!r}; {unit} has {list(part.inputs)}")
        if port in part.constants:
            raise InputError(f"{where}: {to!r} is connected and has a constant value as well")
        if source not in columns:
            from_unit, _ = split_end(source, where)
            have = [c for c in columns if c.startswith(f"{from_unit}.")] or list(index)
            raise InputError(f"{where}: no output {source!r} for {to!r}; there are {have}")
        links.append(Link(index[unit], part.inputs.index(port), columns[source]))
    driven = {(link.to, link.input) for link in links}
    for i, p in enumerate(parts):
        for k, port in enumerate(p.inputs):
            if (i, k) not in driven and port not in p.constants:
                raise InputError(
                    f"{where}: nothing is connected to '{p.name}.{port}'; connect it or give it a constant value in "
                    f"units.{p.name}.inputs"
                )
    return tuple(sorted(links, key=lambda link: (link.to, link.input)))
