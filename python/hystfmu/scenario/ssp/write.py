"""Write a case as a System Structure and Parameterization archive (SSP 1.0, 2.0) for other simulators.

All components are FMUs. The values of the case are written as start values of own FMUs, because several simulators do
not support parameter sets (SSV) of components. Simulators step all components in parallel, with the values of the
previous step and one step size. The reference result `extra/org.hystfmu/reference.csv` is computed with the same
scheme. Annotations state the step and the coupling scheme.

Simulators convert between the units of measure of two connectors (SSP 1.0, section 4.5.2), unless the connection
suppresses the conversion. HystFMU does not convert units of measure. Therefore an InputError is raised for a connection
that needs a conversion.
"""

import math
import re
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from hystfmu.base import InputError, read_bytes, write_bytes
from hystfmu.data.columns import csv_text
from hystfmu.fmu.archive import MOST_UNPACKED, xml_file, zip_file
from hystfmu.fmu.foreign.instance import REAL, Finding, carried
from hystfmu.fmu.write.measures import base_unit
from hystfmu.graph import Graph
from hystfmu.scenario.engine.simulation import simulate
from hystfmu.scenario.outcome.trace import Stopped, Trace
from hystfmu.scenario.ssp.container import as_readers_run, container_fmu, differences, joined, run_as_readers
from hystfmu.scenario.ssp.measures import SSC, Measure, not_converted, same, stated
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import Part, System, build, to_graph

SSD = "http://ssp-standard.org/SSP1/SystemStructureDescription"
SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
SetValue = float | int | bool | str
_WORDS = {float: "Real", int: "Integer", bool: "Boolean", str: "String"}
_NO_XML = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")


def changes(part: Part, where: str) -> dict[str, SetValue]:
    """Return the parameters and constant inputs of a unit that differ from the start values of its FMU.

    Start values of a foreign FMU cannot be changed. The start values of own FMUs are written directly, so an own FMU
    has no such parameters. An InputError is raised for a value that a parameter set cannot contain.
    """
    if not isinstance(part.graph, Foreign):
        return {}
    variables = {v.name: v for v in part.graph.description.modelVariables}
    found = {n: _typed(f"{where}: {part.name}", variables[n], v) for n, v in part.graph.settings.items()}
    for p in part.graph.ports:
        for n, start in zip(p.scalar_names, p.start, strict=True):
            if float(part.constants.get(n, start)).hex() != float(start).hex():  # -0.0 differs from 0.0
                found[n] = _typed(f"{where}: {part.name}", p.variable, part.constants[n] if p.size == 1 else [])
    return found


def _typed(unit: str, v: Any, value: Any) -> SetValue:
    """Return a value in the type of its variable: a float, an int of 32 bits, a bool or a str."""
    if isinstance(value, list):
        raise InputError(f"{unit}.{v.name}: an SSP cannot contain the value of an array")
    if isinstance(value, str):
        if _NO_XML.search(value):
            raise InputError(f"{unit}.{v.name}: {value!r} cannot be in an SSP: XML does not allow these characters")
        return value
    try:
        number = carried(v, value)
    except Finding as e:
        raise InputError(f"{unit}.{e}") from None
    if v.type == "Boolean":
        return bool(number)
    if v.type in REAL or not -(2**31) <= number < 2**31:  # the type Integer of SSP has 32 bits
        if not math.isfinite(number) or float(number) != number:
            raise InputError(f"{unit}.{v.name}: {number} cannot be in an SSP: it is neither an Integer nor a Real")
        return float(number)
    return int(number)


def parameter_set(name: str, values: Mapping[str, SetValue], version: str) -> bytes:
    """Return the content of the file of a parameter set."""
    root = ET.Element(f"{{{SSV}}}ParameterSet", name=name, version=version)
    listed = ET.SubElement(root, f"{{{SSV}}}Parameters")
    for key, value in values.items():
        kind, text = _WORDS[type(value)], str(value).lower() if isinstance(value, bool) else str(value)
        ET.SubElement(ET.SubElement(listed, f"{{{SSV}}}Parameter", name=key), f"{{{SSV}}}{kind}", value=text)
    return xml_file(root)


_WITHOUT_EFFECT = ("ConnectionGeometry", "Annotations")
_Wrong = Callable[[str], InputError]
_End = tuple[str | None, str | None]


