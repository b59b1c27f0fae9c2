"""Builds the FMU binary for every platform on this machine with zig cc (PyPI: ziglang): build.py FMU_BUILD OUT [TUPLE ...]

One binary per platform serves every model.  OUT gets <tuple>.<suffix>, named by the FMI 3.0 platform tuples; CMake installs
what lies there.  The C library is linked at run time; on Linux its oldest version is glibc 2.17.

All of them travel in an FMU, so that size counts: two translation units, one for speed with the files of fast.txt, one
for size with the rest; no unwind tables, for nothing is thrown through an FMU; nothing of zig's own C library.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "sources"))
from amalgamate import Amalgamation, source_files

# FMI 3.0 tuple: zig target, suffix
TARGETS = {
    "x86_64-windows": ("x86_64-windows-gnu", "dll"),
    "x86_64-linux": ("x86_64-linux-gnu.2.17", "so"),
    "aarch64-linux": ("aarch64-linux-gnu.2.17", "so"),
    "x86_64-darwin": ("x86_64-macos", "dylib"),
    "aarch64-darwin": ("aarch64-macos", "dylib"),
}
# the options of CMakeLists.txt: one meaning on every platform
OPTIONS = ["-std=c99", "-g0", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno", "-DHYST_UNDOCUMENTED"]
OPTIONS += ["-fno-asynchronous-unwind-tables", "-fno-unwind-tables", "-fno-stack-protector"]
OPTIONS += ["-Wno-override-init", "-Wno-unused-function"]
FAST, SMALL = ["-O2"], ["-Os", "-Xclang", "-Oz"]  # zig takes -Oz for -Os
LINK = {
    "so": ["-Wl,--gc-sections", "-Wl,--hash-style=gnu"],
    "dylib": ["-Wl,-x"],  # no local symbols: -s leaves them
    # the libraries of Windows themselves: the start-up code and the number formats of mingw are larger than the model
    "dll": ["-nostdlib", "-lkernel32", *(f"-lapi-ms-win-crt-{n}-l1-1-0" for n in ("heap", "private", "stdio", "string"))],
}


def fast_files(root: Path) -> set[Path]:
    """The files of fast.txt."""
    lines = (root / "fast.txt").read_text().splitlines()
    return {root / line for line in lines if line and not line.startswith("#")}


def unit(root: Path, sources: list[Path]) -> str:
    """One translation unit out of some files; the others are seen by their headers."""
    return "#define HYST_PREFIX\n" + Amalgamation(root, sources).text("")


def zig(*words: object) -> None:
    if subprocess.run([sys.executable, "-m", "ziglang", "cc", *map(str, words)]).returncode:
        raise SystemExit("build.py: the compiler failed")


def build(root: Path, out: Path, name: str) -> Path:
    """One binary, written as a whole or not at all."""
    target, suffix = TARGETS[name]
    spec = importlib.util.find_spec("fmpy")
    if spec is None or spec.origin is None:
        raise SystemExit("build.py: fmpy, which brings the FMI headers, is not installed")
    headers = Path(spec.origin).parent / "c-code"
    fast, alone = fast_files(root), root / "fmi" / "open_file.c"  # of windows.h, it says why
    sources = [p for p in source_files(root) if p not in fast and p != alone]
    units = {"fast": (FAST, unit(root, sorted(fast))), "small": (SMALL, unit(root, sources))}
    for path in (alone, root / "platforms" / "windows.c")[: 2 if suffix == "dll" else 1]:
        units[path.stem] = (SMALL, path.read_text())
    position = [] if suffix == "dll" else ["-fPIC"]
    out.mkdir(parents=True, exist_ok=True)
    made = out / f"{name}.{suffix}"
    with tempfile.TemporaryDirectory(dir=out) as where:
        objects = []
        for k, (level, text) in units.items():
            source, compiled = Path(where, f"{k}.c"), Path(where, f"{k}.o")
            source.write_text(text)
            zig("-target", target, *OPTIONS, *level, *position, f"-I{alone.parent}", f"-isystem{headers}", "-c", source, "-o", compiled)
            objects.append(compiled)
        part = Path(where, made.name)
        zig("-target", target, "-Os", "-s", "-shared", *objects, *LINK[suffix], "-o", part)
        part.replace(made)
    return made


def main() -> None:
    root, out, *names = sys.argv[1:]
    unknown = set(names) - set(TARGETS)
    if unknown:
        raise SystemExit(f"build.py: no platform {sorted(unknown)[0]!r}; there are {', '.join(TARGETS)}")
    for name in names or TARGETS:
        made = build(Path(root).resolve(), Path(out), name)
        print(f"{made}: {made.stat().st_size} bytes", flush=True)


if __name__ == "__main__":
    main()
