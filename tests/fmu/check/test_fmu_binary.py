"""The binary: symbols, the FMI layer under AddressSanitizer and UBSan, and faulty foreign binaries."""

import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import compiled
import fmpy
import pytest
from compiled import CORE, FMI, HEADERS, STRICT
from fmu_master import BLOCKS, H, loop, mixed, single, unpack

import hystfmu
import hystfmu as hy
from hystfmu.core.library import block_types
from hystfmu.fmu import export_fmu
from hystfmu.fmu.check.foreign_library import ForeignFmu
from hystfmu.fmu.check.trials import leaks
from hystfmu.graph import Graph, Node

ROOT = Path(__file__).parents[3]
BINARY = Path(hystfmu.__file__).with_name("_fmu.so")

linux = pytest.mark.skipif(sys.platform != "linux", reason="reads an ELF file with nm and readelf")


def _nm(*options: str) -> list[list[str]]:
    out = subprocess.run(["nm", "-D", *options, str(BINARY)], capture_output=True, text=True, check=True).stdout
    return [line.split() for line in out.splitlines()]


@linux
def test_exports_the_standard_and_nothing_else() -> None:
    exported = {words[-1] for words in _nm("--defined-only")}
    headers = [(HEADERS / f"fmi{n}Functions.h").read_text() for n in (2, 3)]
    declared = {
        word.rstrip(";")
        for text in headers
        for line in text.splitlines()
        if "_Export fmi" in line
        for word in [line.split()[-1]]
    }
    assert len(declared) > 100
    assert exported == declared


@linux
def test_needs_libc_only() -> None:
    out = subprocess.run(["readelf", "-d", str(BINARY)], capture_output=True, text=True, check=True).stdout
    assert [line.split("[")[1].rstrip("]") for line in out.splitlines() if "NEEDED" in line] == ["libc.so.6"]
    versions = {words[-1].split("@GLIBC_")[1] for words in _nm("--undefined-only") if "@GLIBC_" in words[-1]}
    assert max(tuple(map(int, v.split("."))) for v in versions) <= (2, 17)


@pytest.mark.turn("warnings of compilers")
@pytest.mark.some(1)
@pytest.mark.parametrize("mode", ["-fsyntax-only", pytest.param("-O2", marks=pytest.mark.stress)])
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_compiles_without_a_warning(tmp_path: Path, compiler: str, mode: str) -> None:
    """The sanitizers below compile every file at -O1, where a warning is a failure too."""
    if not shutil.which(compiler):
        pytest.skip(f"no {compiler}")

    def one(source: Path) -> str:
        flags = [*STRICT, mode, "-c", str(source), "-o", str(tmp_path / f"{source.stem}.o")]
        return subprocess.run([compiler, *flags], capture_output=True, text=True).stderr

    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(one, sorted(FMI.rglob("*.c")))) == [""] * len(list(FMI.rglob("*.c")))


# ---- sanitizers -----------------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def sanitized(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """A program of tests/c linked with the core and the FMI layer, all of them sanitized."""
    folder = tmp_path_factory.mktemp("sanitized")

    def program(name: str) -> Path:
        made = folder / name
        if not made.exists():
            sources = [*CORE.rglob("*.c"), *FMI.rglob("*.c"), ROOT / "tests" / "c" / f"{name}.c"]
            wrap = [f"-Wl,--wrap={f}" for f in ("malloc", "calloc", "fseek", "fread")] if name == "drive_edges" else []
            compiled.sanitized(made, sources, *wrap)
        return made

    return program