def connections(
    root: ET.Element, system: ET.Element, units: Container[str | None], wrong: _Wrong
) -> tuple[dict[str, str], dict[str, tuple[Measure, Measure]]]:
    """Return the output that drives each connected input, as `unit.connector`.

    `units` contains the names of the components. `wrong` converts an error text to an error. An error is raised for a
    connection that has no connector, a transformation or a unit conversion, and for a second connection to the same
    input.

    Also return the units of measure of output and input for each connected input whose connection may convert them,
    because a connector states none. Then it has the unit of its variable in the FMU.
    """
    found: dict[str, str] = {}
    open_ends: dict[str, tuple[Measure, Measure]] = {}
    kinds: dict[_End, str | None] = {}
    measures: dict[_End, str | None] = {}
    for e in system.iter(f"{{{SSD}}}Component"):
        for c in e.iter(f"{{{SSD}}}Connector"):
            kinds[e.get("name"), c.get("name")] = c.get("kind")
            measures[e.get("name"), c.get("name")] = next((x.get("unit") for x in c if x.get("unit")), None)
    wires = system.find(f"{{{SSD}}}Connections")
    for c in wires if wires is not None else ():
        a, b = ((c.get(f"{side}Element"), c.get(f"{side}Connector")) for side in ("start", "end"))
        if a[0] is None and b[0] is None:
            raise wrong(f"connection of {a[1]} with {b[1]}: two connectors of the system must not be connected")
        if a[0] is None or b[0] is None:
            continue  # a connector of the system is not connected, because nothing is outside of the system
        if any(x.tag.rpartition("}")[2] not in _WITHOUT_EFFECT for x in c):
            raise wrong(f"connection of {a[0]}.{a[1]}: transformations are not supported")
        for end in (a, b):
            if end[0] not in units or end not in kinds:
                raise wrong(f"a connection names {end[0]}.{end[1]}, which does not exist")
        if kinds[a] == "input" and kinds[b] == "output":
            a, b = b, a  # the two ends of a connection have no order
        to, of = f"{b[0]}.{b[1]}", f"{a[0]}.{a[1]}"
        if found.get(to, of) != of:
            raise wrong(f"{to} is connected twice, with {found[to]} and with {of}")
        one, other = (stated(root, measures[end]) for end in (a, b))
        if c.get("suppressUnitConversion") not in ("true", "1"):
            if one is None or other is None:
                open_ends[to] = one, other
            elif one.name != other.name and not same(one, other):
                raise wrong(not_converted(of, one, to, other))
        found[to] = of
    return found, open_ends


OSP = "http://opensimulationplatform.com/SSP/OSPAnnotations"
OURS = "https://hystfmu.org/ssp"
REFERENCE = "extra/org.hystfmu/reference.csv"
Version = Literal["1.0", "2.0"]

# libcosim requires exactly these prefixes
for _prefix, _name in (("ssd", SSD), ("ssc", SSC), ("ssv", SSV), ("osp", OSP), ("hyst", OURS)):
    ET.register_namespace(_prefix, _name)


@dataclass(frozen=True)
class Written:
    """A written archive."""

    path: Path
    components: int
    differences: dict[str, float]
    """Largest difference between reference and case for each recorded output (% of span)."""


def write_ssp(
    case: Case,
    path: str | Path,
    version: Version = "1.0",
    system_connectors: bool = False,
    fmi: Literal[2, 3] = 2,
    separate: bool = False,
) -> Written:
    """Write a case as an SSP archive.

    Parameters
    ----------
    case : Case
    path : path
    version : {"1.0", "2.0"}
        Version of the SSP standard.
    system_connectors : bool
        Whether to add an output connector to the system for every recorded signal. The importers libcosim and ecos
        reject archives with such connectors.
    fmi : {2, 3}
        FMI version of the FMUs in the archive.
    separate : bool
        Whether to write every unit as a separate component.

        If False, neighbours that can step as one graph are one component, so that every simulator keeps their order.

    Raises
    ------
    InputError
        No other simulator supports the coupling of the case, the case does not run with the coupling of other
        simulators, or a file cannot be written.
    Stopped
        The case does not run.
    """
    system = build(as_readers_run(case))
    names = {end: end for end in system.columns}
    if not separate:
        components, names = joined(system)
        system = build(components)
    sets = {p.name: values for p in system.parts if (values := changes(p, case.where))}
    trace = run_as_readers(system)
    found = differences(case, names, trace)
    handed = _handed(system, trace)
    entries = {p.name: _fmu(p, handed, fmi, case) for p in system.parts}
    files = {"SystemStructure.ssd": _structure(system, sets, version, system_connectors)}
    files |= {f"resources/{name}.fmu": content for name, content in entries.items()}
    files |= {f"resources/{name}.ssv": parameter_set(name, values, version) for name, values in sets.items()}
    files[REFERENCE] = _reference(system, trace)
    write_bytes(path, zip_file(files))
    return Written(Path(path), len(system.parts), found)


