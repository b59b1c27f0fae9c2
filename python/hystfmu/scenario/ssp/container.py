"""Write a closed loop with foreign FMUs as one container FMU, which steps all units in the stated order.

Units that are not foreign FMUs are called own units. Own units that are neighbours in the order are joined to one FMU.
All FMUs are unpacked in `resources/units`. The binary contains the master loop of `fmu_build/master`, which calls the
units by function pointers. The file `resources/system.txt` lists the connections (format:
`fmu_build/container/system_file.h`).

This module also converts a case to the form in which other simulators run an SSP archive, and computes the difference
from the original case.

fmpy, libcosim, ecos and containers of fmu-manipulation-toolbox step all components in parallel with the values of the
previous step (Jacobi). They use one step size and no events within steps. During the initialisation, libcosim and ecos
transmit outputs repeatedly, also to components that are earlier in the order. Therefore neighbouring units are joined
to one component, so that the order of these units does not change.
"""

import hashlib
import struct
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hystfmu.base import PACKAGE, InputError, __version__, read_bytes
from hystfmu.fmu.archive import MOST_UNPACKED, xml_file, zip_file
from hystfmu.fmu.foreign.instance import Finding, carried
from hystfmu.fmu.write.platforms import binaries, host
from hystfmu.model import Model
from hystfmu.scenario.engine.member import slots
from hystfmu.scenario.engine.simulation import simulate
from hystfmu.scenario.outcome.trace import Stopped, Trace
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.events import cuts
from hystfmu.scenario.system.foreign import Foreign, ForeignPort
from hystfmu.scenario.system.spec import UnitSpec
from hystfmu.scenario.system.system import Part, System, build, fuse, segments


def as_readers_run(case: Case) -> Case:
    """Return the case with Jacobi coupling and one step, as other simulators run it.

    An InputError is raised for iterative coupling, units with different rates, substeps and a first-order hold, because
    no other simulator supports them.
    """
    if case.coupling.scheme == "iterative":
        raise InputError(f"{case.where}: the coupling must not be iterative, which SSP does not support")
    slow = [name for name, u in case.units.items() if u.every > 1]
    if slow:
        raise InputError(f"{case.where}: {slow[0]} must run in every step, because SSP has one step")
    own = [name for name, u in case.units.items() if u.substeps > 1 or u.hold != "zero"]
    if own:
        raise InputError(f"{case.where}: {own[0]} must have no substeps and no hold, which SSP does not support")
    coupling = case.coupling.model_copy(update={"scheme": "jacobi", "events": "grid"})
    return replace(case, ripple=1, coupling=coupling)


def run_as_readers(system: System) -> Trace:
    """Return the trajectory of a case from `as_readers_run`, with consistent initial values.

    An InputError is raised if the run does not reach its end, or if the units have no consistent initial values.
    """
    try:
        begins, short = system.starts(), replace(system.case, stop=0.0)
        for _ in range(len(system.parts) + 1):
            trace = simulate(replace(system, case=short, begins=tuple(begins)), "native")
            last, begins = begins, trace.values[0]
            if np.array_equal(last, begins):
                return simulate(replace(system, begins=tuple(begins)), "native")
        raise InputError(f"{system.case.where}: the initial values do not agree because of an algebraic loop")
    except Stopped as e:
        raise InputError(
            f"{system.case.where}: with the coupling of SSP readers (Jacobi): {e}; one FMU (-o X.fmu) keeps the order"
        ) from None


def differences(case: Case, names: Mapping[str, str], trace: Trace) -> dict[str, float]:
    """Return the largest difference between the trace of an archive and the simulated case for each recorded output.

    `trace` is the result of a run of the archive. `names` maps each output of the case to its name in the archive. The
    difference is in percent of the span of the output in the case, or in percent of the largest value for a constant
    output. Stopped is raised if the case does not run.
    """
    own = simulate(build(case), "native")
    found = {}
    for name in case.record or names:
        want = own[name][:: case.ripple]
        span = float(np.ptp(want)) or float(np.abs(want).max()) or 1.0
        found[name] = 100 * float(np.abs(trace[names[name]] - want).max()) / span
    return found


def _groups(system: System) -> list[tuple[int, ...]]:
    """Return groups of own units that are neighbours in the order.

    A group is divided if it would contain an algebraic loop as one graph.
    """
    found: list[tuple[int, ...]] = []
    for foreign, run in groupby(range(len(system.parts)), lambda k: isinstance(system.parts[k].graph, Foreign)):
        parts = tuple(run)
        if foreign:
            found += [(k,) for k in parts]
            continue
        try:
            fuse(system, parts)
            found.append(parts)
        except InputError:
            found += [g for g in segments(system, cut=False) if g[0] in parts]
    return found


