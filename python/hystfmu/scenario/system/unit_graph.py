"""The graph (or foreign FMU) of one unit of a scenario, and changes of its parameters.

Parameters have the names of the variables in an FMU. The size of a block is a part of its structure and cannot be set.
A unit of the block `delay` is an exception (`--set delay.n=1.3`), so that cases and studies can vary the delay of a
loop. A fraction of a step is a number of fine steps. With 0 the unit becomes a connection.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.base.files import read_bytes
from hystfmu.graph import Graph, Node, Port, Value
from hystfmu.model import Model
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.folders import inside
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.spec import UnitSpec

SIZE = "n"


def sizes(case: Case) -> set[str]:
    """Return the settings ``"unit.n"`` of a case that change the structure of a unit."""
    return {f"{name}.{SIZE}" for name, spec in case.units.items() if spec.block == "delay"}


def delayed(spec: UnitSpec, steps: object, ripple: int, where: str) -> UnitSpec:
    """Return the unit of a delay with another number of steps. Errors begin with `where`.

    In steps of the scenario, the delay is a multiple of 1 / `ripple`. An InputError is raised if the value is not a
    number, is negative, or is not a multiple of a fine step.
    """
    parts = ripple if spec.every == 1 and not spec.fine else 1
    count = parts * steps if isinstance(steps, int | float) and not isinstance(steps, bool) else -1.0
    whole = round(count) if 0 <= count <= 1e9 else -1
    if whole < 0 or abs(count - whole) > 1e-6:
        raise InputError(f"{where}: must be a number of steps of at least 0, in steps of {1 / parts:g}. Got {steps!r}.")
    rest = {k: v for k, v in spec.set.items() if k != SIZE}
    if whole == 0:
        return spec.model_copy(update={"block": "scaling", "dims": {"n": 1}, "values": {}, "set": {}})
    if whole % parts == 0:
        return spec.model_copy(update={"dims": {SIZE: whole // parts}, "set": rest})
    return spec.model_copy(update={"dims": {SIZE: whole}, "fine": True, "set": rest})


def load_unit(case: Case, spec: UnitSpec, where: str) -> Graph | Foreign:
    """Return the graph of a unit of a case, before `set` and overrides. Errors begin with `where`.

    An InputError is raised if a file is invalid or outside the folder of the case, if a block or a parameter is
    unknown, or if a value is out of range.
    """
    if spec.fmu is not None:
        return _foreign(case, spec.fmu, f"{where}.fmu")
    if spec.model is not None:
        return _model(case, spec.model, f"{where}.model").graph
    if spec.inverse_of is not None:
        from hystfmu.inverse import invert  # the method's own imports stay out of scenarios that do not use it

        return invert(_model(case, spec.inverse_of, f"{where}.inverse_of"), "exact").graph
    if spec.block is not None:
        return Graph.single(Node(spec.block, spec.block, spec.dims, spec.values))
    assert spec.graph is not None
    return spec.graph.graph()


def with_files(case: Case) -> Case:
    """Return the case with the loaded models and FMUs of its units. It needs no files, as confinement requires."""
    read: dict[str, Model | Foreign] = {}
    for name, spec in case.units.items():
        where = f"{case.where}: units.{name}"
        if spec.fmu is not None:
            read[spec.fmu] = _foreign(case, spec.fmu, f"{where}.fmu")
        read |= {m: _model(case, m, where) for m in (spec.model, spec.inverse_of) if m is not None}
    return replace(case, attached={**case.attached, **read})


def _foreign(case: Case, relative: str, where: str) -> Foreign:
    """Return the FMU of a path of the case."""
    attached = case.attached.get(relative)
    return attached if isinstance(attached, Foreign) else Foreign.load(_path(case, relative, where))


def _model(case: Case, relative: str, where: str) -> Model:
    """Return the model of a path of the case."""
    attached = case.attached.get(relative)
    if isinstance(attached, Model):
        return attached
    path = _path(case, relative, where)
    return _parsed(path, read_bytes(path))


@lru_cache(maxsize=16)
def _parsed(path: Path, content: bytes) -> Model:
    """Return the model in a file. It is read once for all cases, and again if the file changes."""
    return Model.load(path)


def _path(case: Case, relative: str, where: str) -> Path:
    """Return the file of a path of the case."""
    attached = case.attached.get(relative)
    if isinstance(attached, Path):
        return attached
    if case.folder is None:
        raise InputError(f"{where}: {relative!r} is not attached to the scenario")
    return inside(case.folder, relative, where)


def scalar_names(graph: Graph | Foreign, kind: str) -> tuple[str, ...]:
    """Return the names of the scalar variables of the kind "input" or "output", in the order of the ports."""
    return tuple(n for p in graph.ports if p.kind == kind for n in p.scalar_names)


def start_values(graph: Graph | Foreign, kind: str) -> list[float]:
    """Return the start values of the scalar variables of the kind "input" or "output", in the order of the ports."""
    return [s for p in graph.ports if p.kind == kind for s in p.start]


def first_outputs(graph: Graph | Foreign) -> list[float]:
    """Return the scalar outputs before any input is known.

    Earlier units read the initial outputs of delays. All other outputs have their start values.
    """
    if isinstance(graph, Foreign):
        return start_values(graph, "output")
    outputs = [p for p in graph.ports if p.kind == "output"]
    nodes = graph.nodes
    known = {p.name for p in outputs if nodes[p.node].block.rate == "sampled" and not nodes[p.node].feeds_through()}
    if not known:
        return start_values(graph, "output")
    executor = graph.executor()
    executor.start(0.0)
    return [executor.get(p.reference + i) if p.name in known else s for p in outputs for i, s in enumerate(p.start)]


def parameter_names(graph: Graph | Foreign) -> set[str]:
    """Return every name that `set` may use: names of parameters and of their elements."""
    if isinstance(graph, Foreign):
        settable = ("parameter", "structuralParameter")
        return {v.name for v in graph.description.modelVariables if v.causality in settable}
    ports = [p for p in graph.ports if p.is_parameter]
    return {p.name for p in ports} | {n for p in ports for n in p.scalar_names}


def with_values(graph: Graph | Foreign, values: dict[str, Any]) -> Graph | Foreign:
    """Return the unit with some parameters changed, by their names in an FMU (`w`, `w_2`, `net_W1`)."""
    if isinstance(graph, Foreign):
        return graph.with_settings(values)
    for name, value in values.items():
        port, element = _parameter(graph, name)
        node = graph.nodes[port.node]
        graph = graph.replace(node.with_values(**{port.var.name: _changed(node, port, element, value)}))
    return graph


def changed(graph: Graph, name: str, value: object) -> tuple[Port, int, list[float]]:
    """Compute a parameter after a change by `set` of a scenario.

    Return the port of the parameter, the index of the first changed element, and the new values from this element on.
    """
    port, element = _parameter(graph, name)
    node = graph.nodes[port.node]
    new = node.with_values(**{port.var.name: _changed(node, port, element, value)})
    values = new.value(port.var.name).tolist()
    return (port, 0, values) if element is None else (port, element, values[element : element + 1])


def _parameter(graph: Graph, name: str) -> tuple[Port, int | None]:
    parameters = [p for p in graph.ports if p.is_parameter]
    for p in parameters:
        if name == p.name:
            return p, None
        if name in p.scalar_names:
            return p, p.scalar_names.index(name)
    raise InputError(f"no parameter {name!r}; there are {', '.join(p.name for p in parameters)}")


def _changed(node: Node, port: Port, element: int | None, value: object) -> Value:
    old = node.value(port.var.name)
    if isinstance(value, str) and value.startswith("*"):
        try:
            new: object = old * float(value[1:])
        except ValueError:
            raise InputError(f"{port.name}: after '*' stands a number; got {value!r}") from None
        if element is not None:
            new = float(np.asarray(new)[element])
    else:
        new = value
    if element is None:
        return new  # type: ignore[return-value]  # Node checks kind, length and range
    if not isinstance(new, int | float):
        raise InputError(f"{port.name}: one element takes one number; got {value!r}")
    old[element] = new
    return old
