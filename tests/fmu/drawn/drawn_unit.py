"""Foreign FMUs with drawn variables of all types: the one binary of a version of FMI reads them from its token."""

import math
import random
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import fmpy
import pytest

HEADERS = Path(fmpy.__file__).parent / "c-code"
SOURCE = Path(__file__).with_suffix(".c")
LETTERS: dict[int, dict[str, str]] = {
    2: {"Real": "d", "Integer": "i", "Enumeration": "e", "Boolean": "?", "String": "s"},
    3: {
        **{"Float64": "d", "Float32": "f", "Int8": "b", "UInt8": "B", "Int16": "h", "UInt16": "H", "Int32": "i"},
        **{"UInt32": "I", "Int64": "q", "UInt64": "Q", "Boolean": "?", "String": "s", "Enumeration": "e"},
    },
}
_CAUSALITY = {"input": "u", "parameter": "p", "structuralParameter": "c", "output": "y"}
_WORDS = ("", "plain", "two words", "%d %s%", "Grüße", 'quoted "x" & <y>', "*1.2", "x" * 60)
_ODD = ("a\tb\nc\rd", " lead, trail; ", "a\x01b")


@dataclass(frozen=True)
class Variable:
    """A variable; `sized_by` is the place of the structural parameter that states its size."""

    name: str
    type: str
    causality: str
    start: tuple[Any, ...]
    sized_by: int | None = None

    @property
    def is_array(self) -> bool:
        """Whether it has a dimension, of whatever size."""
        return self.sized_by is not None or len(self.start) > 1

    def elements(self, size: int | None = None) -> tuple[str, ...]:
        """Names of its elements; `size` is that of the structural parameter, if it is not the one of the file."""
        n = len(self.start) if size is None or self.sized_by is None else size
        return (self.name,) if n == 1 else tuple(f"{self.name}_{i + 1}" for i in range(n))


def bounds(kind: str) -> tuple[int, int]:
    """The smallest and the largest number of an integer type."""
    bits = int("".join(c for c in kind if c.isdigit()) or 32)
    return (0, 2**bits - 1) if kind.startswith("U") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


def value(rng: random.Random, kind: str, exact: bool = True) -> Any:
    """Draw a value of a type; without `exact` every number is finite and one that a double holds."""
    if kind in ("Real", "Float64", "Float32"):
        odd = [math.inf, -math.inf, math.nan] if exact and rng.random() < 0.1 else []
        return rng.choice(odd or [0.0, -0.0, 0.1, -2.5, 1e-30, 3e38, rng.uniform(-10, 10)])
    if kind == "Boolean":
        return rng.random() < 0.5
    if kind == "String":
        return rng.choice(_WORDS + (_ODD if exact else ()))
    if kind == "Enumeration":
        return rng.randint(1, 3)
    low, high = bounds(kind)
    drawn = rng.choice([0, low, high, high - 1, rng.randint(low, high), rng.randint(0, 9)])
    return drawn if exact or int(float(drawn)) == drawn else rng.randint(0, 9)


def drawn(rng: random.Random, fmi: int) -> list[Variable]:
    """Draw the variables of an FMU; it has an output that is a number."""
    numeric = [t for t in LETTERS[fmi] if t != "String"]
    made: list[Variable] = []
    structural = None
    if fmi == 3 and rng.random() < 0.3:
        made.append(Variable("n", "UInt64", "structuralParameter", (rng.randint(1, 4),)))
        structural = 0
    for causality, name, most in (("parameter", "p", 5), ("input", "u", 4), ("output", "y", 4)):
        for k in range(rng.randint(1, most)):
            kinds = numeric if causality == "output" and k == 0 else list(LETTERS[fmi])
            kind, size, by = rng.choice(kinds), 1, None
            if fmi == 3 and kind != "String" and rng.random() < 0.25:
                size = rng.randint(2, 3)
                if structural is not None and rng.random() < 0.5:
                    size, by = made[structural].start[0], structural
            start = tuple(value(rng, kind, exact=False) for _ in range(size))
            made.append(Variable(f"{name}{k}", kind, causality, start, by))
    return made


def _text(kind: str, x: Any) -> str:
    return str(x).lower() if kind == "Boolean" else repr(x) if isinstance(x, float) else str(x)


def _token(fmi: int, variables: Sequence[Variable], last: int) -> str:
    words = [f"end,{last}"] if last else []
    for v in variables:
        size = len(v.start) if v.sized_by is None else f"@{v.sized_by}"
        if v.type == "String":
            starts = [f"!{x}" for x in v.start]
        else:
            starts = [str(int(x)) if isinstance(x, bool) else repr(x) for x in v.start]
        words.append(",".join([LETTERS[fmi][v.type], _CAUSALITY[v.causality], str(size), *starts]))
    return ";".join(words)


