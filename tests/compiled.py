"""Objects that several tests link: each is compiled once, for all test processes and all runs that follow.

An object lies in build/objects under a hash of all that it depends on: compiler, flags, its source, all headers.
"""

import functools
import hashlib
import os
import shutil
import subprocess
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import fmpy
import pytest

ROOT = Path(__file__).parents[1]
FMU_BUILD = ROOT / "fmu_build"
CORE, FMI = FMU_BUILD / "core", FMU_BUILD / "fmi"
HEADERS = Path(fmpy.__file__).parent / "c-code"
STORE = ROOT / "build" / "objects"
DAYS = 14  # that an object is kept without use

# the flags of CMakeLists.txt, and every warning a failure
STRICT = [
    "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off", "-fno-math-errno", f"-I{FMU_BUILD}",
    f"-isystem{HEADERS}",
]  # fmt: skip
SANITIZE = ["-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all", "-g1", "-O0"]
# clang's objects serve its fuzzers too; other compilers have no libFuzzer
SANITIZERS = {"clang": ["-fsanitize=fuzzer-no-link", *SANITIZE], "cc": SANITIZE}


def objects(sources: Sequence[Path], flags: Sequence[str], compiler: str = "cc") -> list[Path]:
    """One object per source, two compilers at a time; with -Werror in `flags` a warning is a failure."""
    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(lambda source: _object(source, flags, compiler), sources))


def sanitized(program: Path, sources: Sequence[Path], *link: str, compilers: Sequence[str] = tuple(SANITIZERS)) -> Path:
    """Build a program with AddressSanitizer and UBSan by the first compiler that has both, or skip the test."""
    compiler = next((c for c in compilers if _has_sanitizers(c)), None)
    if compiler is None:
        pytest.skip("no compiler with an AddressSanitizer / UBSan runtime")
    flags = SANITIZERS[compiler]
    made = objects(sources, [*STRICT, *flags], compiler)
    subprocess.run([compiler, *flags, *link, *map(str, made), "-o", str(program)], check=True, timeout=120)
    return program


def _object(source: Path, flags: Sequence[str], compiler: str) -> Path:
    words = [_version(compiler), *flags, _headers(), str(source), source.read_text()]
    folder = STORE / hashlib.sha256("\0".join(words).encode()).hexdigest()[:24]
    made = folder / f"{source.stem}.o"
    with alone(folder):
        if not made.exists():
            part = folder / "part.o"
            command = [compiler, *flags, "-c", str(source), "-o", str(part)]
            done = subprocess.run(command, capture_output=True, text=True, timeout=300)
            assert done.returncode == 0, done.stderr
            part.rename(made)
        os.utime(folder)
    return made


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """No other process that asks for the same folder is inside meanwhile."""
    folder.mkdir(parents=True, exist_ok=True)
    try:
        import fcntl
    except ImportError:  # Windows
        yield
        return
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


@functools.cache
def _version(compiler: str) -> str:
    path = shutil.which(compiler)
    if path is None:
        pytest.skip(f"no C compiler `{compiler}` on the path")
    return path + subprocess.run([path, "--version"], capture_output=True, text=True, check=True).stdout


@functools.cache
def _headers() -> str:
    """One hash of all headers; what was not used for long is removed on the way."""
    for folder in STORE.glob("*"):
        if time.time() - folder.stat().st_mtime > DAYS * 86400:
            shutil.rmtree(folder, ignore_errors=True)
    found = hashlib.sha256()
    for folder in (FMU_BUILD, ROOT / "tests", HEADERS):
        for file in sorted(folder.rglob("*.h")):
            found.update(f"{file}\0{file.read_text()}\0".encode())
    return found.hexdigest()


@functools.cache
def _has_sanitizers(compiler: str) -> bool:
    probe = [compiler, *SANITIZERS[compiler], "-x", "c", "-", "-o", os.devnull]
    text = "int main(void) { return 0; }\n"
    return (
        bool(shutil.which(compiler))
        and subprocess.run(probe, input=text, capture_output=True, text=True).returncode == 0
    )