def joined(system: System) -> tuple[Case, dict[str, str]]:
    """Return the case of a system in which neighbours that can step as one graph are one unit.

    Outputs and recorded signals have names of the form `unit_output`. Also return a map from the names in the system to
    these names.
    """
    case, groups = system.case, _groups(system)
    units: dict[str, UnitSpec] = {}
    attached = dict(case.attached)
    places: dict[tuple[int, int], str] = {}  # maps (part, input) to `component.input`
    names: dict[str, str] = {}
    constants: dict[str, dict[str, float]] = {}
    for group in groups:
        parts = [system.parts[k] for k in group]
        first = parts[0]
        if isinstance(first.graph, Foreign):
            unit, constants[first.name] = first.name, first.constants
            attached[unit] = first.graph.path
            units[unit] = UnitSpec.model_validate({"fmu": unit, "set": dict(first.graph.settings)})
            names |= {f"{unit}.{o}": f"{unit}.{o}" for o in first.outputs}
            places |= {(group[0], i): f"{unit}.{name}" for i, name in enumerate(first.inputs)}
            continue
        graph, outside = fuse(system, group)
        unit = case.scenario if len(groups) == 1 else f"{first.name}_to_{parts[-1].name}" if parts[1:] else first.name
        attached[unit] = Model(unit, graph, case.step)
        units[unit] = UnitSpec.model_validate({"model": unit, "as": first.runs_as})
        names |= {f"{p.name}.{o}": f"{unit}.{p.name}_{o}" for p in parts for o in p.outputs}
        for k, i in outside:
            part = system.parts[k]
            places[k, i] = f"{unit}.{part.name}_{part.inputs[i]}"
            if (value := part.constants.get(part.inputs[i])) is not None:
                constants.setdefault(unit, {})[f"{part.name}_{part.inputs[i]}"] = value
    units = {name: u.model_copy(update={"inputs": constants.get(name, {})}) for name, u in units.items()}
    ends = {place: names[end] for end, place in system.columns.items()}
    new = replace(
        case,
        order=tuple(units),
        units=units,
        connections={places[n.to, n.input]: ends[n.source] for n in system.links if (n.to, n.input) in places},
        record=tuple(names[end] for end in case.record),
        metrics={},
        loops=(),
        overrides={},
        attached=attached,
    )
    return new, names


_PLAIN = frozenset(b"/._~-:{}abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789")
_SCHEMES = {"gauss_seidel": 0, "jacobi": 1}
# letters of the types in value.h
_REAL, _WHOLE, _TRUTH, _STRING = "d", "i", "?", "s"
_LETTERS = {
    **{"Real": _REAL, "Float64": _REAL, "Float32": "f", "Boolean": _TRUTH, "String": _STRING, "Integer": _WHOLE},
    **{"Int8": "b", "UInt8": "B", "Int16": "h", "UInt16": "H", "Int32": _WHOLE, "UInt32": "I"},
    **{"Int64": "q", "UInt64": "Q"},
}
_OUTSIDE = {"b": _WHOLE, "B": _WHOLE, "h": _WHOLE, "H": _WHOLE, "e": _WHOLE, _WHOLE: _WHOLE, _TRUTH: _TRUTH}
"""Return the type of an output of the container: the type in FMI 2.0 for its values, else Real."""
_ELEMENTS = {_REAL: "Real", _WHOLE: "Integer", _TRUTH: "Boolean"}


@dataclass(frozen=True)
class _Variable:
    """An input or an output of a unit; an array of FMI 3.0 has several elements."""

    name: str
    letter: str
    reference: int
    elements: tuple[str, ...]
    described: Any
    """Description of the variable in a foreign FMU; None in an own FMU, where all variables are real numbers."""


def container_fmu(system: System, name: str) -> bytes:
    """Return the archive of an FMU 2.0 for Co-Simulation. `name` is the model name and the model identifier.

    An InputError is raised if a container does not support the coupling or a unit, or if the package has no binary.
    """
    _check(system)
    binary = PACKAGE / f"_container.{host().suffix}"
    if not binary.exists():
        raise InputError(
            f"{system.case.where}: a loop with foreign FMUs needs the compiled container binary, which is missing: "
            "install the package with 'pip install .'"
        )
    files: dict[str, bytes] = {}
    lines: list[str] = []
    for k in range(len(system.parts)):
        lines += _unit(system, k, files)
    body = _system(system, lines)
    token = hashlib.sha256(body.encode() + b"".join(files[f] for f in sorted(files))).hexdigest()[:32]
    entries = {
        "modelDescription.xml": _description(system, name, token),
        f"binaries/{host().folder(2)}/{name}.{host().suffix}": binary.read_bytes(),
        "resources/system.txt": f"hystfmu-system 2\ntoken {token}\n{body}".encode(),
        "documentation/licenses/license.txt": (PACKAGE / "LICENSE").read_bytes(),
    }
    return zip_file(entries | {f"resources/units/{f}": c for f, c in files.items()}, executable="binaries/")