def write_loop(case: Case, path: str | Path, fmi: Literal[2, 3] = 2) -> Path:
    """Write a case as one FMU that steps its units in the order of the scenario.

    Without foreign FMUs, the FMU contains one graph, and supports Model Exchange and saved states. The FMU has coarser
    steps than the case and no events within steps. Therefore its description states the largest difference between the
    results of the FMU and of the case. With foreign FMUs, the FMU is a container of FMUs.

    Raises
    ------
    InputError
        For a graph: the units have different rates or an algebraic loop, or the case does not reach its end. For a
        container: the version is not FMI 2.0, or a unit or the coupling is not supported. The file cannot be written.
    """
    from hystfmu.fmu.write.export import export_fmu

    system = build(case)
    if system.foreign:
        if fmi != 2:
            raise InputError(f"{case.where}: a loop with foreign FMUs needs FMI 2.0; its units may be FMI 3.0")
        write_bytes(path, container_fmu(system, case.scenario))
        return Path(path)
    coupling = case.coupling.model_copy(update={"scheme": "gauss_seidel", "events": "grid"})
    system = build(replace(case, ripple=1, coupling=coupling))
    graph = to_graph(system)
    try:
        found = differences(case, {n: n for n in system.columns}, simulate(system, "native"))
    except Stopped as e:
        raise InputError(f"{case.where}: a loop must run to its end for the export: {e}") from None
    worst = max(found.values())
    near = f"are within {1.06 * worst:.1e} % of their span in" if worst else "have the bits of"
    listed = ", ".join(name.replace(".", "_") for name in case.record) or "all outputs"
    text = f"loop of the {case.description}: {listed} {near} the scenario's own run"
    return export_fmu(graph.with_step(case.step), path, fmi, case.scenario, stop=case.stop, text=text)


def _fmu(part: Part, handed: dict[tuple[str, str], float], fmi: Literal[2, 3], case: Case) -> bytes:
    if isinstance(part.graph, Foreign):
        return read_bytes(part.graph.path, MOST_UNPACKED)
    from hystfmu.fmu.write.export import export_fmu

    with tempfile.TemporaryDirectory(prefix="hystfmu-ssp-") as folder:
        graph, text = _with_starts(part, handed, case.step), f"{part.name} of the {case.description}"
        archive = export_fmu(graph, Path(folder, "unit.fmu"), fmi, part.name, stop=case.stop, text=text)
        return archive.read_bytes()


def _handed(system: System, trace: Trace) -> dict[tuple[str, str], float]:
    """Return the start value that each connected input has during the initialisation."""
    ends, parts = system.names, system.parts
    return {(parts[n.to].name, parts[n.to].inputs[n.input]): float(trace[ends[n.source]][0]) for n in system.links}


def _with_starts(part: Part, handed: dict[tuple[str, str], float], h: float) -> Graph:
    """Return a graph whose inputs start with their constants or with the initial values of their sources.

    An importer sets only connected inputs, and fmpy and ecos set them only after the initialisation.
    """
    g = part.own
    inputs = []
    for i in g.inputs:
        port = g.port(i.name)
        known = {n: handed.get((part.name, n), x) for n, x in zip(port.scalar_names, port.start, strict=True)}
        start = tuple(part.constants.get(n, x) for n, x in known.items())
        inputs.append(replace(i, start=start[0], starts=start if port.size > 1 else ()))
    return Graph(g.nodes, g.wires, inputs, g.outputs, sort=False, step=h)


def _tag(space: str, name: str) -> str:
    return f"{{{space}}}{name}"


