"""Binaries of all platforms in one FMU: the folders of both standards, macOS for two processors, what is left out."""

from __future__ import annotations

import struct
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner
from fmu_master import single

from hystfmu.cli import main
from hystfmu.fmu import export_fmu, platforms
from hystfmu.model import Model

MACHO = {"x86_64-darwin": 0x01000007, "aarch64-darwin": 0x0100000C}  # processors of mach/machine.h
FOLDERS = {
    2: {"win64/m.dll", "linux64/m.so", "aarch64-linux/m.so", "darwin64/m.dylib"},
    3: {
        "x86_64-windows/m.dll",
        "x86_64-linux/m.so",
        "aarch64-linux/m.so",
        "x86_64-darwin/m.dylib",
        "aarch64-darwin/m.dylib",
    },
}


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A package with a stand-in for every binary."""
    (tmp_path / "_platforms").mkdir()
    for p in platforms.PLATFORMS.values():
        content = struct.pack("<III", 0xFEEDFACF, MACHO.get(p.tuple3, 0), 3) + p.tuple3.encode() * 2000
        (tmp_path / "_platforms" / f"{p.tuple3}.{p.suffix}").write_bytes(content)
    monkeypatch.setattr(platforms, "_PACKAGE", tmp_path)
    platforms._binary.cache_clear()
    yield tmp_path
    platforms._binary.cache_clear()


def test_folders(package: Path, tmp_path: Path, fmi: int) -> None:
    path = export_fmu(single("sum"), tmp_path / "x.fmu", fmi, "m", "all")  # type: ignore[arg-type]
    with zipfile.ZipFile(path) as archive:
        found = {n.removeprefix("binaries/"): archive.read(n) for n in archive.namelist() if n.startswith("binaries/")}
    assert set(found) == FOLDERS[fmi]
    if fmi == 2:  # one file for both processors: header, then each part where the header says
        universal = found["darwin64/m.dylib"]
        magic, n = struct.unpack(">II", universal[:8])
        assert (magic, n) == (0xCAFEBABE, 2)
        for k, name in enumerate(MACHO):
            processor, _, at, size, power = struct.unpack(">5I", universal[8 + 20 * k : 28 + 20 * k])
            assert processor == MACHO[name]
            assert at % (1 << power) == 0
            assert universal[at : at + size] == (package / "_platforms" / f"{name}.dylib").read_bytes()


def test_what_is_left_out_is_said_in_one_line(package: Path, tmp_path: Path) -> None:
    (package / "_platforms" / "x86_64-windows.dll").unlink()
    Model("sum", single("sum")).save(tmp_path / "m.model.toml")
    command = ["export", str(tmp_path / "m.model.toml"), "-o", str(tmp_path / "x.fmu"), "--platforms", "all"]
    done = CliRunner().invoke(main, command)
    assert done.exit_code == 0, done.output
    assert "left out: no binary is installed for x86_64-windows ('make platforms' builds them)\n" in done.output