def _variability(v: Variable) -> str:
    if v.causality in ("parameter", "structuralParameter"):
        return "fixed"
    return "continuous" if v.type in ("Real", "Float64", "Float32") else "discrete"


def _description(fmi: int, variables: Sequence[Variable], last: int) -> bytes:
    token = _token(fmi, variables, last)
    root = ET.Element("fmiModelDescription", fmiVersion=f"{fmi}.0", modelName="drawn")
    root.set("guid" if fmi == 2 else "instantiationToken", token)
    able = "canGetAndSetFMUstate" if fmi == 2 else "canGetAndSetFMUState"
    simulation = ET.SubElement(root, "CoSimulation", modelIdentifier="drawn")
    simulation.set(able, "true")
    simulation.set("canHandleVariableCommunicationStepSize", "true")
    types = ET.SubElement(root, "TypeDefinitions")
    of = ET.SubElement(types, "SimpleType", name="E") if fmi == 2 else types
    listed = ET.SubElement(of, *(("Enumeration",) if fmi == 2 else ("EnumerationType", {"name": "E"})))
    for k in (1, 2, 3):
        ET.SubElement(listed, "Item", name=f"e{k}", value=str(k))
    below = ET.SubElement(root, "ModelVariables")
    structure = ET.SubElement(root, "ModelStructure")
    outputs = ET.SubElement(structure, "Outputs") if fmi == 2 else structure
    initial = ET.SubElement(structure, "InitialUnknowns") if fmi == 2 else structure
    for k, v in enumerate(variables):
        facts = {"name": v.name, "valueReference": str(k), "causality": v.causality, "variability": _variability(v)}
        if v.causality == "output":
            facts["initial"] = "calculated"
            own = {"index": str(k + 1)} if fmi == 2 else {"valueReference": str(k)}
            names = ("Unknown", "Unknown") if fmi == 2 else ("Output", "InitialUnknown")
            for of, word in zip((outputs, initial), names, strict=True):
                ET.SubElement(of, word, own)
        start = "" if v.causality == "output" else " ".join(_text(v.type, x) for x in v.start)
        if fmi == 2:
            own = ET.SubElement(ET.SubElement(below, "ScalarVariable", facts), v.type)
        else:
            own = ET.SubElement(below, v.type, facts)
        if v.type == "Enumeration":
            own.set("declaredType", "E")
        if v.sized_by is not None:
            ET.SubElement(own, "Dimension", valueReference=str(v.sized_by))
        elif len(v.start) > 1:
            ET.SubElement(own, "Dimension", start=str(len(v.start)))
        if v.causality == "output":
            continue
        if v.type == "String" and fmi == 3:
            ET.SubElement(own, "Start", value=start)
        else:
            own.set("start", start)
    return ET.tostring(root)


@cache
def library(fmi: int, *options: str) -> Path:
    """Compile the binary of a version of FMI, once in a session."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None or fmpy.platform not in ("linux64", "darwin64"):
        pytest.skip("needs a C compiler for Linux or macOS")
    folder = Path(mkdtemp(prefix="hystfmu-drawn-"))
    header = (HEADERS / f"fmi{fmi}Functions.h").read_text()
    names = set(re.findall(rf"FMI{fmi}_Export\s+\w+TYPE\s+(fmi{fmi}\w+);", header))
    (folder / "stubs.h").write_text("")
    done = subprocess.run(
        [compiler, "-E", "-P", f"-DFMI={fmi}", f"-I{HEADERS}", f"-I{folder}", str(SOURCE)],
        capture_output=True,
        text=True,
        check=True,
    )
    has = set(re.findall(rf"\b(fmi{fmi}\w+)\(", done.stdout))
    (folder / "stubs.h").write_text("".join(f"STUB({n})\n" for n in sorted(names - has)))
    made = folder / f"drawn{fmi}.so"
    flags = ["-std=gnu99", "-O1", "-shared", "-fPIC", f"-DFMI={fmi}", f"-I{HEADERS}", f"-I{folder}", *options]
    subprocess.run([compiler, *flags, str(SOURCE), "-o", str(made)], check=True)
    return made


def drawn_fmu(path: Path, fmi: int, variables: Sequence[Variable], last: int = 0) -> None:
    """Write an FMU with these variables; with `last` it ends the simulation in that step, below 0 it refuses an end."""
    suffix = fmpy.sharedLibraryExtension
    own = fmpy.platform if fmi == 2 else fmpy.platform_tuple
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", _description(fmi, variables, last))
        archive.write(library(fmi), f"binaries/{own}/drawn{suffix}")
