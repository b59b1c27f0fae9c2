"""Read a foreign SSP archive, and convert its FMUs, connections and parameter sets to a case.

SSP 1.0 and 2.0 are supported, with one flat system of FMUs for Co-Simulation. An unsupported element is never ignored,
but raises an InputError.

The result of a run is compared with the reference result in the archive.
"""

import csv
import io
import math
import os
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast
from urllib.parse import unquote

import numpy as np

from hystfmu.base import Array, InputError, meant
from hystfmu.fmu.archive import unpacked
from hystfmu.fmu.foreign.instance import unit_of
from hystfmu.scenario.engine.simulation import Engine, Run, chunks, silent
from hystfmu.scenario.outcome.trace import Excerpt, Stopped, Trace, row_file
from hystfmu.scenario.ssp.measures import Measure, converts, declared, not_converted
from hystfmu.scenario.ssp.write import OSP, OURS, REFERENCE, SSD, SSV, connections
from hystfmu.scenario.system.case import Case, split_end
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.spec import CouplingSpec, Scheme, UnitSpec
from hystfmu.scenario.system.system import System, build

UNREADABLE = (OSError, ET.ParseError, LookupError, ValueError)  # the last two are raised for an unknown encoding
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")
_WHOLE = re.compile(r"\s*[+-]?[0-9]{1,20}\s*")
_SET = "application/x-ssp-parameter-set"
_TRUTH = {"true": True, "1": True, "false": False, "0": False}
_Given = tuple[Any, str]  # a value and its unit of measure
MOST_STEPS = 100_000_000
TOLERANCE = 1e-9  # allowed difference over the largest value of a signal, because other masters round differently


@dataclass(frozen=True)
class Ssp:
    """The case of an archive, and its reference result (first column `t`, one column for each signal) or None.

    `open_ends` contains the connections whose units of measure the FMUs state, see `connections`. `ignored` contains
    the names in parameter sets that no variable has; the schema of SSP states that they have no effect.
    """

    case: Case
    signals: tuple[str, ...]
    reference: Array | None
    open_ends: Mapping[str, tuple[Measure, Measure]]
    ignored: tuple[str, ...]


def read_ssp(path: str | Path, step: float | None = None, stop: float | None = None) -> Ssp:
    """Unpack and read an SSP archive. `step` and `stop` (s) replace the values in the file.

    An InputError states the file, element, rule and value in one line.
    """
    folder = unpacked(path, "SystemStructure.ssd")[0]
    try:
        root = ET.parse(folder / "SystemStructure.ssd").getroot()
    except UNREADABLE as e:
        raise InputError(f"{path}: SystemStructure.ssd: {e}") from None
    if root.tag != f"{{{SSD}}}SystemStructureDescription":
        raise InputError(f"{path}: SystemStructure.ssd: must begin with SystemStructureDescription; got {root.tag}")
    reader = _Reader(Path(path), folder, root)
    case = reader.case(step, stop)
    return Ssp(case, *_reference(folder / REFERENCE), reader.open_ends, tuple(reader.ignored))