def _structure(system: System, sets: dict[str, dict[str, SetValue]], version: Version, connectors: bool) -> bytes:
    case = system.case
    head = {"name": case.scenario, "version": version, "description": case.description}
    root = ET.Element(_tag(SSD, "SystemStructureDescription"), head)
    top = ET.SubElement(root, _tag(SSD, "System"), name=case.scenario)
    ports = _ports(system)
    outside = {end: end.replace(".", "_") for end in case.record} if connectors else {}
    if outside:
        listed = ET.SubElement(top, _tag(SSD, "Connectors"))
        for end, name in outside.items():
            _connector(listed, name, "output", ports[end])
    elements = ET.SubElement(top, _tag(SSD, "Elements"))
    for p in system.parts:
        component = ET.SubElement(
            elements,
            _tag(SSD, "Component"),
            name=p.name,
            type="application/x-fmu-sharedlibrary",
            source=f"resources/{p.name}.fmu",
            implementation="CoSimulation",
        )
        listed = ET.SubElement(component, _tag(SSD, "Connectors"))
        driven = {p.inputs[link.input] for link in system.links if system.parts[link.to] is p}
        # fmpy sets a listed input without connection to 0
        for kind, names in (("input", [n for n in p.inputs if n in driven]), ("output", p.outputs)):
            for name in names:
                _connector(listed, name, kind, ports[f"{p.name}.{name}"])
        if p.name in sets:
            bindings = ET.SubElement(component, _tag(SSD, "ParameterBindings"))
            ET.SubElement(bindings, _tag(SSD, "ParameterBinding"), source=f"resources/{p.name}.ssv")
    # an empty list is not allowed
    wires = ET.SubElement(top, _tag(SSD, "Connections")) if system.links or outside else top
    ends = system.names
    for link in system.links:
        to = system.parts[link.to]
        _connect(wires, ends[link.source], {"endElement": to.name, "endConnector": to.inputs[link.input]})
    for end, name in outside.items():
        _connect(wires, end, {"endConnector": name})
    _units_of_measure(root, {unit for _, unit in ports.values()})
    _experiment(root, case)
    return xml_file(root)


def _connector(listed: ET.Element, name: str, kind: str, port: tuple[str, str]) -> None:
    connector = ET.SubElement(listed, _tag(SSD, "Connector"), name=name, kind=kind)
    word, unit = port
    ET.SubElement(connector, _tag(SSC, word), {"unit": unit} if unit and word == "Real" else {})


def _ports(system: System) -> dict[str, tuple[str, str]]:
    """Return the type and the unit of measure (or "") of every input and output."""
    found: dict[str, tuple[str, str]] = {}
    for p in system.parts:
        for port in p.graph.ports:
            variable = getattr(port, "variable", None)  # port of a foreign FMU
            kind = "Real" if variable is None or variable.type[:4] in ("Real", "Floa") else variable.type
            word = kind if kind in ("Real", "Boolean") else "Integer"
            if port.kind in ("input", "output"):
                found |= {f"{p.name}.{name}": (word, port.unit) for name in port.scalar_names}
    return found


def _units_of_measure(root: ET.Element, names: set[str]) -> None:
    listed = sorted(names - {""})
    units = ET.SubElement(root, _tag(SSD, "Units")) if listed else root
    for name in listed:
        base = base_unit(name)
        unit = ET.SubElement(units, _tag(SSC, "Unit"), name=name)
        ET.SubElement(unit, _tag(SSC, "BaseUnit"), base or {})


def _connect(wires: ET.Element, start: str, to: dict[str, str]) -> None:
    unit, _, name = start.partition(".")  # the name of a variable of a foreign FMU may contain dots
    ET.SubElement(wires, _tag(SSD, "Connection"), {"startElement": unit, "startConnector": name} | to)


def _experiment(root: ET.Element, case: Case) -> None:
    experiment = ET.SubElement(root, _tag(SSD, "DefaultExperiment"), startTime="0.0", stopTime=repr(case.stop))
    notes = ET.SubElement(experiment, _tag(SSD, "Annotations"))
    note = ET.SubElement(notes, _tag(SSC, "Annotation"), type="com.opensimulationplatform")
    information = ET.SubElement(note, _tag(OSP, "Algorithm"))
    ET.SubElement(information, _tag(OSP, "FixedStepAlgorithm"), baseStepSize=repr(case.step))
    note = ET.SubElement(notes, _tag(SSC, "Annotation"), type="org.hystfmu.coupling")
    facts = {"step": repr(case.step), "scheme": case.coupling.scheme, "order": " ".join(case.order)}
    ET.SubElement(note, _tag(OURS, "Coupling"), facts)


def _reference(system: System, trace: Trace) -> bytes:
    """Return all rows of the recorded signals, or of all outputs if no signals are recorded."""
    names = list(system.case.record) or list(system.columns)
    return csv_text({"t": trace.t} | {n: trace[n] for n in names}).encode()
