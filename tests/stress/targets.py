"""Compilers and processors available on this machine: how to build and run a C program for each."""

import importlib.util
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[2]
CORE, FMI = ROOT / "fmu_build" / "core", ROOT / "fmu_build" / "fmi"
CORE_SOURCES = sorted(CORE.rglob("*.c"))
FMI_SOURCES = sorted(FMI.rglob("*.c"))
# flags of CMakeLists.txt that determine the bits
MEANING = ["-std=c99", "-ffp-contract=off", "-fno-math-errno"]
ZIG = [sys.executable, "-m", "ziglang", "cc"]


def fmi_headers() -> Path:
    """Return the folder of the official FMI headers, which fmpy contains."""
    spec = importlib.util.find_spec("fmpy")
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).parent / "c-code"


@dataclass(frozen=True)
class Target:
    """A compiler with its flags and the command that runs its programs."""

    name: str
    compiler: list[str]
    runner: list[str] = field(default_factory=list)
    suffix: str = ""

    def missing(self) -> str | None:
        """Return the first missing tool, or None."""
        if self.compiler[:3] == ZIG[:3] and importlib.util.find_spec("ziglang") is None:
            return "no ziglang (pip install ziglang)"
        for tool in [self.compiler[0], *self.runner[:1]]:
            if not shutil.which(tool):
                return f"no {tool}"
        if "wasm" in self.name and importlib.util.find_spec("wasmtime") is None:
            return "no wasmtime (pip install wasmtime)"
        return None

    def build(self, program: Path, sources: list[Path], flags: list[str]) -> Path:
        """Compile two files at a time and link; programs in one folder share their objects."""
        objects = program.parent / "objects"
        objects.mkdir(parents=True, exist_ok=True)

        def one(source: Path) -> str:
            out = objects / f"{source.stem}.o"
            if not out.exists():
                run([*self.compiler, *flags, "-c", str(source), "-o", str(out)], 300)
            return str(out)

        with ThreadPoolExecutor(2) as pool:
            made = list(pool.map(one, sources))
        target = program.with_suffix(self.suffix)
        run([*self.compiler, *made, *flags, "-o", str(target)], 300)  # libraries after the objects that need them
        return target

    def run(self, program: Path, *arguments: str, seconds: float = 600) -> str:
        """Run a program and return its output."""
        return run([*self.runner, str(program), *arguments], seconds, cwd=program.parent).replace("\r", "")


def run(command: list[str], seconds: float, cwd: Path | None = None, **environment: str) -> str:
    """Run a command that must succeed and return its standard output."""
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=seconds, cwd=cwd,
        env={**os.environ, "WINEDEBUG": "-all", **environment},
    )  # fmt: skip
    assert done.returncode == 0, (
        f"{' '.join(command)[:200]}: exit {done.returncode}\n{(done.stdout + done.stderr)[-3000:]}"
    )
    return done.stdout


def zig(triple: str, *flags: str) -> list[str]:
    """Return the compiler command of zig for a platform, without its own sanitizer."""
    return [*ZIG, "-target", triple, *(flags or ("-O2",)), "-fno-sanitize=all"]


def wine() -> str:
    """Return the command that runs 64-bit Windows binaries."""
    return shutil.which("wine64") or next(iter(map(str, Path("/usr/lib/wine").glob("wine64"))), "wine64")


WASM = [sys.executable, str(Path(__file__).parent / "run_wasm.py")]
TARGETS = [
    Target("gcc -O0", ["gcc", "-O0"]),
    Target("gcc -O2", ["gcc", "-O2"]),
    Target("gcc -O3 -march=native", ["gcc", "-O3", "-march=native"]),
    Target("clang -O0", ["clang", "-O0"]),
    Target("clang -O2", ["clang", "-O2"]),
    Target("clang -O3 -march=native", ["clang", "-O3", "-march=native"]),
    Target("x86-64 linux, glibc 2.17 (zig)", zig("x86_64-linux-gnu.2.17")),
    Target("x86-64 linux, musl (zig)", zig("x86_64-linux-musl")),
    Target("x86 linux, 32 bit (zig)", zig("x86-linux-musl")),
    Target("aarch64 linux (zig, qemu)", zig("aarch64-linux-musl"), ["qemu-aarch64-static"]),
    Target("riscv64 linux (zig, qemu)", zig("riscv64-linux-musl"), ["qemu-riscv64-static"]),
    Target("s390x linux, big-endian (zig, qemu)", zig("s390x-linux-musl"), ["qemu-s390x-static"]),
    Target("x86-64 windows (zig, wine)", zig("x86_64-windows-gnu"), [wine()], ".exe"),
    Target("wasm32 (zig, wasmtime)", zig("wasm32-wasi"), WASM, ".wasm"),
]
