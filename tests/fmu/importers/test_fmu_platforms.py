"""Binaries of all platforms in one FMU: folders of both standards, the universal macOS binary, missing platforms."""

from __future__ import annotations

import importlib.util
import struct
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner
from fmu_master import single

from hystfmu.cli import main
from hystfmu.fmu import export_fmu
from hystfmu.fmu.write import platforms
from hystfmu.model import Model

MACHO = {"x86_64-darwin": 0x01000007, "aarch64-darwin": 0x0100000C}  # CPU types of mach/machine.h
BUILD = Path(__file__).parents[3] / "fmu_build" / "platforms" / "build.py"
FOLDERS = {
    2: {"win64/m.dll", "win32/m.dll", "linux64/m.so", "aarch64-linux/m.so", "darwin64/m.dylib"},
    3: {
        "x86_64-windows/m.dll",
        "x86-windows/m.dll",
        "x86_64-linux/m.so",
        "aarch64-linux/m.so",
        "x86_64-darwin/m.dylib",
        "aarch64-darwin/m.dylib",
    },
}


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Make a package with a placeholder for every binary, and a universal macOS binary as of `make platforms`."""
    folder = tmp_path / "_platforms"
    folder.mkdir()
    for p in platforms.PLATFORMS.values():
        content = struct.pack("<III", 0xFEEDFACF, MACHO.get(p.tuple3, 0), 3) + p.tuple3.encode() * 2000
        (folder / f"{p.tuple3}.{p.suffix}").write_bytes(content)
    spec = importlib.util.spec_from_file_location("platforms_build", BUILD)
    assert spec is not None
    assert spec.loader is not None
    spec.loader.exec_module(build := importlib.util.module_from_spec(spec))
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
    done = CliRunner().invoke(main, command)
    assert done.exit_code == 2
    (line,) = done.output.splitlines()
    assert "no binary is installed for x86_64-windows, x86-windows" in line
    assert not (tmp_path / "x.fmu").exists()
