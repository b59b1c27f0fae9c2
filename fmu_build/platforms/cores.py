"""Build the core for Python and the container for the platforms of all wheels on this computer with zig cc.

cores.py FMU_BUILD OUT [TUPLE ...]

The compiler is zig cc (PyPI: ziglang). The libraries are written to OUT/<tuple>/_core.<suffix> and
_container.<suffix>. They have the sources and compiler options of CMakeLists.txt, and are linked like the FMU binaries
of build.py. There are no libraries for 32-bit Windows, because numpy and scipy have no wheels for it. A wheel contains
only the container of its own platform, because `hystfmu ssp` uses no other one.
"""

import sys
import tempfile
from pathlib import Path

from build import MEANING, TARGETS, fmi_headers, link, zig

CORES = [name for name in TARGETS if name != "x86-windows"]
SHRUNK = ["-Os", "-ffunction-sections", "-fdata-sections", "-fvisibility=hidden", "-DHYST_UNDOCUMENTED"]
LIBRARIES = {
    # Python calls functions of the core that no header exports
    "_core": (("core/**/*.c", "master/*.c", "fitting/*.c"), ["-O3", "-DNDEBUG", "-fvisibility=default"], "-O3"),
    "_container": (("core/**/*.c", "master/*.c", "container/*.c", "fmi/files/*.c"), SHRUNK, "-Os"),
}


def build(root: Path, out: Path, name: str, library: str) -> Path:
    """Build a library for one platform, write it atomically, and return its path."""
    target, suffix = TARGETS[name]
    patterns, given, level = LIBRARIES[library]
    sources = [path for pattern in patterns for path in sorted(root.glob(pattern))]
    options = [*MEANING, *given, "-fno-stack-protector", f"-I{root}", f"-isystem{fmi_headers()}"]
    if suffix == "dll":
        sources.append(root / "platforms" / "windows.c")
    else:
        options.append("-fPIC")
    folder = out / name
    folder.mkdir(parents=True, exist_ok=True)
    made = folder / f"{library}.{suffix}"
    with tempfile.TemporaryDirectory(dir=folder) as where:
        objects = [Path(where, f"{k}.o") for k in range(len(sources))]  # file names occur twice
        for source, compiled in zip(sources, objects, strict=True):
            zig("-target", target, *options, "-c", source, "-o", compiled)
        part = Path(where, made.name)
        # without an optimisation level, zig links a debug version, and a library of Windows contains the build time
        loads = ["-ldl"] if suffix == "so" and library == "_container" else []  # for dlopen in glibc before 2.34
        zig("-target", target, level, "-s", "-shared", *objects, *link(made.name), *loads, "-o", part)
        part.replace(made)
    return made


def main() -> None:
    """Build both libraries for the given platforms, by default for all platforms of wheels."""
    root, out, *names = sys.argv[1:]
    unknown = set(names) - set(CORES)
    if unknown:
        got = sorted(unknown)[0]
        raise SystemExit(f"cores.py: the platform must be one of {', '.join(CORES)}. Got {got!r} instead.")
    for name in names or CORES:
        for library in LIBRARIES:
            path = build(Path(root).resolve(), Path(out), name, library)
            print(f"{path}: {path.stat().st_size} bytes", flush=True)


if __name__ == "__main__":
    main()
