"""Source FMUs: one file that compiles without a warning and gives the same bits."""

import ctypes
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.build import build_platform_binary
from fmu_master import BLOCKS, Master, loop, rows, single, unpack
from invoked import invoked
from lxml import etree

import hystfmu as hy
from hystfmu.fmu import export_fmu
from hystfmu.graph import Graph, Input, Node, Output

PACKAGE = Path(fmpy.__file__).parent
HEADERS = PACKAGE / "c-code"
STRICT = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off", "-fno-math-errno", f"-isystem{HEADERS}"]
LANGUAGES = {
    "gcc": ["gcc", "-std=c99"],
    "clang": ["clang", "-std=c99"],
    # C++20 deprecates arithmetic between numbers and enumerators, later versions refuse it
    "g++": ["g++", "-x", "c++", "-std=c++20"],
    "clang++": ["clang++", "-x", "c++", "-std=c++20"],
    "older g++": ["g++", "-x", "c++", "-std=c++11"],
    "older clang++": ["clang++", "-x", "c++", "-std=c++11"],
}
# each compiler once, each version by two; the long runs have the rest
SOON = [(2, "gcc"), (3, "clang"), (3, "g++"), (2, "clang++")]
LONG = [(fmi, c) for fmi in (2, 3) for c in LANGUAGES if (fmi, c) not in SOON]
EACH = [*SOON, *(pytest.param(*row, marks=pytest.mark.stress) for row in LONG)]


def every_block() -> Graph:
    """Return a graph of all blocks, which needs the whole core in one file."""
    nodes = [Node(b, b) for b in BLOCKS]
    inputs = [Input(f"{n.name}_{v.name}", (f"{n.name}.{v.name}",)) for n in nodes for v in n.block.of("input")]
    outputs = [Output(f"{n.name}_{v.name}_out", f"{n.name}.{v.name}") for n in nodes for v in n.block.of("output")]
    return Graph(nodes, (), inputs, outputs)


def _source(graph: Graph, folder: Path, fmi: int, name: str = "m") -> Path:
    """Export and unpack an FMU and return its C file, sources/<name>.c."""
    path = export_fmu(graph, folder / f"{name}.fmu", fmi, name, source=True)  # type: ignore[arg-type]
    return unpack(path, folder / name)


def _compile(compiler: str, source: Path, out: Path, *options: str) -> None:
    if not shutil.which(LANGUAGES[compiler][0]):
        pytest.skip(f"no {compiler}")
    command = [*LANGUAGES[compiler], *STRICT, *options, str(source), "-o", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=200)
    assert done.returncode == 0, done.stderr[:3000]


@pytest.mark.turn("warnings of compilers")
@pytest.mark.some(1)
@pytest.mark.parametrize("mode", ["-fsyntax-only", pytest.param("-O0", marks=pytest.mark.stress)])
@pytest.mark.parametrize(("fmi", "compiler"), EACH)
def test_compiles_without_a_warning(tmp_path: Path, fmi: int, compiler: str, mode: str) -> None:
    """Compile all blocks, and one block, which leaves most functions of the headers unused.

    Without an object gcc does not tell of unused functions: the tests below, which make objects, see these too.
    """
    for graph, name in ((every_block(), "every"), (single("sum"), "one")):
        folder = _source(graph, tmp_path, fmi, name)
        _compile(compiler, folder / "sources" / f"{name}.c", tmp_path / "x.o", "-c", mode)


def _symbols(objects: Path, *options: str) -> set[str]:
    out = subprocess.run(["nm", *options, str(objects)], capture_output=True, text=True, check=True).stdout
    return {line.split()[-1] for line in out.splitlines()}


