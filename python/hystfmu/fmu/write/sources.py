"""Write the `sources` directory of an FMU: one C99 (and C++20) file without file access, and its build description.

The package contains the amalgamated text of the core (`fmu_build/sources/amalgamate.py`).  The C file holds the block
file as a constant, then the sections of that text that the graph needs.
"""

from __future__ import annotations

import functools
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable

from hystfmu.base import PACKAGE
from hystfmu.fmu.archive.xml_file import xml_file
from hystfmu.fmu.write.description import Fmi
from hystfmu.graph import Graph

OPTIONS = "-ffp-contract=off -fno-math-errno"  # without them the last bits may differ on some processors
_PER_LINE = 24


@functools.cache
def _sections() -> dict[str, str]:
    path = PACKAGE / "_sources.c"
    if not path.exists():
        raise ImportError("the C sources are missing: install the package with 'pip install .'")
    first, *parts = re.split(r"^/\* ==== (\S+) ==== \*/\n", path.read_text(), flags=re.M)
    return {"licence": first, **dict(zip(parts[::2], parts[1::2], strict=True))}


def wanted(name: str, blocks: set[str], fmi: Fmi) -> bool:
    """Return whether a section belongs to the source of an FMU: used blocks and functions of its standard."""
    folder, _, file = name.rpartition("/")
    if folder.startswith("core/blocks/") and file.endswith(".c"):
        return file.removesuffix(".c") in blocks
    other = "fmi3" if fmi == 2 else "fmi2"
    return not (folder == "fmi/standards" and file.startswith(other))


def core_text(graph: Graph, name: str, comment: str, wanted: Callable[[str], bool]) -> str:
    """Return the licence, a comment, the block file as a constant, and the sections of the core that are wanted.

    Parameters
    ----------
    graph : Graph
        Gives the block file and names the blocks.
    name : str
        Every public symbol begins with ``name_``.
    comment : str
        One line for a reader.
    wanted : function of str
        Returns whether a section is included, from its name.
    """
    content = graph.to_bytes()
    lines = [",".join(map(str, content[k : k + _PER_LINE])) for k in range(0, len(content), _PER_LINE)]
    sections = {k: v for k, v in _sections().items() if k == "licence" or wanted(k)}
    head = [
        sections.pop("licence"),
        f"/* {comment} */\n",
        # a graph does not use every function of a header
        '#if defined(__clang__)\n#pragma clang diagnostic ignored "-Wunused-function"\n#endif\n',
        f"#define HYST_PREFIX {name}_\n",
        "#define HYST_BLOCKS(B) " + " ".join(f"B({b})" for b in sorted({n.type for n in graph.nodes})) + "\n",
        f"static const unsigned char hyst_block_file[{len(content)}] = {{\n" + ",\n".join(lines) + "};\n",
    ]
    return "".join([*head, *(f"/* ==== {k} ==== */\n{v}" for k, v in sections.items())])


def source_file(graph: Graph, fmi: Fmi, name: str) -> bytes:
    """Return the C file: licence, data, the sections of the core for the blocks in use, the functions of one standard.

    Every public symbol begins with ``name``.  The functions of the standard do so if the build defines
    FMI2_FUNCTION_PREFIX (FMI3_FUNCTION_PREFIX) as ``name_``.
    """
    blocks = {n.type for n in graph.nodes}
    comment = (
        f"The FMU {name} for FMI {fmi}.0: build it with {OPTIONS}; it needs fmi{fmi}Functions.h and the C library."
    )
    return core_text(graph, name, comment, lambda section: wanted(section, blocks, fmi)).encode()


def build_description(name: str) -> bytes:
    """Write buildDescription.xml (FMI Specification 3.0.1, section 2.5.1.3): a C99 compiler with the options above."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=name, description="C library only")
    for compiler in ("gcc", "clang"):
        attributes = {"name": compiler, "language": "C99", "compiler": compiler, "compilerOptions": OPTIONS}
        ET.SubElement(ET.SubElement(configuration, "SourceFileSet", attributes), "SourceFile", name=f"{name}.c")
        break
    return xml_file(root)
