"""A closed loop with foreign FMUs as one FMU: a container that steps FMUs, ours and foreign, in the stated order.

Our neighbours between foreign FMUs are one FMU each.  The units lie unpacked in `resources/units`; the binary is the
master loop of `fmu_build/master` around function pointers, and `resources/system.txt` says what is connected to what
(`fmu_build/container/system_file.h`).
"""

from __future__ import annotations

import hashlib
import struct
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Literal

import hystfmu
from hystfmu.base.errors import InputError
from hystfmu.base.files import read_bytes
from hystfmu.base.package_files import PACKAGE
from hystfmu.fmu.archive.unpack import MOST_UNPACKED
from hystfmu.fmu.archive.xml_file import xml_file
from hystfmu.fmu.archive.zip_file import zip_file
from hystfmu.fmu.write.platforms import binaries, host
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import Part, System

_PLAIN = frozenset(b"/._~-:{}abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789")
_SCHEMES = {"gauss_seidel": 0, "jacobi": 1}
_TYPES: dict[str, str] = {
    **{"Real": "r", "Integer": "i", "Enumeration": "i", "Boolean": "b", "String": "s"},
    **{"Float64": "r", "Int32": "i", "Int64": "l"},
}


def container_fmu(system: System, name: str) -> bytes:
    """The archive of an FMU 2.0 for Co-Simulation.

    Parameters
    ----------
    system : System
        Its units are foreign FMUs or graphs; every unit has value references of its own.
    name : str
        Model name and identifier.

    Raises
    ------
    InputError
        A coupling or a unit that a container does not step; the binary is not installed.
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
    places = _places(system)
    for k in range(len(system.parts)):
        lines += _unit(system, k, places, files)
    body = _system(system, places, lines)
    token = hashlib.sha256(body.encode() + b"".join(files[f] for f in sorted(files))).hexdigest()[:32]
    entries = {
        "modelDescription.xml": _description(system, places, name, token),
        f"binaries/{host().folder(2)}/{name}.{host().suffix}": binary.read_bytes(),
        "resources/system.txt": f"hystfmu-system 1\ntoken {token}\n{body}".encode(),
        "documentation/licenses/license.txt": (PACKAGE / "LICENSE").read_bytes(),
    }
    return zip_file(entries | {f"resources/units/{f}": c for f, c in files.items()}, executable="binaries/")


def _check(system: System) -> None:
    where = system.case.where
    if system.case.coupling.scheme not in _SCHEMES:
        raise InputError(f"{where}: a container steps in order or all at once, not with iterative coupling")
    for p in system.parts:
        if p.hold != "zero":
            raise InputError(f"{where}: {p.name} has a hold of its own: a container knows none")
        if isinstance(p.graph, Foreign) and (p.graph.fmi == 1 or p.graph.description.coSimulation is None):
            raise InputError(f"{where}: {p.name}: a container steps FMI 2.0 and 3.0 for Co-Simulation")
    real = {
        f"{p.name}.{n}" for p in system.parts for kind in ("input", "output") for s in _slots(p, kind, 2) for n in s
    }
    ends = {place: end for end, place in system.columns.items()}
    for link in system.links:
        to = system.parts[link.to]
        for end in (f"{to.name}.{to.inputs[link.input]}", ends[link.source]):
            if end not in real:
                raise InputError(f"{where}: {end}: a container connects real inputs and outputs")


def _places(system: System) -> dict[str, int]:
    """The place of every real output among the values of the container; those of a unit stand side by side."""
    ends = [f"{p.name}.{n}" for p in system.parts for s in _slots(p, "output", 2) for n in s]
    return {end: k for k, end in enumerate(ends)}


def _unit(system: System, k: int, places: dict[str, int], files: dict[str, bytes]) -> list[str]:
    """The lines of a unit; its files are added to `files`."""
    part, outputs = system.parts[k], {place: end for end, place in system.columns.items()}
    if isinstance(part.graph, Foreign):
        root, fmi, token, library = _foreign(system, part, files)
        variables = {v.name: v for v in part.graph.description.modelVariables}
        reference = {n: int(v.valueReference) for n, v in variables.items()}
        told = [
            _told(system, part, _TYPES.get(variables[n].type), reference[n], value)
            for n, value in part.graph.settings.items()
        ]
    else:
        root, fmi, token, library = _own(part, system.length(part) / part.substeps, files)
        reference = {n: p.reference + i for p in part.own.ports for i, n in enumerate(p.scalar_names)}
        told = []
    source = {part.inputs[n.input]: places[outputs[n.source]] for n in system.links if n.to == k}
    slots = {kind: _slots(part, kind, fmi) for kind in ("input", "output")}
    fixed = [s for s in slots["input"] if not any(n in source for n in s)]
    linked = [s for s in slots["input"] if s not in fixed]
    read = [n for s in linked for n in s]

    def place(slot: Sequence[str]) -> int:
        return reference[slot[0]] if slot[0] in reference else reference[slot[0].partition("[")[0]]

    inputs = [f"r {place(s)} {len(s)} {' '.join(_bits(part.constants.get(n, 0.0)) for n in s)}" for s in fixed]
    period = [_string(part.name), fmi, _string(library), _string(root), _string(token), part.period, part.substeps]
    ends = [f"{source.get(n, -1)} {_bits(part.constants.get(n, 0.0))}" for n in read]
    made = [n for s in slots["output"] for n in s]
    first = places[f"{part.name}.{made[0]}"] if made else 0
    return [
        f"unit {' '.join(map(str, period))} {_bits(system.length(part) / part.substeps)} {first}",
        f"parameters {len(told)} {' '.join(told)}",
        f"inputs {len(inputs)} {' '.join(inputs)}",
        f"connected {_list(place(s) for s in linked)} {len(read)} {' '.join(ends)}",
        f"outputs {_list(place(s) for s in slots['output'])} {len(made)}",
    ]


def _slots(part: Part, kind: str, fmi: int) -> list[tuple[str, ...]]:
    """Names of the elements of every real variable of the FMU: an array of FMI 3.0 is one variable."""
    found: list[tuple[str, ...]] = []
    for p in part.graph.ports:
        variable = getattr(p, "variable", None)
        if p.kind == kind and (variable is None or variable.type in ("Real", "Float64")):
            found += [p.scalar_names] if fmi == 3 else [(n,) for n in p.scalar_names]
    return found


def _foreign(system: System, part: Part, files: dict[str, bytes]) -> tuple[str, int, str, str]:
    foreign = part.graph
    assert isinstance(foreign, Foreign)
    folder, root = Path(foreign.folder), part.name
    for file in sorted(folder.rglob("*")):
        relative = file.relative_to(folder).as_posix()
        if file.is_file() and not relative.startswith(("binaries/", "sources/")):
            files[f"{root}/{relative}"] = read_bytes(file, MOST_UNPACKED)
    fmi: Literal[2, 3] = 2 if foreign.fmi == 2 else 3
    own, name = host().folder(fmi), foreign.description.coSimulation.modelIdentifier
    library = folder / "binaries" / own / f"{name}.{host().suffix}"
    if not library.exists():
        raise InputError(f"{system.case.where}: {part.name}: {foreign.path} has no binary in binaries/{own}")
    for file in sorted(library.parent.rglob("*")):
        if file.is_file():
            files[f"{root}/{file.relative_to(folder).as_posix()}"] = read_bytes(file, MOST_UNPACKED)
    place = f"units/{root}/binaries/{own}/{name}.{host().suffix}"
    return f"units/{root}/resources/", fmi, str(foreign.description.guid), place


def _own(part: Part, step: float, files: dict[str, bytes]) -> tuple[str, int, str, str]:
    """A graph as an FMU of its version of the standard; all of ours share one binary."""
    graph = part.own.with_step(step)
    ((path, binary),) = binaries(2, "hystfmu", "host").items()
    library = f"own/{path.rpartition('/')[2]}"
    files[library] = binary.content
    files[f"{part.name}/resources/block.bin"] = graph.to_bytes()
    return f"units/{part.name}/resources/", 2, graph.token, f"units/{library}"


def _told(system: System, part: Part, kind: str | None, reference: int, value: object) -> str:
    if kind is None or not isinstance(value, float | int | str):
        raise InputError(f"{system.case.where}: {part.name}: a container sets no parameter of that type")
    if kind == "s":
        return f"s {reference} 1 {_string(str(value))}"
    return f"{kind} {reference} 1 {_bits(float(value))}"


def _system(system: System, places: dict[str, int], units: list[str]) -> str:
    case, all_starts = system.case, system.starts().tolist()
    starts = [all_starts[system.columns[end]] for end in places]
    head = [
        f"coupling {_SCHEMES[case.coupling.scheme]} {case.ripple} {_bits(case.step)} {_bits(system.h)}",
        f"values {len(starts)} {' '.join(map(_bits, starts))}",
        f"units {len(system.parts)}",
    ]
    return "\n".join([*head, *units]) + "\n"


def _description(system: System, places: dict[str, int], name: str, token: str) -> bytes:
    head = {"fmiVersion": "2.0", "modelName": name, "guid": token, "variableNamingConvention": "flat"}
    order = ", ".join(p.name for p in system.parts)
    words = f"loop of the {system.case.description}; {len(system.parts)} units, stepped in the order {order}"
    root = ET.Element(
        "fmiModelDescription", head | {"description": words, "generationTool": f"HystFMU {hystfmu.__version__}"}
    )
    ET.SubElement(root, "CoSimulation", modelIdentifier=name, canNotUseMemoryManagementFunctions="true")
    step = system.case.step
    experiment = {"startTime": "0.0", "stopTime": repr(system.case.stop), "stepSize": repr(step)}
    ET.SubElement(root, "DefaultExperiment", experiment)
    variables = ET.SubElement(root, "ModelVariables")
    listed = ET.Element("Outputs")
    initial = ET.Element("InitialUnknowns")
    for end, k in places.items():
        facts = {"name": end.replace(".", "_"), "valueReference": str(k), "description": end}
        facts |= {"causality": "output", "variability": "continuous", "initial": "calculated"}
        ET.SubElement(ET.SubElement(variables, "ScalarVariable", facts), "Real")
        for of in (listed, initial):
            ET.SubElement(of, "Unknown", index=str(k + 1), dependencies="")
    structure = ET.SubElement(root, "ModelStructure")
    structure.extend([listed, initial])
    return xml_file(root)


def _bits(x: float) -> str:
    return struct.pack(">d", x).hex()


def _string(text: str) -> str:
    return "".join(chr(b) if b in _PLAIN else f"%{b:02X}" for b in text.encode()) or "%"


def _list(numbers: Iterable[int]) -> str:
    found = [str(n) for n in numbers]
    return " ".join([str(len(found)), *found])