class _Reader:
    def __init__(self, path: Path, folder: Path, root: ET.Element) -> None:
        self._path, self._folder, self._root = path, folder, root
        system = root.find(f"{{{SSD}}}System")
        if system is None:
            raise self._wrong("has no System")
        self._system = system
        self.ignored: list[str] = []

    def _wrong(self, text: str) -> InputError:
        return InputError(f"{self._path}: SystemStructure.ssd: {text}")

    def case(self, step: float | None, stop: float | None) -> Case:
        units = self._units()
        wired, self.open_ends = connections(self._root, self._system, set(units), self._wrong)
        for end in wired:  # the start value of a connected input has no effect
            unit, _, name = end.partition(".")  # the name of a connector may contain dots
            units[unit].inputs.pop(name, None)
        experiment = self._root.find(f"{{{SSD}}}DefaultExperiment")
        facts = dict(experiment.attrib) if experiment is not None else {}
        ours = self._root.find(f".//{{{OURS}}}Coupling")
        osp = self._root.find(f".//{{{OSP}}}FixedStepAlgorithm")
        if step is None and ours is not None:
            step = self._number(ours.get("step"), "step")
        if step is None and osp is not None:
            step = self._number(osp.get("baseStepSize"), "baseStepSize")
        if step is None:
            raise self._wrong("states no step: give it with --step SECONDS")
        if stop is None:
            if "stopTime" not in facts:
                raise self._wrong("states no stop time: give it with --stop SECONDS")
            stop = self._number(facts["stopTime"], "stopTime")
        if not (step > 0 and stop >= step):
            raise self._wrong(f"the step must be greater than 0 and not above the stop time; got {step:g}, {stop:g}")
        if stop / step > MOST_STEPS:
            raise self._wrong(f"{stop / step:g} steps of {step:g} s; at most {MOST_STEPS} can run")
        if self._number(facts.get("startTime", "0"), "startTime") != 0:
            raise self._wrong(f"startTime: must be 0; got {facts['startTime']}")
        order = tuple((ours.get("order") or "").split()) if ours is not None else tuple(units)
        if sorted(order) != sorted(units):
            raise self._wrong(f"order: must name every component once; got {' '.join(order)}")
        scheme = (ours.get("scheme") if ours is not None else None) or "jacobi"
        if scheme not in ("gauss_seidel", "jacobi", "iterative"):
            raise self._wrong(f"scheme: must be gauss_seidel, jacobi or iterative; got {scheme!r}")
        return Case(
            scenario=self._path.stem,
            name="ssp",
            folder=self._folder,
            origin=str(self._path),
            step=step,
            stop=round(stop / step) * step,
            order=order,
            coupling=CouplingSpec.model_validate({"scheme": cast(Scheme, scheme)}),
            units=units,
            connections=wired,
            tolerance=TOLERANCE,
        )

    def _number(self, text: str | None, what: str) -> float:
        try:
            value = float(text or "")
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self._wrong(f"{what}: must be a number; got {text!r}")
        return value

    def _whole(self, text: str, what: str) -> float:
        """Return the exact integer that a text contains. A float cannot represent all integers of 64 bits."""
        number = self._number(text, what)
        return int(text) if _WHOLE.fullmatch(text) else number

    def _units(self) -> dict[str, UnitSpec]:
        units = {}
        elements = self._system.find(f"{{{SSD}}}Elements")
        shared = self._parameters(self._system)
        outside = {c.get("name", "") for c in self._system.iterfind(f"{{{SSD}}}Connectors/{{{SSD}}}Connector")}
        if told := sorted(outside & shared.keys()):
            raise self._wrong(f"{told[0]}: a connector of the system cannot have a value: give it to a component")
        for e in elements if elements is not None else ():
            name = e.get("name", "")
            if e.tag != f"{{{SSD}}}Component":
                raise self._wrong(f"{name}: {e.tag.rpartition('}')[2]} is not supported: components must not be nested")
            if not _NAME.match(name) or name in units:
                raise self._wrong(f"a component must have a unique name of letters, digits and _; got {name!r}")
            if e.get("type", "application/x-fmu-sharedlibrary") != "application/x-fmu-sharedlibrary":
                raise self._wrong(f"{name}: must be an FMU; got the type {e.get('type')!r}")
            if e.get("implementation") == "ScheduledExecution":
                raise self._wrong(f"{name}: Scheduled Execution is not supported")
            given = self._parameters(e)  # those of the system replace them (SSP 1.0, schema of ParameterBinding)
            given |= {k.partition(".")[2]: v for k, v in shared.items() if k.partition(".")[0] == name}
            place = self._place(name, e.get("source", ""))
            if e.get("implementation") == "ModelExchange" and _simulates(self._folder / place):
                raise self._wrong(f"{name}: implementation: an FMU with Co-Simulation runs as such; got ModelExchange")
            constants, values = self._divided(name, place, given)
            units[name] = UnitSpec.model_validate({"fmu": place, "inputs": constants, "set": values})
        if not units:
            raise self._wrong("has no components")
        self.ignored += [k for k in shared if k.partition(".")[0] not in units]
        return units

    def _place(self, name: str, source: str) -> str:
        """Return the path of an FMU in the archive. `source` is a URI, in which %20 may replace a space."""
        # os.path.isfile is also False for a name that no file can have
        inside = source if os.path.isfile(self._folder / source) else unquote(source)
        file = self._folder / inside
        if not (os.path.isfile(file) and file.resolve().is_relative_to(self._folder.resolve())):
            raise self._wrong(f"{name}: source: must be a file of the archive; got {source!r}")
        return inside

    def _divided(self, name: str, place: str, given: Mapping[str, _Given]) -> tuple[dict[str, float], dict[str, Any]]:
        """Return constant inputs and parameters, with each value in the unit of measure of its variable."""
        if not given:
            return {}, {}
        foreign = Foreign.load(self._folder / place)
        variables = {v.name: v for v in foreign.description.modelVariables}
        self.ignored += [f"{name}.{k}" for k in given if k not in variables]
        given = {k: (self._item(name, variables[k], x), unit) for k, (x, unit) in given.items() if k in variables}
        for k, (_, unit) in given.items():
            own = unit_of(variables[k])
            if not {unit, own} & {"", "1"} and unit != own:
                raise self._wrong(
                    f"{name}: {k} is given in {unit} and is in {own} in the FMU: units of measure are not converted"
                )
        inputs = {n for p in foreign.ports if p.kind == "input" for n in p.scalar_names}
        for k in given.keys() & inputs:
            if isinstance(given[k][0], str):
                raise self._wrong(f"{name}: {k}: an input must be a number. Got {given[k][0]!r} instead.")
        constants = {k: float(value) for k, (value, _) in given.items() if k in inputs}
        return constants, {k: value for k, (value, _) in given.items() if k not in inputs}

    def _item(self, name: str, v: Any, value: Any) -> Any:
        """Return the value of an enumeration that is given by the name of its item; any other value as it is."""
        if v.type != "Enumeration" or not isinstance(value, str):
            return value
        items = {item.name: int(item.value) for item in v.declaredType.items}
        if value not in items:
            raise self._wrong(f"{name}: {v.name}: must be one of {', '.join(items)}; got {value!r}")
        return items[value]

    def _parameters(self, element: ET.Element) -> dict[str, _Given]:
        found: dict[str, _Given] = {}
        bindings = element.find(f"{{{SSD}}}ParameterBindings")
        for b in bindings if bindings is not None else ():
            if b.find(f"{{{SSD}}}ParameterMapping") is not None:
                raise self._wrong("parameter mappings (SSM) are not supported")
            if (kind := b.get("type", _SET)) != _SET:
                raise self._wrong(f"a parameter binding must have the type {_SET}; got {kind!r}")
            prefix, source = b.get("prefix", ""), b.get("source")
            if source:  # inline values may come with an empty one
                if b.get("sourceBase", "SSD") != "SSD":
                    raise self._wrong(f"{source}: sourceBase must be SSD; got {b.get('sourceBase')!r}")
                root = self._read(source)
                if root.tag != f"{{{SSV}}}ParameterSet":
                    raise self._wrong(f"{source}: must begin with ParameterSet; got {root.tag}")
                found |= self._parameter_set(root, source, prefix)
            for inline in b.iter(f"{{{SSV}}}ParameterSet"):
                found |= self._parameter_set(inline, "ParameterValues", prefix)
        return found

    def _read(self, source: str) -> ET.Element:
        try:
            file = (self._folder / unquote(source)).resolve()
            inside = file.is_relative_to(self._folder.resolve())
            root = ET.parse(file).getroot() if inside else None
        except UNREADABLE as e:
            raise self._wrong(f"{source}: {e}") from None
        if root is None:
            raise self._wrong(f"{source!r} lies outside the archive")
        return root

    def _parameter_set(self, root: ET.Element, source: str, prefix: str) -> dict[str, _Given]:
        found: dict[str, _Given] = {}
        for p in root.iter(f"{{{SSV}}}Parameter"):
            for kind in (x for x in p if not x.tag.endswith("}Annotations")):
                word, text = kind.tag.rpartition("}")[2], kind.get("value", "")
                if word == "String":
                    value: Any = text
                elif word == "Boolean":
                    if text not in _TRUTH:
                        raise self._wrong(f"{source}: {p.get('name')}: must be true or false; got {text!r}")
                    value = _TRUTH[text]
                elif word in ("Real", "Float64", "Float32"):
                    value = self._number(text, f"{source}: {p.get('name')}")
                elif word == "Enumeration" and not _WHOLE.fullmatch(text):
                    value = text  # name of an item of the type of the variable
                elif word in ("Integer", "Enumeration") or word[:3] in ("Int", "UIn"):
                    value = self._whole(text, f"{source}: {p.get('name')}")
                else:
                    raise self._wrong(f"{source}: {p.get('name')}: a value of type {word} is not read")
                found[prefix + p.get("name", "")] = value, kind.get("unit", "")
        return found