@pytest.mark.stress  # of the core itself: tests/c/test_sanitizers.py
@pytest.mark.parametrize(("compiler", "level"), [("gcc", "-O1"), ("gcc", "-O2"), ("clang", "-O2")])
def test_core_is_freestanding(tmp_path: Path, compiler: str, level: str) -> None:
    """Blocks and graph need only the four functions that compilers call themselves, and string functions."""
    source = (_source(every_block(), tmp_path, 2) / "sources" / "m.c").read_text()
    above = r"/\* ==== (?:core/graph/message\.c|fmi/\S*|sources/\S*) ==== \*/.*?(?=/\* ====|\Z)"
    core = re.sub(above, "", source, flags=re.S)
    core = core.replace("static const unsigned char hyst_block_file", "const unsigned char hyst_block_file")
    (tmp_path / "core.c").write_text(core)
    _compile(compiler, tmp_path / "core.c", tmp_path / "core.o", "-c", level, "-ffreestanding")
    needed = _symbols(tmp_path / "core.o", "--undefined-only")
    assert needed <= {"memcpy", "memset", "memcmp", "memmove", "memchr", "strlen", "strcmp"} | {
        n for n in needed if n.startswith(("m_hyst_number", "m_hyst_interval", "_GLOBAL_OFFSET_TABLE_"))
    }


@pytest.mark.stress  # of one loop: below
def test_only_the_standard_and_own_names_are_public(tmp_path: Path, fmi: int) -> None:
    folder = _source(every_block(), tmp_path, fmi)
    _compile("gcc", folder / "sources" / "m.c", tmp_path / "m.o", "-c", "-O0")
    public = _symbols(tmp_path / "m.o", "--defined-only", "--extern-only")
    assert all(n.startswith((f"fmi{fmi}", "m_hyst_", "m_fmi_")) for n in public), public


# ---- the same bits --------------------------------------------------------------------------------------------------
def _run(graph: Graph, folder: Path, fmi: int, library: Path) -> np.ndarray:
    """A run of the unpacked FMU with another binary; without resources: nothing is read from a file."""
    own = folder / f"unpacked{fmi}"
    unpack(export_fmu(graph, folder / "own.fmu", fmi, "m"), own)  # type: ignore[arg-type]
    host = fmpy.platform if fmi == 2 else fmpy.platform_tuple
    shutil.copy(library, own / "binaries" / host / f"m{fmpy.sharedLibraryExtension}")
    (own / "resources" / "block.bin").unlink()
    m = Master(graph, folder, fmi)
    assert m.c.value, m.messages
    u = rows(graph, 200)
    for k, p in enumerate(p for p in graph.ports if p.kind == "input"):
        m.set(p.name, u[0, k])
    m.initialize()
    y = []
    for k in range(1, len(u)):
        for i, p in enumerate(p for p in graph.ports if p.kind == "input"):
            m.set(p.name, u[k, i])
        assert m.step((k - 1) * 1e-3) == 0
        y.append([m.get(p.name) for p in graph.ports if p.kind == "output"])
    m.free()
    return np.array(y)


@pytest.mark.turn("compiled loops")
@pytest.mark.parametrize(
    ("fmi", "compiler"),
    [(2, "gcc"), *(pytest.param(*c, marks=pytest.mark.stress) for c in ((3, "gcc"), (2, "clang++"), (3, "clang++")))],
)
def test_same_bits_as_the_prebuilt_binary(tmp_path: Path, fmi: int, compiler: str) -> None:
    graph = loop()
    folder = _source(graph, tmp_path, fmi)
    _compile(compiler, folder / "sources" / "m.c", tmp_path / "m.so", "-shared", "-fPIC", "-O1")
    public = _symbols(tmp_path / "m.so", "--dynamic", "--defined-only")
    assert all(n.startswith((f"fmi{fmi}", "m_hyst_", "m_fmi_", "_")) for n in public), public
    host = fmpy.platform if fmi == 2 else fmpy.platform_tuple
    got = _run(graph, tmp_path / "run", fmi, tmp_path / "m.so")
    want = graph.run(rows(graph, 200), 1e-3)[1:]
    assert got.tobytes() == np.ascontiguousarray(want).tobytes()
    assert (folder / "binaries" / host).is_dir()


