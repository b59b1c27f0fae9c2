"""A scenario as a System Structure and Parameterization archive (SSP 1.0 and 2.0), which other simulators run.

All units of the case are FMUs in it, with their values inside; what the case changed is a parameter set (SSV) beside
each as well.  Importers have no ripple between samples: every unit runs at the base step.  Step, order and coupling
travel as annotations, and the reference result as `extra/org.hystfmu/reference.csv`.
"""

from __future__ import annotations

import io
import tempfile
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Literal

from hystfmu.base.errors import InputError
from hystfmu.base.files import read_bytes, write_bytes
from hystfmu.data.csv_file import csv_text
from hystfmu.fmu.archive.unpack import MOST_UNPACKED
from hystfmu.fmu.archive.xml_file import xml_file
from hystfmu.graph import Graph
from hystfmu.scenario.engine.simulation import simulate
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.fused import to_graph
from hystfmu.scenario.system.system import Part, System, build
from hystfmu.scenario.system.unit_graph import changed

SSD = "http://ssp-standard.org/SSP1/SystemStructureDescription"
SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
OSP = "http://opensimulationplatform.com/SSP/OSPAnnotations"
OURS = "https://hystfmu.org/ssp"
REFERENCE = "extra/org.hystfmu/reference.csv"
Version = Literal["1.0", "2.0"]

# libcosim looks for these very prefixes
for _prefix, _name in (("ssd", SSD), ("ssc", SSC), ("ssv", SSV), ("osp", OSP), ("hyst", OURS)):
    ET.register_namespace(_prefix, _name)


def write_ssp(
    case: Case, path: str | Path, version: Version = "1.0", system_connectors: bool = False, fmi: Literal[2, 3] = 2
) -> Path:
    """Write a case as an SSP archive.

    Parameters
    ----------
    case : Case
    path : path
        Usually ``*.ssp``.
    version : {"1.0", "2.0"}
    system_connectors : bool
        Give the system an output for every recorded signal.  libcosim and ecos reject connectors of the system.
    fmi : {2, 3}
        Version of the FMUs of our units.

    Raises
    ------
    InputError
        Units of different rates, or a file that cannot be written.
    """
    slow = [name for name, u in case.units.items() if u.every > 1]
    if slow:
        raise InputError(f"{case.where}: {slow[0]} runs once in several steps: SSP has one step")
    own = [name for name, u in case.units.items() if u.substeps > 1 or u.hold != "zero"]
    if own:
        raise InputError(f"{case.where}: {own[0]} has substeps or a hold of its own: SSP knows neither")
    # nor do other importers know the events of its references
    coupling = case.coupling.model_copy(update={"events": "grid"})
    system = build(replace(case, ripple=1, coupling=coupling))
    trace = simulate(system, "native")
    entries = {p.name: _fmu(p, fmi, case.step) for p in system.parts}
    sets = {p.name: values for p in system.parts if (values := _changes(system, p))}
    files = {"SystemStructure.ssd": _structure(system, sets, version, system_connectors)}
    files |= {f"resources/{name}.fmu": content for name, content in entries.items()}
    files |= {f"resources/{name}.ssv": _values(name, values, version) for name, values in sets.items()}
    files[REFERENCE] = _reference(system, trace)
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), data, zipfile.ZIP_DEFLATED)
    write_bytes(path, content.getvalue())
    return Path(path)


def write_loop(case: Case, path: str | Path, fmi: Literal[2, 3] = 2) -> Path:
    """Write a case as one FMU: a container without a master, Gauss-Seidel in the scenario's order inside.

    Raises
    ------
    InputError
        Units of different rates, foreign FMUs, an algebraic loop, or a file that cannot be written.
    """
    from hystfmu.fmu.write.export import export_fmu

    graph = to_graph(build(replace(case, ripple=1))).with_step(case.step)
    return export_fmu(graph, path, fmi=fmi, name=case.scenario)


