"""Writer of modelDescription.xml for FMI 2.0 and 3.0, with data about the fitted model.

The format is defined in FMI Specification 2.0.4, section 2.2, and FMI Specification 3.0.1, section 2.4. Only
capabilities that the binary has are declared. The content depends only on the model and the provenance of its fit, so
equal models give bit-identical files.
"""

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from hystfmu.base import Array, __version__
from hystfmu.core.library import Var
from hystfmu.fmu.archive import xml_file
from hystfmu.fmu.write.measures import rate_unit, unit_definitions
from hystfmu.graph import Graph, Port
from hystfmu.graph.dependencies import Knowns, dependencies
from hystfmu.graph.graph import is_hysteretic, is_sampled, needs_step, sample_time, suitable_step
from hystfmu.model import Model
from hystfmu.model.coverage import COVARIATES, KEY

_DIGITS = 8  # number of digits of a hash that are shown
_MOST = 60  # maximum number of characters of the name of a record; the name of many joined records is long


def record_of(model: Model) -> Mapping[str, Any]:
    """Return the provenance of the record to which a model, or the model of an inverse, was fitted."""
    told: Any = model.provenance
    while isinstance(told, Mapping) and isinstance(told.get("of"), Mapping):
        told = told["of"]
    return told if isinstance(told, Mapping) and isinstance(told.get("data"), str) and told["data"] else {}


def name_of(model: Model) -> str:
    """Return the name of an FMU, which consists of the name of the record and the kind of model."""
    record = record_of(model)
    return f"{_short(record['data'])} {model.key}" if record else model.key


def description_of(model: Model) -> str:
    """Return a description of a model in one line.

    It contains the kind of model, the record with its range and units of measure, and the error on this record.
    """
    record = record_of(model)
    if not record:
        return model.text
    inverse = "inverse" in model.provenance
    unit_u, unit_y = (ports[0].unit if ports else "" for ports in (model.graph.inputs, model.graph.outputs))
    if inverse:
        unit_u, unit_y = unit_y, unit_u
    known = [
        _range(record.get("trained_u", record.get("span_u")), unit_u),
        f"output in {unit_y}" if unit_y else "",
        "" if inverse else _error(model.fit.get("rms_percent")),
        f"SHA-256 {record['sha256'][:_DIGITS]}" if isinstance(record.get("sha256"), str) else "",
    ]
    listed = ", ".join(filter(None, known))
    of = "inverse of a model that was " if inverse else ""
    origin = f"{of}fitted to the record {_short(record['data'])}"
    return "; ".join(filter(None, [model.text, f"{origin}: {listed}" if listed else origin]))


def _short(text: str) -> str:
    return text if len(text) <= _MOST else f"{text[:_MOST]}..."


def _range(span: Any, unit: str) -> str:
    if not (isinstance(span, list | tuple) and len(span) == 2 and all(isinstance(x, int | float) for x in span)):
        return f"input in {unit}" if unit else ""
    return f"input {span[0]:.6g} to {span[1]:.6g} {unit}".rstrip()


def _error(percent: Any) -> str:
    known = isinstance(percent, int | float) and math.isfinite(percent)
    return f"RMS error {percent:.2g} % of the span of the output" if known else ""


@dataclass(frozen=True)
class Facts:
    """Data about one port. Unknown data are None or "".

    `low` and `high` are the smallest and the largest value in the training rows, including the start value. `nominal`
    is the typical size of the values.
    """

    low: float | None = None
    high: float | None = None
    nominal: float | None = None
    text: str = ""


def _size(x: float) -> float | None:
    """Return a size rounded to two digits; None if the size cannot be a nominal value."""
    return float(f"{x:.2g}") if math.isfinite(x) and x > 0 else None


def _of_input(port: Port, span: object) -> Facts:
    if not (isinstance(span, list | tuple) and len(span) == 2 and all(math.isfinite(x) for x in span)):
        return Facts()
    low, high = min(span[0], *port.start), max(span[1], *port.start)
    return Facts(max(low, port.var.lo), min(high, port.var.hi), _size(max(abs(span[0]), abs(span[1]))))


