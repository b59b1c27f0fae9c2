"""modelDescription.xml for FMI 2.0 and 3.0, made from a graph: nothing in it is written by hand for a model.

FMI Specification 2.0.4, section 2.2; FMI Specification 3.0.1, section 2.4.  What is declared is what the binary does:
a capability that it does not have is not mentioned.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from typing import Literal

import hystfmu
from hystfmu.core import Var
from hystfmu.fmu.xml_file import xml_file
from hystfmu.graph import Graph, Port

Fmi = Literal[2, 3]

# unit: exponents of the SI base units, factor to SI
_UNITS: dict[str, tuple[dict[str, int], float]] = {
    "1": ({}, 1.0),
    "%": ({}, 0.01),
    "s": ({"s": 1}, 1.0),
    "ms": ({"s": 1}, 1e-3),
    "s2": ({"s": 2}, 1.0),
    "Hz": ({"s": -1}, 1.0),
    "kHz": ({"s": -1}, 1e3),
    "1/s": ({"s": -1}, 1.0),
    "1/s2": ({"s": -2}, 1.0),
    "rad": ({"rad": 1}, 1.0),
    "rad/s": ({"rad": 1, "s": -1}, 1.0),
    "m": ({"m": 1}, 1.0),
    "mm": ({"m": 1}, 1e-3),
    "um": ({"m": 1}, 1e-6),
    "nm": ({"m": 1}, 1e-9),
    "m/s": ({"m": 1, "s": -1}, 1.0),
    "m/s2": ({"m": 1, "s": -2}, 1.0),
    "1/m": ({"m": -1}, 1.0),
    "kg": ({"kg": 1}, 1.0),
    "N": ({"kg": 1, "m": 1, "s": -2}, 1.0),
    "N/m": ({"kg": 1, "s": -2}, 1.0),
    "N.s/m": ({"kg": 1, "s": -1}, 1.0),
    "Pa": ({"kg": 1, "m": -1, "s": -2}, 1.0),
    "A": ({"A": 1}, 1.0),
    "A/m": ({"A": 1, "m": -1}, 1.0),
    "T": ({"kg": 1, "s": -2, "A": -1}, 1.0),
    "V": ({"kg": 1, "m": 2, "s": -3, "A": -1}, 1.0),
    "V/m": ({"kg": 1, "m": 1, "s": -3, "A": -1}, 1.0),
    "um/V": ({"kg": -1, "m": -1, "s": 3, "A": 1}, 1e-6),
    "m/V": ({"kg": -1, "m": -1, "s": 3, "A": 1}, 1.0),
    "K": ({"K": 1}, 1.0),
}


def variable_type(v: Var) -> str:
    """`"real"`, `"int"`, `"bool"` or `"enumeration"`."""
    return "enumeration" if v.choices else v.type


def _number(v: Var, x: float) -> str:
    if variable_type(v) == "bool":
        return "true" if x else "false"
    return repr(float(x)) if v.type == "real" else str(int(x))


def _type_name(graph: Graph, p: Port) -> str:
    """Name of the type of an enumeration: with a dot, so that no variable can have it."""
    return f"{graph.nodes[p.node].block.class_name}.{p.var.name}"


def _limits(v: Var) -> dict[str, str]:
    if variable_type(v) not in ("real", "int"):
        return {}
    bounds = {"min": v.lo, "max": v.hi}
    return {k: _number(v, x) for k, x in bounds.items() if math.isfinite(x)}


def _causality(p: Port) -> dict[str, str]:
    if p.kind in ("param", "fixed"):
        return {"causality": "parameter", "variability": "tunable" if p.kind == "param" else "fixed"}
    return {"causality": p.kind, "variability": "continuous" if p.var.type == "real" else "discrete"}


def _units(graph: Graph) -> ET.Element | None:
    used = sorted({p.unit for p in graph.ports if p.unit and p.var.type == "real"} | {"s"})
    definitions = ET.Element("UnitDefinitions")
    for name in used:
        unit = ET.SubElement(definitions, "Unit", name=name)
        if name in _UNITS:
            exponents, factor = _UNITS[name]
            attributes = {k: str(n) for k, n in exponents.items()}
            if factor != 1.0:
                attributes["factor"] = repr(factor)
            ET.SubElement(unit, "BaseUnit", attributes)
    return definitions


def _types(graph: Graph, fmi: Fmi) -> ET.Element | None:
    """The enumerations; their item values are the core's: 0, 1, ..."""
    found = {_type_name(graph, p): p.var.choices for p in graph.ports if p.var.choices}
    if not found:
        return None
    definitions = ET.Element("TypeDefinitions")
    for name, choices in sorted(found.items()):
        if fmi == 2:
            kind = ET.SubElement(ET.SubElement(definitions, "SimpleType", name=name), "Enumeration")
        else:
            kind = ET.SubElement(definitions, "EnumerationType", name=name)
        for value, word in enumerate(choices):
            ET.SubElement(kind, "Item", name=word, value=str(value))
    return definitions


def _log_categories() -> ET.Element:
    categories = ET.Element("LogCategories")
    for name, text in (
        ("logEvents", "what the unit does"),
        ("logStatusWarning", "an input has no finite value"),
        ("logStatusError", "a call was refused, and why"),
    ):
        ET.SubElement(categories, "Category", name=name, description=text)
    return categories


def _scalars(graph: Graph) -> Iterator[tuple[Port, int, str]]:
    for p in graph.ports:
        for i, name in enumerate(p.scalar_names):
            yield p, i, name