def _simulates(path: Path) -> bool:
    """Return whether an FMU has Co-Simulation, which then runs, even if it also has Model Exchange."""
    return Foreign.load(path).description.coSimulation is not None


def _reference(file: Path) -> tuple[tuple[str, ...], Array | None]:
    if not file.exists():
        return (), None
    try:
        rows = list(csv.reader(io.StringIO(file.read_text())))
        values = np.array([[float(v) for v in row] for row in rows[1:]])
        if rows[0][0] != "t" or values.shape != (len(rows) - 1, len(rows[0])):
            raise ValueError
    except (OSError, ValueError, IndexError, csv.Error):
        raise InputError(f"{REFERENCE}: must have a header t,... and rows with the same number of values") from None
    return tuple(rows[0][1:]), values


@dataclass(frozen=True)
class SspRun:
    """Result of a run of an archive."""

    path: str | Path
    rows: int  # numbers of rows and outputs; 0 if the run stopped
    outputs: int
    compared: tuple[str, ...]  # signals that were compared with the reference result
    faults: tuple[str, ...]  # one line for each signal that differs, or the reason why the run stopped
    ignored: tuple[str, ...]  # names in parameter sets that no variable has

    @property
    def passed(self) -> bool:
        """True if the run ended and agrees with the reference result."""
        return not self.faults

    def lines(self) -> list[str]:
        """Return lines for the terminal."""
        if self.faults:
            return list(self.faults)
        told = (
            f"{len(self.compared)} signals agree with {REFERENCE}" if self.compared else "no reference to compare with"
        )
        return [f"{self.path}: {self.rows} rows of {self.outputs} outputs; {told}"]

    def summary(self) -> dict[str, Any]:
        """Return the results of the run as JSON types."""
        facts = {"file": str(self.path), "passed": self.passed, "rows": self.rows, "outputs": self.outputs}
        return facts | {"compared": list(self.compared), "faults": list(self.faults), "ignored": list(self.ignored)}