def _fmu(part: Part, fmi: Literal[2, 3], h: float) -> bytes:
    if isinstance(part.graph, Foreign):
        return read_bytes(part.graph.path, MOST_UNPACKED)
    from hystfmu.fmu.write.export import export_fmu

    with tempfile.TemporaryDirectory(prefix="hystfmu-ssp-") as folder:
        archive = export_fmu(_with_starts(part, h), Path(folder, "unit.fmu"), fmi=fmi, name=part.name)
        return archive.read_bytes()


def _with_starts(part: Part, h: float) -> Graph:
    """The graph whose inputs start with the constants of the scenario: an importer sets only what is connected."""
    g = part.own
    inputs = []
    for i in g.inputs:
        port = g.port(i.name)
        given = [part.constants[n] for n in port.scalar_names if n in part.constants]
        if port.size > 1 and len(set(given)) > 1:
            raise InputError(f"{part.name}.{i.name}: an array of different constants has no start value in an SSP")
        inputs.append(replace(i, start=given[0]) if given else i)
    return Graph(g.nodes, g.wires, inputs, g.outputs, sort=False, step=h)


def _changes(system: System, part: Part) -> dict[str, float]:
    """Real parameters that the case sets, and constant inputs, by the names of FMI 2.0."""
    case = system.case
    names = [*case.units[part.name].set]
    names += [k.split(".", 1)[1] for k in case.overrides if k.startswith(f"{part.name}.")]
    found: dict[str, float] = {}
    if isinstance(part.graph, Foreign):
        found |= {n: float(v) for n, v in part.graph.settings.items() if not isinstance(v, str | bool)}
    else:
        for name in names:
            try:
                port, first, values = changed(part.own, name, "*1")
            except InputError:
                continue  # belongs to another case
            if port.var.type == "real":
                found |= dict(zip(port.scalar_names[first : first + len(values)], values, strict=True))
    return found | part.constants


def _tag(space: str, name: str) -> str:
    return f"{{{space}}}{name}"


def _structure(system: System, sets: dict[str, dict[str, float]], version: Version, connectors: bool) -> bytes:
    case = system.case
    root = ET.Element(_tag(SSD, "SystemStructureDescription"), name=case.scenario, version=version)
    top = ET.SubElement(root, _tag(SSD, "System"), name=case.scenario)
    outside = {end: end.replace(".", "_") for end in case.record} if connectors else {}
    if outside:
        listed = ET.SubElement(top, _tag(SSD, "Connectors"))
        for name in outside.values():
            ET.SubElement(ET.SubElement(listed, _tag(SSD, "Connector"), name=name, kind="output"), _tag(SSC, "Real"))
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
        for kind, names in (("input", p.inputs), ("output", p.outputs)):
            for name in names:
                connector = ET.SubElement(listed, _tag(SSD, "Connector"), name=name, kind=kind)
                ET.SubElement(connector, _tag(SSC, "Real"))
        if p.name in sets:
            bindings = ET.SubElement(component, _tag(SSD, "ParameterBindings"))
            ET.SubElement(bindings, _tag(SSD, "ParameterBinding"), source=f"resources/{p.name}.ssv")
    wires = ET.SubElement(top, _tag(SSD, "Connections"))
    ends = {place: end for end, place in system.columns.items()}
    for link in system.links:
        to = system.parts[link.to]
        _connect(wires, ends[link.source], {"endElement": to.name, "endConnector": to.inputs[link.input]})
    for end, name in outside.items():
        _connect(wires, end, {"endConnector": name})
    _experiment(root, case)
    return xml_file(root)


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


def _values(name: str, values: dict[str, float], version: Version) -> bytes:
    root = ET.Element(_tag(SSV, "ParameterSet"), name=name, version=version)
    listed = ET.SubElement(root, _tag(SSV, "Parameters"))
    for key, value in values.items():
        ET.SubElement(ET.SubElement(listed, _tag(SSV, "Parameter"), name=key), _tag(SSV, "Real"), value=repr(value))
    return xml_file(root)


def _reference(system: System, trace: Trace) -> bytes:
    """All rows of the recorded signals; without a list those of all outputs."""
    names = list(system.case.record) or list(system.columns)
    return csv_text({"t": trace.t} | {n: trace[n] for n in names}).encode()