def facts_of(model: Model, y: Array) -> Mapping[str, Facts]:
    """Return the data about the real ports of a model by name; y (n, n_outputs) is its reference response.

    The reference response is the output in the reference experiment.

    The data of an input contain its range in the training rows. The data of an output contain its largest magnitude in
    the reference experiment. They contain no range, because the output of a model may exceed the range of the training
    rows.
    """
    found: dict[str, Facts] = {}
    spans = {**model.provenance.get(COVARIATES, {})}
    if model.graph.inputs and KEY in model.provenance:
        spans[model.graph.inputs[0].name] = model.provenance[KEY]
    at = 0
    for p in model.graph.ports:
        if p.kind == "input" and p.var.type == "real":
            found[p.name] = _of_input(p, spans.get(p.name))
        elif p.kind == "output":
            columns = y[:, at : at + p.size]
            at += p.size
            if p.var.type == "real":
                sizes = np.abs(columns[np.isfinite(columns)])
                own = next((o.text for o in model.graph.outputs if o.name == p.name), "")
                what = f"output of the model {model.key}" + (f", in {p.unit}" if p.unit else "")
                found[p.name] = Facts(nominal=_size(float(sizes.max(initial=0.0))), text="" if own else what)
    return found


Fmi = Literal[2, 3]


def _number(v: Var, x: float) -> str:
    if v.type == "bool":
        return "true" if x else "false"
    return repr(float(x)) if v.type == "real" else str(int(x))


def _without_dust(x: float) -> str:
    """Return a time as text without digits that are rounding errors: 0.001 for 0.0010000000000000009."""
    short = float(f"{x:.12g}")
    return repr(short if abs(short - x) <= 1e-14 * abs(x) else x)


def _type_name(graph: Graph, p: Port) -> str:
    """Return the name of the type of an enumeration. It contains a dot, so that it differs from names of variables."""
    return f"{graph.nodes[p.node].block.class_name}.{p.var.name}"


def _limits(v: Var, facts: Facts) -> dict[str, str]:
    """Return the attributes `min`, `max` and `nominal` of a variable.

    The limits are those of the block, or narrower limits from the training rows.
    """
    if v.type not in ("real", "int"):
        return {}
    low, high = (own if known is None else known for own, known in ((v.lo, facts.low), (v.hi, facts.high)))
    bounds = {"min": low, "max": high}
    found = {k: _number(v, x) for k, x in bounds.items() if math.isfinite(x)}
    return found | ({"nominal": repr(facts.nominal)} if facts.nominal is not None and v.type == "real" else {})


def _attributes(p: Port, name: str, reference: int, facts: Facts) -> dict[str, str]:
    """Return the attributes of a variable that are common to FMI 2.0 and FMI 3.0."""
    found = {"name": name, "valueReference": str(reference), "description": facts.text or p.text}
    if p.is_parameter:
        found |= {"causality": "parameter", "variability": "tunable" if p.kind == "param" else "fixed"}
    else:
        found |= {"causality": p.kind, "variability": "continuous" if p.var.type == "real" else "discrete"}
    return found if p.kind == "input" else found | {"initial": "calculated" if p.kind == "output" else "exact"}


def _types(graph: Graph, fmi: Fmi) -> ET.Element | None:
    """Return the definitions of the enumerations. The values of their items are 0, 1, ..., as in the C core."""
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
        ("logEvents", "activity of the instance"),
        ("logStatusWarning", "an input has no finite value"),
        ("logStatusError", "a call was refused, with the reason"),
    ):
        ET.SubElement(categories, "Category", name=name, description=text)
    return categories


def _continuous(graph: Graph) -> Iterator[tuple[dict[str, str], str, int | None]]:
    """Yield the attributes, the unit of measure and the index of each continuous state, then of each derivative.

    For a state, the index is None. For a derivative, it is the index of its state. The value references follow the
    value reference of the time.
    """
    states, first = graph.continuous_states, sum(p.size for p in graph.ports) + 1
    local = {"causality": "local", "variability": "continuous", "initial": "calculated"}
    for k, x in enumerate(states):
        yield {"name": x.name, "valueReference": str(first + k), "description": x.text, **local}, x.unit, None
    for k, x in enumerate(states):
        named = {"name": f"der({x.name})", "valueReference": str(first + len(states) + k)}
        yield {**named, "description": f"time derivative of {x.name}", **local}, rate_unit(x.unit), k


