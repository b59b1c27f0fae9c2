"""Binaries for platforms other than this one: how tests inspect them, and run them under emulators."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from hystfmu.fmu.write.platforms import host

ARM_LIBRARIES = Path("/usr/aarch64-linux-gnu")  # Debian's libc6-arm64-cross
# target of zig for a host program, and the emulator command
RUNNERS = {
    "x86_64-linux": ("x86_64-linux-gnu.2.17", []),
    "x86_64-windows": ("x86_64-windows-gnu", ["wine"]),
    "x86-windows": ("x86-linux-musl", []),  # a process of Linux that loads the library by itself
    "aarch64-linux": ("aarch64-linux-gnu.2.17", ["qemu-aarch64-static", "-L", str(ARM_LIBRARIES)]),
}


def run(*command: object, seconds: float = 300) -> str:
    """Run a command that must succeed and return its standard output."""
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=seconds)
    assert done.returncode == 0, f"exit {done.returncode}: {done.stdout[-500:]}{done.stderr[-1500:]}"
    return done.stdout


def tool(name: str) -> str:
    """Return the path of a program, without which the test is skipped."""
    found = shutil.which(name)
    if not found:
        pytest.skip(f"{name} is not installed")
    return found


def runner(name: str, wine: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[str, list[str]]:
    """Return the row of a platform in RUNNERS; the test is skipped where its programs cannot run.

    `wine` is the folder that wine may fill.
    """
    target, before = RUNNERS[name]
    if before:
        tool(before[0])
    elif host().tuple3 != name.replace("x86-windows", "x86_64-linux"):
        pytest.skip(f"this machine is no {name}")
    if name == "aarch64-linux" and not ARM_LIBRARIES.is_dir():
        pytest.skip("no aarch64 C library (Debian: libc6-arm64-cross)")
    monkeypatch.setenv("WINEDEBUG", "-all")
    monkeypatch.setenv("WINEPREFIX", str(wine))
    return target, before


def needs_glibc_2_17(library: Path) -> set[str]:
    """Assert that no symbol needs a newer glibc (PEP 600: manylinux2014); return the libraries needed."""
    listing = run(tool("llvm-objdump"), "-p", "-T", library)
    versions = {tuple(map(int, v.split("."))) for v in re.findall(r"GLIBC_([0-9.]+)", listing)}
    assert versions
    assert max(versions) <= (2, 17)
    return set(re.findall(r"NEEDED\s+(\S+)", listing))


def needs_windows_alone(library: Path) -> set[str]:
    """Assert that all libraries needed are the kernel or the C library, parts of Windows; return them."""
    listing = run(tool("llvm-objdump"), "-p", library).split("Export Table:")[0]
    needed = set(re.findall(r"DLL Name: (\S+)", listing))
    assert needed
    assert [n for n in needed if n != "KERNEL32.dll" and not re.fullmatch(r"api-ms-win-crt-\w+-l1-1-0\.dll", n)] == []
    return needed


def loads_on_macos_11(library: Path, arm: bool) -> str:
    """Assert the oldest system, the only library and the signature that arm64 demands; return the load commands."""
    listing = run(tool("llvm-objdump"), "--macho", "--private-headers", library)
    assert re.findall(r"minos (\S+)", listing) == ["11.0"]
    assert re.findall(r"LC_LOAD_DYLIB\n.*\n\s+name (\S+)", listing) == ["/usr/lib/libSystem.B.dylib"]
    assert "LC_CODE_SIGNATURE" in listing or not arm
    return listing