def drive(program: Path, graph: Graph, folder: Path, calls: int, seed: int) -> None:
    (folder / "block.bin").write_bytes(graph.to_bytes())
    references = sum(p.size for p in graph.ports)
    command = [str(program), str(folder), graph.token, str(references), str(calls), str(seed)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, f"exit {done.returncode}: {done.stderr[-3000:]}"


@pytest.mark.turn("compiled C", name="sanitizers")
@linux
def test_out_of_memory_and_null_pointers(sanitized: Callable[[str], Path], tmp_path: Path) -> None:
    graph = mixed()
    (tmp_path / "block.bin").write_bytes(graph.to_bytes())
    command = [str(sanitized("drive_edges")), str(tmp_path), graph.token]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, f"exit {done.returncode}: {done.stderr[-3000:]}"


GRAPHS = {"loop": loop, **{n: lambda n=n: single(n) for n in ("prandtl_ishlinskii", "zhao_tan", "reference", "pid")}}


@pytest.mark.turn("compiled C", name="sanitizers")
@pytest.mark.some(1)
@pytest.mark.parametrize("name", list(GRAPHS))
def test_random_sequences_of_calls(sanitized: Callable[[str], Path], tmp_path: Path, name: str) -> None:
    for seed in (1, 2):
        drive(sanitized("drive_fmi"), GRAPHS[name](), tmp_path, 60000, seed)


def small(name: str) -> Graph:
    """Return a block with a short memory, so that a forged number often hits a count or an index."""
    node, block = single(name).nodes[0], block_types()[name]
    short = {d.name: 4 for d in block.dims if d.name == "depth"} | ({"n": 3} if name == "delay" else {})
    return Graph.single(Node(name, name, {**node.dims, **short}, node.values)).with_step(H) if short else single(name)


# state by which memory is reached: the other blocks only calculate with theirs, and wait for the long runs
PLACES = {"memory", "extrema", "at", "oldest", "counter", "samples", "count"}
REACHES = {b for b in BLOCKS if PLACES & {v.name for v in block_types()[b].of("state")}}


@pytest.mark.turn("compiled C", name="sanitizers")
@pytest.mark.some(2)
@pytest.mark.parametrize(
    "name", ["loop", *(pytest.param(b, marks=[] if b in REACHES else pytest.mark.stress) for b in BLOCKS)]
)
def test_forged_states(sanitized: Callable[[str], Path], tmp_path: Path, name: str) -> None:
    """Counts, indices and derived values in the bytes of a state may be any number."""
    drive(sanitized("drive_states"), loop() if name == "loop" else small(name), tmp_path, 400, 1)


@pytest.mark.stress
@pytest.mark.parametrize("name", [*BLOCKS, "loop"])
def test_many_forged_states(sanitized: Callable[[str], Path], tmp_path: Path, name: str) -> None:
    for seed in (2, 3):
        drive(sanitized("drive_states"), loop() if name == "loop" else small(name), tmp_path, 10000, seed)


# ---- foreign binaries -----------------------------------------------------------------------------------------------
PATCHED = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <unistd.h>
#include "fmi/event.h"
#include "fmi2Functions.h"
static __typeof__(fmi2{function}) *theirs;
__attribute__((constructor)) static void find(void) {{
  theirs = (__typeof__(theirs))dlsym(RTLD_NEXT, "fmi2{function}");
}}
{patch}
"""


def _with_binary(tmp_path: Path, patch: str, function: str = "DoStep") -> Path:
    """Make an FMU whose binary replaces one function of the FMI layer by `patch` and takes the others from ours.

    An importer looks a function up in the binary, then in the libraries that it needs.
    """
    source, library, ours = tmp_path / "patched.c", tmp_path / "patched.so", tmp_path / "ours.so"
    source.write_text(PATCHED.format(function=function, patch=patch))
    shutil.copy(BINARY, ours)
    flags = ["-shared", "-std=gnu99", "-fPIC", "-O1", f"-I{CORE.parent}", f"-isystem{HEADERS}"]
    beside = ["-Wl,--no-as-needed,-rpath,$ORIGIN", f"-L{tmp_path}", "-l:ours.so", "-ldl"]
    command = ["cc", *flags, str(source), *beside, "-o", str(library)]
    subprocess.run(command, check=True, timeout=120)
    fmu = export_fmu(single("backlash_sum"), tmp_path / "good.fmu")
    out = tmp_path / "patched.fmu"
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(out, "w") as new:
        for e in old.infolist():
            binary = e.filename.startswith("binaries/")
            new.writestr(e.filename, library.read_bytes() if binary else old.read(e))
            if binary:
                new.write(ours, f"{e.filename.rsplit('/', 1)[0]}/ours.so")
    return out


COMPLETED = "fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean n, fmi2Boolean *e, fmi2Boolean *t)"
DERIVATIVE = (
    "fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference u[], size_t n, "
    "const fmi2ValueReference k[], size_t m, const fmi2Real d[], fmi2Real s[])"
)


@pytest.mark.turn("broken binaries")
@pytest.mark.some(1)
@linux
@pytest.mark.usefixtures("without_fmutool")
@pytest.mark.parametrize(("function", "patch", "expected"), [
    ("CompletedIntegratorStep",
     f"{COMPLETED} {{ *e = *t = fmi2False; (void)theirs, (void)c, (void)n; return fmi2OK; }}",
     "Model Exchange differs from Co-Simulation: y is"),
    (
        "SetTime",
        "fmi2Status fmi2SetTime(fmi2Component c, fmi2Real t) { fmi2Status s = theirs(c, t); fmi2Boolean e, end; "
        "fmi2CompletedIntegratorStep(c, fmi2True, &e, &end); return s; }",
        "rejected steps change the run in Model Exchange: y is",
    ),
    (
        "GetDirectionalDerivative",
        f"{DERIVATIVE} {{ fmi2Status r = theirs(c, u, n, k, m, d, s); "
        "if (((instance *)c)->run.phase == CONTINUOUS) s[0] += 1; return r; }",
        "the directional derivative of y with respect to u is",
    ),
], ids=["memory not committed", "memory of rejected steps", "derivative after steps"])  # fmt: skip
def test_check_finds_defects_of_model_exchange(tmp_path: Path, function: str, patch: str, expected: str) -> None:
    problems = hy.validate(_with_binary(tmp_path, patch + "\n", function))
    assert any(expected in p for p in problems), problems


@pytest.mark.stress
@pytest.mark.parametrize("fmi", [2, 3])
def test_a_million_steps_leak_nothing(tmp_path: Path, fmi: int) -> None:
    folder = unpack(export_fmu(loop(), tmp_path / "x.fmu", fmi), tmp_path / "x")  # type: ignore[arg-type]
    foreign = ForeignFmu(folder, fmpy.read_model_description(str(folder), validate=False), 600.0)
    assert list(leaks(foreign, 1_000_000)) == []
