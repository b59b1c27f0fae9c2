"""The cases of a scenario. Every `[[case]]` overrides keys of the scenario.

The values of a case are checked before models are loaded.

All other modules use only complete cases. The function `load_unit` returns the graph (or foreign FMU) of a unit in a
case. Parameters of a unit have the names of the variables in an FMU. The size of a block is a part of its structure, so
a case cannot set it. An exception is the number of steps of the block `delay` (`--set delay.n=1.3`), so that cases and
studies can vary the delay of a loop. A fraction of a step must be a whole number of fine steps. If the delay is 0, a
connection replaces the unit.
"""

import copy
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from hystfmu.base import InputError, read_bytes
from hystfmu.graph import Graph, Node, Port, Value
from hystfmu.model import Model
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.spec import (
    CaseSpec,
    CouplingSpec,
    MetricSpec,
    ScenarioSpec,
    Scheme,
    TubeSpec,
    UnitSpec,
    inside,
    read_scenario,
)

_SAME = ("step", "ripple", "delay", "tolerance", "guard", "tube", "final_states")  # keys that no case overrides
MOST_STEPS = 20_000_000  # largest number of fine steps in one case
NAME = r"[A-Za-z][A-Za-z0-9_]*"
_END = re.compile(rf"({NAME})\.(\S(?:.*\S)?)\Z")  # a foreign FMU may have structured names, such as arm.q[2]


@dataclass(frozen=True)
class Case:
    """One complete case of a scenario."""

    scenario: str
    name: str
    folder: Path | None
    """Folder of the files. None if the case was built in Python and uses the content of `attached`."""
    step: float
    stop: float
    order: tuple[str, ...]
    coupling: CouplingSpec
    units: dict[str, UnitSpec]
    connections: dict[str, str]
    tolerance: float
    about: str = ""
    text: str = ""
    ripple: int = 1
    metrics: dict[str, MetricSpec] = field(default_factory=dict)
    record: tuple[str, ...] = ()
    loops: tuple[tuple[str, str], ...] = ()
    delay: str = ""
    overrides: dict[str, Any] = field(default_factory=dict)
    """Overrides from the command line. They apply if the unit and the parameter exist."""
    guard: float | None = None
    tube: TubeSpec | None = None
    final_states: bool = False
    origin: str = ""
    """Prefix of errors: the file of the case, or the name of a scenario built in Python."""
    attached: Mapping[str, Model | Foreign | Path] = field(default_factory=dict)
    """Objects for paths of units that are not files of the folder."""

    def __repr__(self) -> str:
        return f"Case({self.title!r}, units {', '.join(self.order)})"

    @property
    def title(self) -> str:
        """Title `scenario/case` for errors and reports."""
        return f"{self.scenario}/{self.name}"

    @property
    def description(self) -> str:
        """Label of one line, which differs from the labels of all other cases of all scenarios."""
        return f"scenario {self.title}" + (f": {self.about}" if self.about else "")

    @property
    def tracked(self) -> MetricSpec | None:
        """The first metric that compares an output with a reference, or None if there is none."""
        return next((m for m in self.metrics.values() if m.against is not None), None)

    @property
    def where(self) -> str:
        """Prefix of errors: file or scenario, and the case."""
        return f"{self.origin}: case {self.name}"


def check_name(name: str, where: str) -> None:
    """Check the name of a scenario, a study, a unit or a target. Error messages begin with `where`."""
    if not re.fullmatch(NAME, name):
        raise InputError(f"{where}: The name must be a letter followed by letters, digits or _. Got {name!r} instead.")


def split_end(end: str, where: str) -> tuple[str, str]:
    """Split `unit.variable` into the two names. Error messages begin with `where`, which states file and key."""
    m = _END.match(end)
    if not m:
        raise InputError(f"{where}: must read 'unit.variable'; got {end!r}")
    return m[1], m[2]


class ScenarioLike(Protocol):
    """Interface of a scenario that was built in Python, and of complete cases."""

    def ready(self) -> "Cases":
        """Return the complete cases."""


