"""Build the core that Python loads for all platforms of wheels on this machine by zig cc (PyPI: ziglang).

cores.py FMU_BUILD OUT [TUPLE ...]

The libraries are written to OUT/<tuple>/_core.<suffix>, with the sources and options that CMakeLists.txt gives to
_core, and linked like the FMU binaries of build.py.  There is none for 32-bit Windows: numpy and scipy have no wheels
for it.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from build import MEANING, TARGETS, link, zig

CORES = [name for name in TARGETS if name != "x86-windows"]


def build(root: Path, out: Path, name: str) -> Path:
    """Build the core for one platform and write it atomically."""
    target, suffix = TARGETS[name]
    sources = [*sorted(root.glob("core/**/*.c")), *sorted(root.glob("master/*.c"))]
    options = [*MEANING, "-O3", "-DNDEBUG", "-fno-stack-protector", f"-I{root}"]
    options += ["-fvisibility=default"]  # Python calls functions that no header exports
    if suffix == "dll":
        sources.append(root / "platforms" / "windows.c")
    else:
        options.append("-fPIC")
    folder = out / name
    folder.mkdir(parents=True, exist_ok=True)
    made = folder / f"_core.{suffix}"
    with tempfile.TemporaryDirectory(dir=folder) as where:
        objects = [Path(where, f"{k}.o") for k in range(len(sources))]  # names of files occur twice
        for source, compiled in zip(sources, objects, strict=True):
            zig("-target", target, *options, "-c", source, "-o", compiled)
        part = Path(where, made.name)
        # without a level, zig links as for debugging, and a library of Windows states the time
        zig("-target", target, "-O3", "-s", "-shared", *objects, *link(made.name), "-o", part)
        part.replace(made)
    return made


def main() -> None:
    """Build the named platforms, by default all of wheels."""
    root, out, *names = sys.argv[1:]
    unknown = set(names) - set(CORES)
    if unknown:
        got = sorted(unknown)[0]
        raise SystemExit(f"cores.py: the platform must be one of {', '.join(CORES)}. Got {got!r} instead.")
    for name in names or CORES:
        path = build(Path(root).resolve(), Path(out), name)
        print(f"{path}: {path.stat().st_size} bytes", flush=True)


if __name__ == "__main__":
    main()