def _check(system: System) -> None:
    where = system.case.where
    if system.case.coupling.scheme not in _SCHEMES:
        raise InputError(f"{where}: the coupling of a container must not be iterative")
    for p in system.parts:
        if p.hold != "zero":
            raise InputError(f"{where}: {p.name} must have no hold, which a container does not support")
        if isinstance(p.graph, Foreign) and (p.graph.fmi == 1 or p.graph.description.coSimulation is None):
            raise InputError(f"{where}: {p.name}: a unit of a container must support Co-Simulation of FMI 2.0 or 3.0")
    if len(cuts(system)[0]):
        raise InputError(f"{where}: coupling.events must be 'grid': a container locates no events between steps")
    for name, n in Counter(map(_outside_name, system.columns)).items():
        if n > 1:
            ends = " and ".join(end for end in system.columns if _outside_name(end) == name)
            raise InputError(f"{where}: {ends}: both outputs would have the name {name} in a container")


def _outside_name(end: str) -> str:
    return end.replace(".", "_")


def _fmi(part: Part) -> Literal[2, 3]:
    return 3 if isinstance(part.graph, Foreign) and part.graph.fmi == 3 else 2


def _letter(described: Any, fmi: int) -> str | None:
    """Return the letter of a type, or None if the container does not support the type."""
    if described is None:
        return _REAL
    if described.type == "Enumeration":
        return "e" if fmi == 3 else _WHOLE
    return _LETTERS.get(described.type)


def _variables(part: Part, kind: str) -> list[_Variable]:
    fmi, found = _fmi(part), []
    for p in part.graph.ports:
        described = p.variable if isinstance(p, ForeignPort) else None
        reference = int(p.variable.valueReference) if isinstance(p, ForeignPort) else p.reference
        letter = _letter(described, fmi)
        for k, (name, elements) in enumerate(slots(p, fmi) if p.kind == kind else ()):
            assert letter is not None, "ports of a foreign FMU are numbers and booleans"
            found.append(_Variable(name, letter, reference + k, elements, described))
    return found


def _unit(system: System, k: int, files: dict[str, bytes]) -> list[str]:
    """Return the lines of a unit in system.txt, and add the files of the unit to `files`."""
    part = system.parts[k]
    told: dict[bool, list[str]] = {True: [], False: []}
    if isinstance(part.graph, Foreign):
        root, token, library = _foreign(system, part, files)
        variables = {v.name: v for v in part.graph.description.modelVariables}
        for n, value in part.graph.settings.items():
            v = variables[n]
            values = value if isinstance(value, list) else [value]
            told[v.causality == "structuralParameter"].append(_told(system, part, v, int(v.valueReference), values))
    else:
        root, token, library = _own(part, system.length(part) / part.substeps, files)
    sources = {part.inputs[n.input]: n.source for n in system.links if n.to == k}
    inputs, made = _variables(part, "input"), _variables(part, "output")
    linked = [v for v in inputs if any(n in sources for n in v.elements)]
    fixed = [
        _told(system, part, v.described, v.reference, [part.constants.get(n, 0.0) for n in v.elements])
        for v in inputs
        if v not in linked
    ]
    words = [_string(part.name), str(_fmi(part)), _string(library), _string(root), _string(token)]
    steps = [str(part.period), str(part.substeps), _bits(system.length(part) / part.substeps), str(part.first)]
    ends = [
        f"{_head(v)} {' '.join(f'{sources.get(n, -1)} {_bits(part.constants.get(n, 0.0))}' for n in v.elements)}"
        for v in linked
    ]
    return [
        f"unit {' '.join([*words, *steps])}",
        f"structural {_list(told[True])}",
        f"parameters {_list(told[False])}",
        f"inputs {_list(fixed)}",
        f"connected {len(linked)} {sum(len(v.elements) for v in linked)} {' '.join(ends)}",
        f"outputs {len(made)} {len(part.outputs)} {' '.join(map(_head, made))}",
    ]


def _head(v: _Variable) -> str:
    return f"{v.letter} {_string(v.name)} {v.reference} {len(v.elements)}"


def _foreign(system: System, part: Part, files: dict[str, bytes]) -> tuple[str, str, str]:
    foreign = part.graph
    assert isinstance(foreign, Foreign)
    folder, root = Path(foreign.folder), part.name
    for file in sorted(folder.rglob("*")):
        relative = file.relative_to(folder).as_posix()
        if file.is_file() and not relative.startswith(("binaries/", "sources/")):
            files[f"{root}/{relative}"] = read_bytes(file, MOST_UNPACKED)
    own, name = host().folder(_fmi(part)), foreign.description.coSimulation.modelIdentifier
    library = folder / "binaries" / own / f"{name}.{host().suffix}"
    if not library.exists():
        raise InputError(f"{system.case.where}: {part.name}: {foreign.path} has no binary in binaries/{own}")
    for file in sorted(library.parent.rglob("*")):
        if file.is_file():
            files[f"{root}/{file.relative_to(folder).as_posix()}"] = read_bytes(file, MOST_UNPACKED)
    place = f"units/{root}/binaries/{own}/{name}.{host().suffix}"
    return f"units/{root}/resources/", str(foreign.description.guid), place