@pytest.mark.usefixtures("fmutool_or_not")
@pytest.mark.stress
@pytest.mark.parametrize("fmi", [2, 3])
def test_fmpy_builds_it(tmp_path: Path, fmi: int) -> None:
    """The build files of the archive are enough for an importer; what comes out is a good FMU."""
    if not shutil.which("cmake") or not shutil.which("make"):
        pytest.skip("no cmake, no make")
    folder = _source(single("mlp"), tmp_path, fmi)
    host = fmpy.platform if fmi == 2 else fmpy.platform_tuple
    (binary,) = (folder / "binaries" / host).iterdir()
    before = binary.read_bytes()
    (tmp_path / "build").mkdir()
    build_platform_binary(folder, tmp_path / "build", generator="Unix Makefiles", all_warnings=True)
    assert binary.read_bytes() != before
    shutil.make_archive(str(tmp_path / "built"), "zip", folder)
    assert hy.validate(tmp_path / "built.zip") == []


@pytest.mark.turn("compiled loops")
@pytest.mark.usefixtures("fmutool_or_not")
def test_build_description(tmp_path: Path) -> None:
    """FMI 3.0: the file is valid and has the options for equal bits; FMI 2.0: each interface lists the files."""
    three = _source(single("creep"), tmp_path, 3, "three")
    root = etree.parse(three / "sources" / "buildDescription.xml")
    etree.XMLSchema(file=str(PACKAGE / "schema" / "fmi3" / "fmi3BuildDescription.xsd")).assertValid(root)
    files = root.find(".//SourceFileSet")
    assert files.get("language") == "C99"
    assert files.get("compilerOptions") == "-ffp-contract=off -fno-math-errno"
    assert [f.get("name") for f in files] == ["three.c"]
    two = _source(single("creep"), tmp_path, 2, "two")
    description = ET.parse(two / "modelDescription.xml")
    for interface in ("ModelExchange", "CoSimulation"):
        assert [f.get("name") for f in description.findall(f"{interface}/SourceFiles/File")] in (["two.c"], [])
    assert description.find("CoSimulation/SourceFiles/File") is not None
    assert hy.validate(tmp_path / "three.fmu") == []


@pytest.mark.stress
def test_two_of_them_in_one_program(tmp_path: Path) -> None:
    """Two source FMUs link together with the function prefixes of FMI 2.0 and FMI 3.0."""
    official = tmp_path / "headers"  # restore the macro of the standard, which the copy of fmpy lacks
    shutil.copytree(HEADERS, official)
    header = official / "fmi2Functions.h"
    prefixed = (
        "#define fmi2Paste(a, b) a##b\n#define fmi2PasteB(a, b) fmi2Paste(a, b)\n"
        "#define fmi2FullName(name) fmi2PasteB(FMI2_FUNCTION_PREFIX, name)"
    )
    text = header.read_text()
    assert "#define fmi2FullName(name) name" in text
    header.write_text(text.replace("#define fmi2FullName(name) name", prefixed))
    objects = []
    for name, graph in (("a", single("creep")), ("b", single("mlp"))):
        for fmi in (2, 3):
            own = f"{name}{fmi}"
            folder = _source(graph, tmp_path, fmi, own)
            objects.append(tmp_path / f"{own}.o")
            prefix = f"-DFMI{fmi}_FUNCTION_PREFIX={own}_"
            _compile("gcc", folder / "sources" / f"{own}.c", objects[-1], "-c", "-fPIC", "-O0", prefix, f"-I{official}")
    library = tmp_path / "all.so"
    subprocess.run(["gcc", "-shared", *map(str, objects), "-o", str(library)], check=True, timeout=60)
    loaded = ctypes.CDLL(str(library))
    for name in ("a", "b"):
        assert hasattr(loaded, f"{name}2_fmi2DoStep")
        assert hasattr(loaded, f"{name}3_fmi3DoStep")


def test_export_says_which_headers_the_source_needs(tmp_path: Path, fmi: int) -> None:
    out = tmp_path / "m.fmu"
    done = invoked(["export", "creep", "--source", "--fmi", str(fmi), "-o", str(out)])
    with zipfile.ZipFile(out) as archive:
        text = archive.read("sources/creep.c").decode()
    (needed,) = set(re.findall(r'#\s*include "(.*)"', text))
    assert f"it needs {needed} of the FMI standard" in done.output
    assert f"it needs {needed} " in text
