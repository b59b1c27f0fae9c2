"""Binaries of `make platforms`: their exports, their dependencies, and the same bits as on this machine.

win64 runs under wine, aarch64-linux under qemu-user, win32 in a 32-bit process of Linux that loads it by itself
(pe_loader.h); macOS binaries are inspected, not run.
"""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

import fmpy
import pytest
from fmu_master import loop, single
from other_platforms import RUNNERS, loads_on_macos_11, needs_glibc_2_17, needs_windows_alone, run, runner, tool

import hystfmu
from hystfmu.fmu.write.platforms import PLATFORMS, host
from hystfmu.graph import Graph

pytestmark = pytest.mark.stress
ROOT = Path(__file__).parents[3]
HOST = Path(__file__).with_name("step_host.c")
HEADERS = Path(fmpy.__file__).parent / "c-code"
GRAPHS = {
    "loop": loop,
    **{n: lambda n=n: single(n) for n in ("prandtl_ishlinskii", "zhao_tan", "mlp", "transfer_function", "bouc_wen")},
}


@pytest.fixture(scope="session")
def crossed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All binaries, built as `make platforms` does."""
    for package in ("ziglang", "zopfli"):
        if importlib.util.find_spec(package) is None:
            pytest.skip(f"{package} is not installed: no cross build")
    out = tmp_path_factory.mktemp("crossed")
    run(sys.executable, ROOT / "fmu_build" / "platforms" / "build.py", ROOT / "fmu_build", out, seconds=900)
    return out


def binary(crossed: Path, tuple3: str) -> Path:
    return crossed / f"{tuple3}.{PLATFORMS[tuple3].suffix}"


@pytest.mark.parametrize("name", list(PLATFORMS))
def test_it_exports_the_functions_of_the_standards_only(crossed: Path, name: str) -> None:
    path = binary(crossed, name)
    if name.endswith("windows"):  # of 32 bits, too, without the underscore of C and the @4 of other calls
        table = run(tool("llvm-objdump"), "-p", path).split("Export Table:")[1]
        symbols = re.findall(r"^\s+\d+\s+0x[0-9a-f]+\s+(\S+)$", table, re.MULTILINE)
    elif name.endswith("darwin"):
        table = run(tool("llvm-objdump"), "--macho", "--exports-trie", path)
        symbols = re.findall(r"^0x[0-9A-Fa-f]+\s+_(\S+)", table, re.MULTILINE)
    else:
        lines = run(tool("llvm-nm"), "-D", "--defined-only", path).splitlines()
        symbols = [line.split()[-1] for line in lines if line]
    own = [s for s in symbols if re.fullmatch(r"fmi[23][A-Z]\w+", s)]
    assert {"fmi2DoStep", "fmi3DoStep", "fmi2GetDerivatives", "fmi3GetContinuousStateDerivatives"} <= set(own)
    image = {"_mh_dylib_header", "__dso_handle"}  # symbols that the linker of zig for macOS always exports
    assert set(symbols) - set(own) <= (image if name.endswith("darwin") else set())


def test_the_universal_binary_holds_both_processors(crossed: Path) -> None:
    """In the universal binary of darwin64, each part exports the same functions as its own binary."""
    names, path = [n for n in PLATFORMS if n.endswith("darwin")], crossed / "darwin64.dylib"
    for name, arch in zip(names, ("x86_64", "arm64"), strict=True):
        assert name.startswith(arch.replace("arm64", "aarch64"))
        trie = [tool("llvm-objdump"), "--macho", f"--arch={arch}", "--exports-trie"]
        parts = [
            re.findall(r"^0x[0-9A-Fa-f]+\s+_\S+", run(*trie, p), re.MULTILINE) for p in (path, binary(crossed, name))
        ]
        assert len(parts[0]) > 100
        assert parts[0] == parts[1]


@pytest.mark.parametrize("name", [n for n in PLATFORMS if n.endswith("linux")])
def test_it_needs_no_newer_c_library(crossed: Path, name: str) -> None:
    assert needs_glibc_2_17(binary(crossed, name)) <= {
        "libc.so.6",
        "ld-linux-x86-64.so.2",
        "ld-linux-aarch64.so.1",
    }


@pytest.mark.parametrize("name", [n for n in PLATFORMS if n.endswith("windows")])
def test_it_needs_windows_alone(crossed: Path, name: str) -> None:
    assert "KERNEL32.dll" in needs_windows_alone(binary(crossed, name))


@pytest.mark.parametrize("name", [n for n in PLATFORMS if n.endswith("darwin")])
def test_it_loads_on_macos_11(crossed: Path, name: str) -> None:
    """And it holds no path of the build."""
    listing = loads_on_macos_11(binary(crossed, name), name.startswith("aarch64"))
    assert re.findall(r"^\s+name (@\S+)", listing, re.MULTILINE) == [f"@rpath/{name}.dylib"]


def steps(tmp_path: Path, program: Path, before: list[str], library: Path, graph: Graph) -> str:
    """Return the hash of a run."""
    (tmp_path / "block.bin").write_bytes(graph.to_bytes())
    references = [next(p.reference for p in graph.ports if p.kind == k) for k in ("input", "output")]
    location = ("file:///Z:" if before[:1] == ["wine"] else "file://") + str(tmp_path)
    return run(*before, program, library, location, graph.token, *references).split()[-1]


@pytest.mark.parametrize("name", list(RUNNERS))
def test_it_gives_the_bits_of_this_machine(
    crossed: Path, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target, before = runner(name, tmp_path / "wine", monkeypatch)
    zig = [sys.executable, "-m", "ziglang", "cc"]
    flags = ["-std=c99", "-O1", "-ffp-contract=off", "-Wall", f"-I{HEADERS}", str(HOST)]  # the input is the same too
    program = tmp_path / "host.exe"
    loads = {"x86-windows": ["-std=gnu99", "-fno-sanitize=all", "-DPE_LOADER"], "x86_64-windows": []}
    run(*zig, "-target", target, *flags, *loads.get(name, ["-ldl"]), "-o", program)
    own = tmp_path / "own"
    run("cc", *flags, "-ldl", "-o", own)
    ours = Path(hystfmu.__file__).parent / f"_fmu.{host().suffix}"
    for graph in (make() for make in GRAPHS.values()):
        want = steps(tmp_path, own, [], ours, graph)
        assert steps(tmp_path, program, before, binary(crossed, name), graph) == want, graph.nodes[0].type
