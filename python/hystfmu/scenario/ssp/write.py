"""A scenario as a System Structure and Parameterization archive (SSP 1.0 and 2.0), which other simulators run.

All components are FMUs. The start values of own FMUs are the values of the case, because several readers do not support
parameter sets (SSV) of components. Readers step all components in parallel, with the values of the previous step and
one step size. The reference result `extra/org.hystfmu/reference.csv` is computed in this way. Annotations contain step
and coupling.
"""

from __future__ import annotations

import io
import tempfile
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from hystfmu.base.errors import InputError
from hystfmu.base.files import read_bytes, write_bytes
from hystfmu.data.columns import csv_text
from hystfmu.fmu.archive import MOST_UNPACKED, xml_file
from hystfmu.fmu.write.measures import base_unit
from hystfmu.graph import Graph
from hystfmu.scenario.engine.simulation import simulate
from hystfmu.scenario.outcome.trace import Stopped, Trace
from hystfmu.scenario.ssp.container import container_fmu
from hystfmu.scenario.ssp.coupling import as_readers_run, differences, joined, run_as_readers
from hystfmu.scenario.ssp.elements import SSC, SSD, SSV, SetValue, changes, parameter_set
from hystfmu.scenario.system.build import build
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.fused import to_graph
from hystfmu.scenario.system.system import Part, System

OSP = "http://opensimulationplatform.com/SSP/OSPAnnotations"
OURS = "https://hystfmu.org/ssp"
REFERENCE = "extra/org.hystfmu/reference.csv"
Version = Literal["1.0", "2.0"]

# libcosim looks for these very prefixes
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
        Whether the system has an output for every recorded signal. libcosim and ecos reject connectors of the system.
    fmi : {2, 3}
        FMI version of the units exported here.
    separate : bool
        Whether every unit is a component.

        If False, neighbours that can step as one graph are one component, so that
        every reader keeps the order of the case.

    Raises
    ------
    InputError
        No reader implements the coupling, the case does not run with the coupling of the readers, or a file cannot be
        written.
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
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), data, zipfile.ZIP_DEFLATED)
    write_bytes(path, content.getvalue())
    return Written(Path(path), len(system.parts), found)


def write_loop(case: Case, path: str | Path, fmi: Literal[2, 3] = 2) -> Path:
    """Write a case as one FMU that steps its units in the order of the scenario.

    Without foreign FMUs, the FMU contains one graph, and supports Model Exchange and saved states. Its description
    states the largest difference from the case, which has finer steps and events within steps. With foreign FMUs, the
    FMU is a container of FMUs.

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
            raise InputError(f"{case.where}: a loop with foreign FMUs becomes an FMU 2.0; its units may be FMI 3.0")
        write_bytes(path, container_fmu(system, case.scenario))
        return Path(path)
    coupling = case.coupling.model_copy(update={"scheme": "gauss_seidel", "events": "grid"})
    system = build(replace(case, ripple=1, coupling=coupling))
    graph = to_graph(system)
    try:
        found = differences(case, {n: n for n in system.columns}, simulate(system, "native"))
    except Stopped as e:
        raise InputError(f"{case.where}: no FMU of a loop that does not reach its end: {e}") from None
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
    """Return the start value of each connected input for the initialisation."""
    ends, parts = system.names, system.parts
    return {(parts[n.to].name, parts[n.to].inputs[n.input]): float(trace[ends[n.source]][0]) for n in system.links}


def _with_starts(part: Part, handed: dict[tuple[str, str], float], h: float) -> Graph:
    """Return the graph whose inputs start with the constants of the scenario or the initial values of their sources.

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
        # fmpy writes 0 to an input that is listed and not connected
        for kind, names in (("input", [n for n in p.inputs if n in driven]), ("output", p.outputs)):
            for name in names:
                _connector(listed, name, kind, ports[f"{p.name}.{name}"])
        if p.name in sets:
            bindings = ET.SubElement(component, _tag(SSD, "ParameterBindings"))
            ET.SubElement(bindings, _tag(SSD, "ParameterBinding"), source=f"resources/{p.name}.ssv")
    wires = ET.SubElement(top, _tag(SSD, "Connections")) if system.links or outside else top  # never an empty list
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
    """Return type and unit of measure of every input and output; "" for a missing unit of measure."""
    found: dict[str, tuple[str, str]] = {}
    for p in system.parts:
        for port in p.graph.ports:
            variable = getattr(port, "variable", None)  # of a foreign FMU
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
    unit, name = start.split(".")
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
    """Return all rows of the recorded signals; of all outputs if no signals are recorded."""
    names = list(system.case.record) or list(system.columns)
    return csv_text({"t": trace.t} | {n: trace[n] for n in names}).encode()