_TAGS: dict[Fmi, dict[str, str]] = {
    2: {"real": "Real", "int": "Integer", "bool": "Boolean"},
    3: {"real": "Float64", "int": "Int32", "bool": "Boolean"},
}


def _typed(graph: Graph, fmi: Fmi, p: Port, start: Sequence[float], facts: Facts) -> dict[str, str]:
    """Return the attributes that depend on the type of a variable, for the variable or for one of its elements."""
    found = {"declaredType": _type_name(graph, p)} if p.var.choices else {}
    if p.var.type == "real":
        found |= {"intermediateUpdate": "true"} if fmi == 3 and p.kind == "input" else {}
        found |= {"unit": p.unit} if p.unit else {}
    found |= _limits(p.var, facts)
    return found if p.kind == "output" else found | {"start": " ".join(_number(p.var, x) for x in start)}


def _variables(graph: Graph, fmi: Fmi, known: Mapping[str, Facts]) -> ET.Element:
    """Return the element ModelVariables. In FMI 2.0, every element of an array is a separate variable."""
    variables = ET.Element("ModelVariables")

    def add(kind: str, attributes: dict[str, str], typed: dict[str, str]) -> ET.Element:
        tag = _TAGS[fmi].get(kind, "Enumeration")
        if fmi == 3:
            return ET.SubElement(variables, tag, attributes | typed)
        return ET.SubElement(ET.SubElement(variables, "ScalarVariable", attributes), tag, typed)

    for p in graph.ports:
        facts = known.get(p.name, Facts())
        for i, name in enumerate(p.scalar_names if fmi == 2 else [p.name]):
            start = p.start[i : i + 1] if fmi == 2 else p.start
            attributes = _attributes(p, name, p.reference + i, facts)
            variable = add(p.var.type, attributes, _typed(graph, fmi, p, start, facts))
            if fmi == 3 and p.size > 1:
                ET.SubElement(variable, "Dimension", start=str(p.size))
    total = sum(p.size for p in graph.ports)  # this value is the value reference of the time in the binary
    if fmi == 3:
        name, taken = "time", {p.name for p in graph.ports} | {x.name for x in graph.continuous_states}
        while name in taken:
            name += "_"
        time = {"name": name, "valueReference": str(total), "causality": "independent", "variability": "continuous"}
        add("real", time, {"unit": "s", "description": "simulation time"})
    for attributes, unit, of in _continuous(graph):
        # FMI 2.0 has no variable for the time, so its index, counted from 1, equals the value reference in FMI 3.0
        add("real", attributes, {"unit": unit} | ({} if of is None else {"derivative": str(total + 1 + of)}))
    return variables


def _structure(graph: Graph, fmi: Fmi) -> ET.Element:
    """Return the element ModelStructure with the dependencies of outputs and derivatives.

    Without these dependencies, importers assume algebraic loops. FMI 3.0 identifies variables by value references. FMI
    2.0 identifies them by indices, counted from 1, and has no index for the time. Initial unknowns have no attribute
    `dependencies`, which means that they may depend on every parameter and input.
    """
    outputs, derivatives = dependencies(graph.nodes, graph.links, graph.ports)
    first = sum(p.size for p in graph.ports) + 1  # continuous state, then the derivatives
    of = {p.name: [p.reference] if fmi == 3 else [p.reference + 1 + i for i in range(p.size)] for p in graph.ports}

    def listed(known: Knowns) -> str:
        found = {k for name in known.inputs for k in of[name]} | {first + k for k in known.states}
        return " ".join(map(str, sorted(found | ({first - 1} if known.time and fmi == 3 else set()))))

    rates = [(first + len(derivatives) + k, listed(known)) for k, known in enumerate(derivatives)]
    direct = [(k, listed(outputs[p.name])) for p in graph.ports if p.kind == "output" for k in of[p.name]]
    initial = [(k, "") for k in [*(k for k, _ in direct), *range(first, first + 2 * len(derivatives))]]
    structure = ET.Element("ModelStructure")
    for kind, unknowns in (("Output", direct), ("Derivative", rates), ("InitialUnknown", initial)):
        above, tag, key = structure, "ContinuousStateDerivative" if kind == "Derivative" else kind, "valueReference"
        if fmi == 2 and unknowns:
            above, tag, key = ET.SubElement(structure, f"{kind}s"), "Unknown", "index"
        for k, dependent in unknowns:
            ET.SubElement(above, tag, {key: str(k)} | ({} if unknowns is initial else {"dependencies": dependent}))
    return structure