def _own(part: Part, step: float, files: dict[str, bytes]) -> tuple[str, str, str]:
    """Return a graph as an FMU. All own FMUs use the same binary."""
    graph = part.own.with_step(step)
    ((path, binary),) = binaries(2, "hystfmu", "host").items()
    library = f"own/{path.rpartition('/')[2]}"
    files[library] = binary.content
    files[f"{part.name}/resources/block.bin"] = graph.to_bytes()
    return f"units/{part.name}/resources/", graph.token, f"units/{library}"


def _told(system: System, part: Part, v: Any, reference: int, values: Sequence[Any]) -> str:
    """Return the line in system.txt of a value that is set only once. `v` describes the variable in a foreign FMU."""
    letter = _letter(v, _fmi(part))
    if letter is None:
        raise InputError(f"{system.case.where}: {part.name}.{v.name}: a container cannot set values of type {v.type}")
    words = []
    for x in values:
        if letter == _STRING:
            words.append(_string(str(x)))
            continue
        try:
            number = x if v is None else carried(v, x)
        except Finding as e:
            raise InputError(f"{system.case.where}: {part.name}.{e}") from None
        words.append(_bits(number) if letter in (_REAL, "f") else str(int(number)))
    return f"{letter} {reference} {len(values)} {' '.join(words)}"


def _types(system: System) -> list[str]:
    """Return the type that every value has as an output of the container."""
    letters = [v.letter for p in system.parts for v in _variables(p, "output") for _ in v.elements]
    return [_OUTSIDE.get(letter, _REAL) for letter in letters]


def _system(system: System, units: list[str]) -> str:
    case = system.case
    starts = [f"{t} {_bits(x)}" for t, x in zip(_types(system), system.starts().tolist(), strict=True)]
    head = [
        f"coupling {_SCHEMES[case.coupling.scheme]} {case.ripple} {_bits(case.step)} {_bits(system.h)}",
        f"values {_list(starts)}",
        f"units {len(system.parts)}",
    ]
    return "\n".join([*head, *units]) + "\n"


def _description(system: System, name: str, token: str) -> bytes:
    head = {"fmiVersion": "2.0", "modelName": name, "guid": token, "variableNamingConvention": "flat"}
    order = ", ".join(p.name for p in system.parts)
    words = f"loop of the {system.case.description}; {len(system.parts)} units, stepped in the order {order}"
    root = ET.Element("fmiModelDescription", head | {"description": words, "generationTool": f"HystFMU {__version__}"})
    able = {"modelIdentifier": name, "canNotUseMemoryManagementFunctions": "true"}
    for limit in ("needsExecutionTool", "canBeInstantiatedOnlyOncePerProcess"):  # of a unit, hence of the container
        interfaces = (p.graph.description.coSimulation for p in system.parts if isinstance(p.graph, Foreign))
        able |= {limit: "true"} if any(getattr(i, limit) for i in interfaces) else {}
    ET.SubElement(root, "CoSimulation", able)
    step = system.case.step
    experiment = {"startTime": "0.0", "stopTime": repr(system.case.stop), "stepSize": repr(step)}
    ET.SubElement(root, "DefaultExperiment", experiment)
    variables = ET.SubElement(root, "ModelVariables")
    listed = ET.Element("Outputs")
    initial = ET.Element("InitialUnknowns")
    for (end, k), letter in zip(system.columns.items(), _types(system), strict=True):
        facts = {"name": _outside_name(end), "valueReference": str(k), "description": end, "causality": "output"}
        facts |= {"variability": "continuous" if letter == _REAL else "discrete", "initial": "calculated"}
        ET.SubElement(ET.SubElement(variables, "ScalarVariable", facts), _ELEMENTS[letter])
        for of in (listed, initial):
            ET.SubElement(of, "Unknown", index=str(k + 1), dependencies="")
    structure = ET.SubElement(root, "ModelStructure")
    structure.extend([listed, initial])
    return xml_file(root)


def _bits(x: float) -> str:
    return struct.pack(">d", x).hex()


def _string(text: str) -> str:
    return "".join(chr(b) if b in _PLAIN else f"%{b:02X}" for b in text.encode()) or "%"


def _list(words: Iterable[str]) -> str:
    found = list(words)
    return " ".join([str(len(found)), *found])