class Cases:
    """The complete cases of a scenario, which are read from a `scenario.toml` and checked.

    Parameters
    ----------
    path : path
        The file, or the folder that contains it.
    overrides : mapping of str to value
        Values ``{"unit.parameter": value}`` that override all other values, in all cases with this parameter.
    coupling : str, optional
        Coupling scheme for all cases; it replaces the schemes of the cases.

    Raises
    ------
    InputError
        The file is invalid. The message states file, key, rule and value in one line.
    """

    def __init__(
        self, path: str | Path, overrides: dict[str, Any] | None = None, coupling: Scheme | None = None
    ) -> None:
        path = Path(path)
        if path.suffix != ".toml" and path.is_file():
            raise InputError(
                f"{path}: The scenario must be a folder with a scenario.toml, or a file .toml. Got a file."
            )
        file = path / "scenario.toml" if path.suffix != ".toml" else path
        self.folder: Path | None = file.parent
        self.spec, self.origin = read_scenario(file), str(file)
        self.attached: Mapping[str, Model | Path] = {}
        self._complete(overrides, coupling)

    def __repr__(self) -> str:
        return f"Cases({self.origin!r}, {len(self.cases)} case{'' if len(self.cases) == 1 else 's'})"

    @classmethod
    def of(
        cls, spec: ScenarioSpec, origin: str, attached: Mapping[str, Model | Path], folder: Path | None = None
    ) -> "Cases":
        """Return the cases of a scenario that has no file.

        Parameters
        ----------
        spec : ScenarioSpec
        origin : str
            Prefix of every error message.
        attached : dict
            Models, or paths of files, by the paths that the units state. They are used instead of files in the folder.
        folder : path, optional
            Folder of the files of the scenario and of the baseline.
        """
        made = cls.__new__(cls)
        made.spec, made.origin, made.attached, made.folder = spec, origin, attached, folder
        return made._complete(None, None)

    def ready(self) -> "Cases":
        """Return these cases, which are already complete."""
        return self

    def named(self, name: str | None) -> Case:
        """Return the case with this name, or the first case if no name is given.

        Raises
        ------
        InputError
            There is no case with this name.
        """
        found = self.cases[0] if name is None else next((c for c in self.cases if c.name == name), None)
        if found is None:
            raise InputError(f"{self.origin}: no case {name!r}; there are {', '.join(c.name for c in self.cases)}")
        return found

    def changed(self, overrides: dict[str, Any] | None, coupling: Scheme | None) -> "Cases":
        """Return the scenario with other `overrides` and another `coupling`, see `Cases`."""
        return copy.copy(self)._complete(overrides, coupling)

    def _complete(self, overrides: dict[str, Any] | None, coupling: Scheme | None) -> "Cases":
        self.overrides, self.coupling = dict(overrides or {}), coupling
        self.cases = self._cases()
        return self

    def _cases(self) -> tuple[Case, ...]:
        specs = self.spec.case or [CaseSpec.model_validate({"name": "nominal"})]
        names = [c.name for c in specs]
        for n in names:
            if names.count(n) > 1:
                raise InputError(f"{self.origin}: case: two cases have the name {n!r}")
        return tuple(self._case(c) for c in specs)

    def _case(self, c: CaseSpec) -> Case:
        s, where = self.spec, f"{self.origin}: case {c.name}"
        units = {**s.units, **c.units}
        for key, value in c.set.items():
            unit, parameter = split_end(key, f"{where}: set")
            if unit not in units:
                raise InputError(f"{where}: set: no unit {unit!r}; there are {sorted(units)}")
            merged = {**units[unit].set, parameter: value}
            units[unit] = units[unit].model_copy(update={"set": merged})
        coupling = c.coupling if c.coupling is not None else s.coupling
        if self.coupling is not None:
            coupling = coupling.model_copy(update={"scheme": self.coupling})
        metrics = {}
        for name in c.limits:
            if name not in s.metrics:
                raise InputError(f"{where}: limits: no metric {name!r}; there are {sorted(s.metrics)}")
        for name, m in s.metrics.items():
            update = {"limit": c.limits.get(name), "after": c.after}
            metrics[name] = m.model_copy(update={k: v for k, v in update.items() if v is not None})
        same: dict[str, Any] = {k: getattr(s, k) for k in _SAME}
        case = Case(
            scenario=s.name,
            about=s.text,
            name=c.name,
            text=c.text,
            folder=self.folder,
            stop=c.stop if c.stop is not None else s.stop,
            order=tuple(c.order if c.order is not None else [*s.order, *(u for u in c.units if u not in s.units)]),
            coupling=coupling,
            units=units,
            connections={**s.connections, **c.connections},
            metrics=metrics,
            record=tuple(s.record),
            loops=tuple((a, b) for a, b in s.loops),
            origin=self.origin,
            attached=self.attached,
            overrides=self.overrides,
            **same,
        )
        self._check(case, where)
        return case

    @staticmethod
    def _check(case: Case, where: str) -> None:
        """Check all properties that need no model: order, length of the run, and window of the metrics."""
        twice = {u for u in case.order if case.order.count(u) > 1}
        missing, unknown = set(case.units) - set(case.order), set(case.order) - set(case.units)
        if twice or missing or unknown:
            wrong = f"twice: {sorted(twice)}" if twice else f"missing: {sorted(missing)}, unknown: {sorted(unknown)}"
            raise InputError(f"{where}: order: must name every unit once; {wrong}")
        steps = case.stop / case.step
        if not math.isfinite(steps) or abs(steps - round(steps)) > 1e-6 * steps or steps < 1:
            raise InputError(f"{where}: stop: must be a multiple of the step {case.step:g} s; got {case.stop:g}")
        if steps * case.ripple > MOST_STEPS:
            raise InputError(f"{where}: stop: at most {MOST_STEPS} fine steps; got {steps * case.ripple:.9g}")
        for name, m in case.metrics.items():
            if m.after >= case.stop:
                raise InputError(f"{where}: metrics.{name}.after: must be below stop {case.stop:g} s; got {m.after:g}")