def _interfaces(graph: Graph, fmi: Fmi, identifier: str) -> list[ET.Element]:
    """Return the elements ModelExchange and CoSimulation with their capabilities.

    A graph that contains sampled blocks but states no sample time does not support Model Exchange.
    """
    spelling = "state" if fmi == 2 else "State"
    common = {
        "modelIdentifier": identifier,
        "canBeInstantiatedOnlyOncePerProcess": "false",
        f"canGetAndSetFMU{spelling}": "true",
        f"canSerializeFMU{spelling}": "true",
    }
    if fmi == 2:
        common["canNotUseMemoryManagementFunctions"] = "true"  # the binary allocates memory itself
    # a memory is updated at each accepted step; there, a graph with continuous states requests an event if an input
    # has changed discontinuously
    steps = is_hysteretic(graph) or bool(graph.continuous_states and graph.inputs)
    simulation = {"canHandleVariableCommunicationStepSize": str(not needs_step(graph)).lower()}
    if fmi == 2:
        exchange = {"completedIntegratorStepNotNeeded": str(not steps).lower()}
        simulation["canInterpolateInputs"] = "true"
        derivatives = {"providesDirectionalDerivative": "true"}
    else:
        exchange = {"needsCompletedIntegratorStep": str(steps).lower()}
        if (fixed := sample_time(graph)) is not None:
            simulation["fixedInternalStepSize"] = _without_dust(fixed)
        simulation |= {"hasEventMode": "true", "providesIntermediateUpdate": "true"}
        derivatives = {"providesDirectionalDerivatives": "true", "providesAdjointDerivatives": "true"}
    exchange |= derivatives
    simulation |= {} if is_sampled(graph) else derivatives  # the outputs of sampled blocks change only in steps
    listed = [ET.Element("CoSimulation", {**common, **simulation})]
    if graph.step > 0 or not is_sampled(graph):
        listed.insert(0, ET.Element("ModelExchange", {**common, **exchange}))
    return listed


def model_description(
    graph: Graph,
    fmi: Fmi,
    name: str,
    identifier: str,
    text: str = "",
    stop: float | None = None,
    sources: Sequence[str] = (),
    known: Mapping[str, Facts] | None = None,
) -> bytes:
    """Return the content of modelDescription.xml for a graph, in UTF-8.

    `name` is any text. `identifier` consists of letters, digits and _, and does not begin with a digit. The default
    experiment ends at the time `stop` (s), by default after 1000 steps. `sources` are the names of the source files,
    which are listed only for FMI 2.0, because FMI 3.0 lists them in buildDescription.xml. `known` contains the data
    about the ports of a fitted model.
    """
    head = {"fmiVersion": "2.0" if fmi == 2 else "3.0", "modelName": name}
    head["guid" if fmi == 2 else "instantiationToken"] = graph.token
    if text:
        head["description"] = text
    head |= {"generationTool": f"HystFMU {__version__}", "variableNamingConvention": "flat"}
    if fmi == 2:
        head["numberOfEventIndicators"] = "0"  # reversals do not need event indicators, see fmu_build/README.md
    root = ET.Element("fmiModelDescription", head)
    root.extend(_interfaces(graph, fmi, identifier))
    for interface in root if fmi == 2 and sources else ():
        listed = ET.SubElement(interface, "SourceFiles")
        for file in sources:
            ET.SubElement(listed, "File", name=file)
    for part in (unit_definitions(graph), _types(graph, fmi), _log_categories()):
        if part is not None:
            root.append(part)
    step = suitable_step(graph)
    end, size = _without_dust(1000 * step if stop is None else stop), _without_dust(step)
    ET.SubElement(root, "DefaultExperiment", startTime="0.0", stopTime=end, stepSize=size)
    root.append(_variables(graph, fmi, known or {}))
    root.append(_structure(graph, fmi))
    return xml_file(root)
