"""C source of a graph, valid as C99 and C++20: the folder `sources` of an FMU, or two files for a target without FMI.

The package contains the amalgamated source of the C core (`fmu_build/sources/amalgamate.py`). The C file of a graph
contains its block file as a constant, followed by those sections of the amalgamated source that the graph needs. The
files `target.h.txt` and `target.c.txt` are the templates of the code for a target.
"""

import ctypes as C
import functools
import re
import textwrap
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from string import Template

from hystfmu.base import PACKAGE
from hystfmu.core.library import RawError, library
from hystfmu.fmu.archive import xml_file
from hystfmu.fmu.write.description import Fmi
from hystfmu.graph import Graph, Port

OPTIONS = "-ffp-contract=off -fno-math-errno"  # without them, results may differ in the last bits
_PER_LINE = 24


@functools.cache
def _sections() -> dict[str, str]:
    path = PACKAGE / "_sources.c"
    if not path.exists():
        raise ImportError("the C sources are missing: install the package with 'pip install .'")
    first, *parts = re.split(r"^/\* ==== (\S+) ==== \*/\n", path.read_text(), flags=re.M)
    return {"licence": first, **dict(zip(parts[::2], parts[1::2], strict=True))}


def wanted(name: str, blocks: set[str], fmi: Fmi) -> bool:
    """Return whether the source of an FMU needs the section `name` of the amalgamated source.

    The sections of unused blocks and of the other version of FMI are not needed.
    """
    folder, _, file = name.rpartition("/")
    if folder.startswith("core/blocks/") and file.endswith(".c"):
        return file.removesuffix(".c") in blocks
    other = "fmi3" if fmi == 2 else "fmi2"
    return not (folder == "fmi/standards" and file.startswith(other))


def core_text(graph: Graph, name: str, comment: str, wanted: Callable[[str], bool]) -> str:
    """Return the C source of a graph: licence, comment, block file as a constant, and sections of the C core.

    The function `wanted` decides, for the name of a section, whether the section is included. Every public symbol
    begins with ``name_``.
    """
    content = graph.to_bytes()
    lines = [",".join(map(str, content[k : k + _PER_LINE])) for k in range(0, len(content), _PER_LINE)]
    sections = {k: v for k, v in _sections().items() if k == "licence" or wanted(k)}
    head = [
        sections.pop("licence"),
        f"/* {comment} */\n",
        # a graph need not use every function of a header
        '#if defined(__clang__)\n#pragma clang diagnostic ignored "-Wunused-function"\n#endif\n',
        f"#define HYST_PREFIX {name}_\n",
        "#define HYST_BLOCKS(B) " + " ".join(f"B({b})" for b in sorted({n.type for n in graph.nodes})) + "\n",
        f"static const unsigned char hyst_block_file[{len(content)}] = {{\n" + ",\n".join(lines) + "};\n",
    ]
    return "".join([*head, *(f"/* ==== {k} ==== */\n{v}" for k, v in sections.items())])


def source_file(graph: Graph, fmi: Fmi, name: str) -> bytes:
    """Return the C source of an FMU for one version of FMI, with the blocks that the graph uses.

    Every public symbol begins with ``name``. The functions of FMI have this prefix if the build defines
    FMI2_FUNCTION_PREFIX or FMI3_FUNCTION_PREFIX as ``name_``.
    """
    blocks = {n.type for n in graph.nodes}
    comment = (
        f"The FMU {name} for FMI {fmi}.0: build it with {OPTIONS}; it needs fmi{fmi}Functions.h and the C library."
    )
    return core_text(graph, name, comment, lambda section: wanted(section, blocks, fmi)).encode()


def build_description(name: str) -> bytes:
    """Return the content of buildDescription.xml (FMI Specification 3.0.1, section 2.5.1.3).

    The file states a C99 compiler and the compiler options `OPTIONS`.
    """
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=name, description="C library only")
    attributes = {"name": "gcc", "language": "C99", "compiler": "gcc", "compilerOptions": OPTIONS}
    ET.SubElement(ET.SubElement(configuration, "SourceFileSet", attributes), "SourceFile", name=f"{name}.c")
    return xml_file(root)


_WIDTH = 118


def target_files(graph: Graph, name: str, step: float, text: str) -> dict[str, bytes]:
    """Return the files ``name.h`` and ``name.c`` for a graph with one scalar output.

    The target calls the code every `step` (s).

    Every public symbol begins with ``name_``. `text` is a description in one line.
    """
    inputs = [p for p in graph.ports if p.kind == "input"]
    (output,) = (p for p in graph.ports if p.kind == "output")
    blocks = {n.type for n in graph.nodes}

    def section(found: str) -> bool:
        standard = found.startswith(("fmi/", "sources/", "core/graph/message."))  # messages need the C library
        return not standard and wanted(found, blocks, 2)

    named = {
        "name": name,
        "step": repr(step),
        "options": OPTIONS,
        "comment": "\n * ".join(textwrap.wrap(f"{_comment(text)}.", _WIDTH)),
        "inputs": "\n".join(f"  double {p.name}; /* {_meaning(p)} */" for p in inputs),
        "starts": ", ".join(repr(p.start[0]) for p in inputs),
        "parameters": ",\n".join(f"  {name}_{p.name} = {p.reference}" for p in graph.ports if p.kind == "param"),
        "gives": "\n".join(
            f"  if (!wrong) wrong = (int)hyst_graph_set(target_graph, {p.reference}, in->{p.name});" for p in inputs
        ),
        "output": output.reference,
        "bytes": _bytes(graph),
    }
    body = core_text(graph, name, f"{_comment(text)}: build it with {OPTIONS}.", section)
    texts = [Template(Path(__file__).with_name(f"target.{k}.txt").read_text("utf-8")).substitute(named) for k in "hc"]
    return {f"{name}.h": texts[0].encode(), f"{name}.c": f"{body}\n{texts[1]}".encode()}


def _meaning(p: Port) -> str:
    return _comment(p.text) + ("" if p.unit in ("", "1") else f", in {p.unit}")


def _bytes(graph: Graph) -> int:
    """Return the memory (bytes) that an instance needs with 64-bit pointers; with 32-bit pointers it needs less."""
    content, size, error = graph.to_bytes(), C.c_size_t(), RawError()
    if library().hyst_graph_measure(content, len(content), C.byref(size), C.byref(error)):
        raise RuntimeError("the core does not open its own block file")
    return size.value


def _comment(text: str) -> str:
    """Return a text in a form that cannot end a C comment."""
    return " ".join(text.replace("*/", "* /").replace("/*", "/ *").split())