def _prepared(
    path: str | Path, coupling: Scheme | None, step: float | None, stop: float | None, settings: Mapping[str, Any]
) -> tuple[Ssp, Case, Array | None]:
    """Return the archive, the case to simulate, and the reference result.

    The reference result is None if the case has another coupling scheme than the archive, or other parameters.
    """
    ssp = read_ssp(path, step, stop)
    if not settings and coupling in (None, ssp.case.coupling.scheme):
        return ssp, ssp.case, ssp.reference
    for name in settings:
        split_end(name, "--set")
    scheme = ssp.case.coupling.model_copy(update={"scheme": coupling} if coupling else {})
    return ssp, replace(ssp.case, coupling=scheme, overrides=dict(settings)), None


def _built(path: str | Path, case: Case, open_ends: Mapping[str, tuple[Measure, Measure]]) -> System:
    """Build the case. Error messages contain the paths of files in the archive."""
    try:
        system = build(case)
    except InputError as e:
        raise InputError(str(e).replace(f"{case.folder}/", "")) from None
    if unknown := next((name for name in case.overrides if name not in system.overridden), None):
        names = sorted(system.parameters)
        raise InputError(f"{path}: --set {unknown}: No component has this parameter.{meant(unknown, names)}")
    own = _own_measures(system) if open_ends else {}
    for to, (one, other) in open_ends.items():
        of = case.connections[to]
        one, other = one or own[of], other or own[to]
        if one is not None and other is not None and converts(one, other):
            raise InputError(f"{path}: SystemStructure.ssd: {not_converted(of, one, to, other)}")
    return system


