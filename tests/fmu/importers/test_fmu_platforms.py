"""FMUs for all platforms: cross-compiled binaries, folders, sizes."""

import importlib.util
import re
import struct
import sys
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import fmpy
import pytest
from fmu_master import loop, single
from invoked import invoked
from other_platforms import RUNNERS, loads_on_macos_11, needs_glibc_2_17, needs_windows_alone, run, runner, tool
from scripts import loaded

import hystfmu
import hystfmu as hy
from hystfmu.fmu import export_fmu
from hystfmu.fmu.write import platforms
from hystfmu.fmu.write.platforms import PLATFORMS, host
from hystfmu.graph import Graph
from hystfmu.model import Model

MACHO = {"x86_64-darwin": 0x01000007, "aarch64-darwin": 0x0100000C}  # CPU types of mach/machine.h
BUILD = Path(__file__).parents[3] / "fmu_build" / "platforms" / "build.py"
FOLDERS = {
    2: {"win64/m.dll", "win32/m.dll", "linux64/m.so", "aarch64-linux/m.so", "darwin64/m.dylib"},
    3: {
        "x86_64-windows/m.dll", "x86-windows/m.dll", "x86_64-linux/m.so", "aarch64-linux/m.so", "x86_64-darwin/m.dylib",
        "aarch64-darwin/m.dylib",
    },
}  # fmt: skip


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Make a package with a placeholder for every binary, and a universal macOS binary as of `make platforms`."""
    folder = tmp_path / "_platforms"
    folder.mkdir()
    for p in platforms.PLATFORMS.values():
        content = struct.pack("<III", 0xFEEDFACF, MACHO.get(p.tuple3, 0), 3) + p.tuple3.encode() * 2000
        (folder / f"{p.tuple3}.{p.suffix}").write_bytes(content)
    build = loaded(BUILD)
    (folder / "darwin64.dylib").write_bytes(build.universal([(folder / f"{n}.dylib").read_bytes() for n in MACHO]))
    monkeypatch.setattr(platforms, "PACKAGE", tmp_path)
    platforms._deflated.cache_clear()
    yield tmp_path
    platforms._deflated.cache_clear()


def test_folders(package: Path, tmp_path: Path, fmi: int) -> None:
    path = export_fmu(single("sum"), tmp_path / "x.fmu", fmi, "m", "all")  # type: ignore[arg-type]
    with zipfile.ZipFile(path) as archive:
        found = {n.removeprefix("binaries/"): archive.read(n) for n in archive.namelist() if n.startswith("binaries/")}
    assert set(found) == FOLDERS[fmi]
    if fmi == 2:  # one file for both processors: a header, then the parts at the offsets of the header
        universal = found["darwin64/m.dylib"]
        magic, n = struct.unpack(">II", universal[:8])
        assert (magic, n) == (0xCAFEBABE, 2)
        for k, name in enumerate(MACHO):
            processor, _, at, size, power = struct.unpack(">5I", universal[8 + 20 * k : 28 + 20 * k])
            assert processor == MACHO[name]
            assert at % (1 << power) == 0
            assert universal[at : at + size] == (package / "_platforms" / f"{name}.dylib").read_bytes()


@pytest.mark.parametrize("stale", [False, True])
def test_a_prepared_stream_is_used_only_for_its_binary(package: Path, tmp_path: Path, stale: bool) -> None:
    binary = package / "_platforms" / "x86_64-windows.dll"
    maker = zlib.compressobj(0, zlib.DEFLATED, -15)  # stored, which an export would never choose
    stream = maker.compress(binary.read_bytes() + b"older" * stale) + maker.flush()
    binary.with_name("x86_64-windows.dll.deflate").write_bytes(stream)
    path = export_fmu(single("sum"), tmp_path / "x.fmu", 3, "m", "all")
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        entry = archive.getinfo("binaries/x86_64-windows/m.dll")
        assert archive.read(entry) == binary.read_bytes()
        assert (entry.compress_size == len(stream)) is not stale


def test_all_platforms_are_packed_or_nothing_is_written(package: Path, tmp_path: Path) -> None:
    (package / "_platforms" / "x86_64-windows.dll").unlink()
    (package / "_platforms" / "x86-windows.dll").unlink()
    Model("sum", single("sum")).save(tmp_path / "m.model.toml")
    command = ["export", str(tmp_path / "m.model.toml"), "-o", str(tmp_path / "x.fmu"), "--platforms", "all"]
    done = invoked(command, status=2)
    (line,) = done.output.splitlines()
    assert "no binary is installed for x86_64-windows, x86-windows" in line
    assert not (tmp_path / "x.fmu").exists()


# ---- cross-compiled --------------------------------------------------------------------------------------------------
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


@pytest.mark.stress
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


@pytest.mark.stress
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


@pytest.mark.stress
@pytest.mark.parametrize("name", [n for n in PLATFORMS if n.endswith("linux")])
def test_it_needs_no_newer_c_library(crossed: Path, name: str) -> None:
    assert needs_glibc_2_17(binary(crossed, name)) <= {"libc.so.6", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"}


@pytest.mark.stress
@pytest.mark.parametrize("name", [n for n in PLATFORMS if n.endswith("windows")])
def test_it_needs_windows_alone(crossed: Path, name: str) -> None:
    assert "KERNEL32.dll" in needs_windows_alone(binary(crossed, name))


@pytest.mark.stress
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


@pytest.mark.stress
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


# ---- sizes -----------------------------------------------------------------------------------------------------------
SCENARIOS = Path(__file__).parents[3] / "scenarios"
LIMITS = {"host": 210_000, "all": 545_000}  # bytes
# one file per kind of model, the longest: the identified models, inverses and plants of the scenarios
MODELS = {hy.Model.load(p).key: p for p in sorted(SCENARIOS.rglob("*.model.toml"), key=lambda p: p.stat().st_size)}


@pytest.mark.some(2)
@pytest.mark.parametrize("which", ["host", "all"])
def test_every_fmu_is_small(which: Literal["host", "all"], fmi: int, tmp_path: Path) -> None:
    if which == "all" and (missing := platforms.missing()):
        pytest.skip(f"no binary is installed for {', '.join(missing)}: 'make platforms' builds them")
    assert {"actuator", "play_bank_mlp", "polynomial_narx", "prandtl_ishlinskii", "rate_mlp"} <= set(MODELS)
    sizes = {}
    for key, path in MODELS.items():
        made = hy.Model.load(path).export(tmp_path / "m.fmu", fmi, platforms=which)  # type: ignore[arg-type]
        sizes[key] = made.stat().st_size
    print(f"FMI {fmi}, {which}: {min(sizes.values())} to {max(sizes.values())} bytes")
    assert {key: n for key, n in sizes.items() if n > LIMITS[which]} == {}
    assert min(sizes.values()) > 30_000  # each contains a binary