def _variables2(graph: Graph) -> ET.Element:
    tags = {"real": "Real", "int": "Integer", "bool": "Boolean", "enumeration": "Enumeration"}
    variables = ET.Element("ModelVariables")
    for p, i, name in _scalars(graph):
        attributes = {"name": name, "valueReference": str(p.reference + i), "description": p.text, **_causality(p)}
        if p.kind != "input":
            attributes["initial"] = "calculated" if p.kind == "output" else "exact"
        scalar = ET.SubElement(variables, "ScalarVariable", attributes)
        kind = ET.SubElement(scalar, tags[variable_type(p.var)])
        if p.var.choices:
            kind.set("declaredType", _type_name(graph, p))
        if p.var.type == "real" and p.unit:
            kind.set("unit", p.unit)
        kind.attrib.update(_limits(p.var))
        if p.kind != "output":
            kind.set("start", _number(p.var, p.start[i]))
    return variables


def _variables3(graph: Graph) -> ET.Element:
    tags = {"real": "Float64", "int": "Int32", "bool": "Boolean", "enumeration": "Enumeration"}
    variables = ET.Element("ModelVariables")
    for p in graph.ports:
        attributes = {"name": p.name, "valueReference": str(p.reference), "description": p.text, **_causality(p)}
        if p.kind != "input":
            attributes["initial"] = "calculated" if p.kind == "output" else "exact"
        if p.var.choices:
            attributes["declaredType"] = _type_name(graph, p)
        if p.var.type == "real" and p.unit:
            attributes["unit"] = p.unit
        attributes.update(_limits(p.var))
        if p.kind != "output":
            attributes["start"] = " ".join(_number(p.var, x) for x in p.start)
        variable = ET.SubElement(variables, tags[variable_type(p.var)], attributes)
        if p.size > 1:
            ET.SubElement(variable, "Dimension", start=str(p.size))
    name = "time"
    while any(p.name == name for p in graph.ports):
        name += "_"
    reference = sum(p.size for p in graph.ports)  # the binary gives the time under the first free reference
    time = {"name": name, "valueReference": str(reference), "causality": "independent", "variability": "continuous"}
    ET.SubElement(variables, "Float64", {**time, "unit": "s", "description": "simulation time"})
    return variables


def _structure(graph: Graph, fmi: Fmi) -> ET.Element:
    """Outputs with the inputs they depend on at once; without such a list importers suspect an algebraic loop.

    At the initialisation an output may depend on every parameter and input (`dependencies` is left out: all).
    """
    depends = graph.dependencies()
    structure = ET.Element("ModelStructure")
    if fmi == 3:
        for p in graph.ports:
            if p.kind == "output":
                inputs = " ".join(str(graph.port(name).reference) for name in depends[p.name])
                ET.SubElement(structure, "Output", valueReference=str(p.reference), dependencies=inputs)
        for p in graph.ports:
            if p.kind == "output":
                ET.SubElement(structure, "InitialUnknown", valueReference=str(p.reference))
        return structure
    index: dict[str, list[int]] = {}
    for k, (p, _, _) in enumerate(_scalars(graph)):
        index.setdefault(p.name, []).append(k + 1)
    outputs = [p for p in graph.ports if p.kind == "output"]
    if outputs:
        listed, initial = ET.SubElement(structure, "Outputs"), ET.SubElement(structure, "InitialUnknowns")
        for p in outputs:
            inputs = " ".join(str(k) for name in depends[p.name] for k in index[name])
            for k in index[p.name]:
                ET.SubElement(listed, "Unknown", index=str(k), dependencies=inputs)
                ET.SubElement(initial, "Unknown", index=str(k))
    return structure


def model_description(graph: Graph, fmi: Fmi, name: str, text: str = "", step: float | None = None) -> bytes:
    """The XML of an FMU.

    Parameters
    ----------
    graph : Graph
        What runs in the FMU.
    fmi : {2, 3}
        Version of the standard.
    name : str
        Model name and model identifier: a letter or _ followed by letters, digits or _.
    text : str
        Description.
    step : float or None
        Step (s) of the default experiment; None writes no default experiment.

    Returns
    -------
    bytes
        UTF-8, ends with a newline.
    """
    token, spelling = graph.token, "state" if fmi == 2 else "State"
    head = {"fmiVersion": "2.0" if fmi == 2 else "3.0", "modelName": name}
    head["guid" if fmi == 2 else "instantiationToken"] = token
    if text:
        head["description"] = text
    head |= {"generationTool": f"HystFMU {hystfmu.__version__}", "variableNamingConvention": "flat"}
    root = ET.Element("fmiModelDescription", head)
    capabilities = {
        "modelIdentifier": name,
        "canHandleVariableCommunicationStepSize": "true",
        "canBeInstantiatedOnlyOncePerProcess": "false",
        f"canGetAndSetFMU{spelling}": "true",
        f"canSerializeFMU{spelling}": "true",
    }
    if fmi == 2:
        capabilities["canNotUseMemoryManagementFunctions"] = "true"  # the importer's allocator is not used
    ET.SubElement(root, "CoSimulation", capabilities)
    for part in (_units(graph), _types(graph, fmi), _log_categories()):
        if part is not None:
            root.append(part)
    if step is not None:
        ET.SubElement(root, "DefaultExperiment", startTime="0.0", stopTime=repr(1000 * step), stepSize=repr(step))
    root.append(_variables2(graph) if fmi == 2 else _variables3(graph))
    root.append(_structure(graph, fmi))
    return xml_file(root)