def _own_measures(system: System) -> dict[str, Measure]:
    """Return the unit of measure of each input and output `component.variable`, as its FMU states it."""
    found: dict[str, Measure] = {}
    for part in system.foreign:
        assert isinstance(part.graph, Foreign)
        for p in part.graph.ports:
            measure = declared(part.graph.description, p.variable)
            found |= {f"{part.name}.{name}": measure for name in p.scalar_names}
    return found


def _held_against(
    path: str | Path, case: Case, signals: tuple[str, ...], reference: Array | None, trace: Trace
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the compared signals, and one line for each signal that differs from the reference."""
    if reference is None:
        return (), ()
    rows = min(len(reference), len(trace.t))
    if np.abs(reference[:rows, 0] - trace.t[:rows]).max() > 1e-6 * case.step:
        return (), ()  # the reference has another step
    lines = []
    for k, end in enumerate(signals, 1):
        if end not in trace.columns:
            raise InputError(f"{path}: {REFERENCE}: names {end}, which does not exist")
        old, new = reference[:rows, k], trace[end][:rows]
        gap = np.abs(new - old)
        if not gap.max() <= case.tolerance * max(float(np.abs(old).max()), 1e-300):
            at = int(gap.argmax())
            lines.append(
                f"{path}: {end} = {new[at]:.9g} at t = {trace.t[at]:g} s differs from {old[at]:.9g} in "
                f"{REFERENCE} (tolerance {case.tolerance:g} of its largest value)"
            )
    return signals, tuple(lines)


def run_ssp(
    path: str | Path,
    engine: Engine = "fmpy",
    coupling: Scheme | None = None,
    step: float | None = None,
    stop: float | None = None,
    seconds: float = 600.0,
    out: str | Path | None = None,
    confined: bool = True,
    progress: Callable[[float], None] = silent,
    settings: Mapping[str, Any] | None = None,
) -> SspRun:
    """Simulate an archive, and compare the result with the reference result in the archive.

    Nothing is compared if the archive has no reference result, if `step` or `coupling` differ from the archive, or if
    `settings` are given.

    Rows are written to the file `out` during the run. Only the rows for the comparison are stored in memory. `progress`
    is called with the completed fraction. `settings` override parameters, ``{"component.parameter": value}``.
    """
    ssp, case, reference = _prepared(path, coupling, step, stop, settings or {})
    system, run = _built(path, case, ssp.open_ends), Run(engine, coupling, seconds, confined=confined)
    begin = Excerpt(system.columns, np.arange(len(reference) if reference is not None else 1))
    try:
        with ExitStack() as stack:
            adders: list[Callable[[Trace], None]] = [begin.add]
            if out is not None:
                adders.append(stack.enter_context(row_file(out, system)))
            for chunk in chunks(system, run):
                for add in adders:
                    add(chunk)
                progress((chunk.first + len(chunk.t)) / (system.n_steps + 1))
    except Stopped as e:
        return SspRun(path, 0, 0, (), (f"{path}: stopped: {e}",), ssp.ignored)
    compared, lines = _held_against(path, case, ssp.signals, reference, begin.trace())
    return SspRun(path, system.n_steps + 1, len(system.columns), compared, lines, ssp.ignored)