SIZE = "n"


def sizes(case: Case) -> set[str]:
    """Return the names ``"unit.n"`` of the settings of a case that change the structure of a unit."""
    return {f"{name}.{SIZE}" for name, spec in case.units.items() if spec.block == "delay"}


def delayed(spec: UnitSpec, steps: object, ripple: int, where: str) -> UnitSpec:
    """Return a delay unit with another number of steps. Error messages begin with `where`.

    The delay in steps of the scenario must be a multiple of 1 / `ripple` (a fine step). An InputError is raised if the
    value is not a number, is negative, or is not a multiple of a fine step.
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
    """Return the graph of a unit in a case, before `set` and overrides. Error messages begin with `where`.

    An InputError is raised if a file is invalid or outside the folder of the case, if a block or a parameter is
    unknown, or if a value is out of range.
    """
    if spec.fmu is not None:
        return _foreign(case, spec.fmu, f"{where}.fmu")
    if spec.model is not None:
        return _model(case, spec.model, f"{where}.model").graph
    if spec.inverse_of is not None:
        # imported here, so that a scenario without a computed inverse does not wait for this import
        from hystfmu.inverse import invert

        return invert(_model(case, spec.inverse_of, f"{where}.inverse_of"), "exact").graph
    if spec.block is not None:
        return Graph.single(Node(spec.block, spec.block, spec.dims, spec.values))
    assert spec.graph is not None
    return spec.graph.graph()


def with_files(case: Case) -> Case:
    """Return the case with the loaded models and FMUs of its units, so that a confined process needs no files."""
    read: dict[str, Model | Foreign] = {}
    for name, spec in case.units.items():
        where = f"{case.where}: units.{name}"
        if spec.fmu is not None:
            read[spec.fmu] = _foreign(case, spec.fmu, f"{where}.fmu")
        read |= {m: _model(case, m, where) for m in (spec.model, spec.inverse_of) if m is not None}
    return replace(case, attached={**case.attached, **read})


def _foreign(case: Case, relative: str, where: str) -> Foreign:
    """Return the FMU at a path that the case states."""
    attached = case.attached.get(relative)
    return attached if isinstance(attached, Foreign) else Foreign.load(_path(case, relative, where))


def _model(case: Case, relative: str, where: str) -> Model:
    """Return the model at a path that the case states."""
    attached = case.attached.get(relative)
    if isinstance(attached, Model):
        return attached
    path = _path(case, relative, where)
    return _parsed(path, read_bytes(path))


@lru_cache(maxsize=16)
def _parsed(path: Path, content: bytes) -> Model:
    """Return the model in a file. The file is read once for all cases, and again after a change."""
    return Model.load(path)


def _path(case: Case, relative: str, where: str) -> Path:
    """Return the file at a path that the case states."""
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
    """Return the values of the scalar outputs before any input is known.

    Delays have their initial outputs, which earlier units in the order use. All other outputs have their start values.
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
    """Return every name that `set` accepts: the names of parameters and of their elements."""
    if isinstance(graph, Foreign):
        settable = ("parameter", "structuralParameter")
        return {v.name for v in graph.description.modelVariables if v.causality in settable}
    ports = [p for p in graph.ports if p.is_parameter]
    return {p.name for p in ports} | {n for p in ports for n in p.scalar_names}


def with_values(graph: Graph | Foreign, values: dict[str, Any]) -> Graph | Foreign:
    """Return the unit with changed parameters. The keys are their names in an FMU (`w`, `w_2`, `net_W1`)."""
    if isinstance(graph, Foreign):
        return graph.with_settings(values)
    for name, value in values.items():
        port, element = _parameter(graph, name)
        node = graph.nodes[port.node]
        graph = graph.replace(node.with_values(**{port.var.name: _changed(node, port, element, value)}))
    return graph


def changed(graph: Graph, name: str, value: object) -> tuple[Port, int, list[float]]:
    """Return the new values of a parameter that `set` of a scenario changes.

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
            raise InputError(f"{port.name}: '*' must be followed by a number; got {value!r}") from None
        if element is not None:
            new = float(np.asarray(new)[element])
    else:
        new = value
    if element is None:
        return new  # type: ignore[return-value]  # Node checks kind, length and range
    if not isinstance(new, int | float):
        raise InputError(f"{port.name}: one element must have one number; got {value!r}")
    old[element] = new
    return old
