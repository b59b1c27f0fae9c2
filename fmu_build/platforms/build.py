"""Builds the FMU binary for every platform on this machine with zig cc (PyPI: ziglang): build.py FMU_BUILD OUT [TUPLE ...]

One binary per platform serves every model.  OUT gets <tuple>.<suffix>, named by the FMI 3.0 platform tuples; CMake installs
what lies there.  The C library is linked at run time; on Linux its oldest version is glibc 2.17.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

# FMI 3.0 tuple: zig target, suffix
TARGETS = {
    "x86_64-windows": ("x86_64-windows-gnu", "dll"),
    "x86_64-linux": ("x86_64-linux-gnu.2.17", "so"),
    "aarch64-linux": ("aarch64-linux-gnu.2.17", "so"),
    "x86_64-darwin": ("x86_64-macos", "dylib"),
    "aarch64-darwin": ("aarch64-macos", "dylib"),
}
# the options of CMakeLists.txt: one meaning on every platform
OPTIONS = ["-std=c99", "-O2", "-g0", "-s", "-shared", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno"]


def build(root: Path, out: Path, name: str) -> Path:
    """One binary, written as a whole or not at all."""
    target, suffix = TARGETS[name]
    spec = importlib.util.find_spec("fmpy")
    if spec is None or spec.origin is None:
        raise SystemExit("build.py: fmpy, which brings the FMI headers, is not installed")
    headers = Path(spec.origin).parent / "c-code"
    sources = [*root.glob("core/*.c"), *root.glob("core/blocks/*.c"), *root.glob("fmi/*.c")]
    out.mkdir(parents=True, exist_ok=True)
    part, made = out / f".{name}.part.{suffix}", out / f"{name}.{suffix}"
    position = [] if suffix == "dll" else ["-fPIC"]
    include = [f"-I{root / 'core'}", f"-I{root / 'fmi'}", f"-isystem{headers}"]
    files = [str(p) for p in sorted(sources)]
    command = [sys.executable, "-m", "ziglang", "cc", "-target", target, *OPTIONS, *position, *include, *files]
    done = subprocess.run([*command, "-o", str(part)])
    if done.returncode:
        raise SystemExit(f"build.py: {name} was not built")
    part.replace(made)
    for left_over in (*out.glob("*.pdb"), *out.glob("*.lib")):
        left_over.unlink()
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
