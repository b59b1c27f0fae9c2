"""Build the FMU binaries for all platforms on this computer with zig cc (PyPI: ziglang).

build.py FMU_BUILD OUT [TUPLE ...]

All models of a platform use the same binary. The binaries are written to OUT/<tuple>.<suffix>, with the platform
tuples of FMI 3.0. CMake installs the files in OUT. The C library is linked at run time; the oldest supported version
is glibc 2.17 on Linux and macOS 11.  If both binaries for macOS are built, darwin64.dylib combines them for FMI 2.0.

An FMU may contain all binaries, so they must be small. There is one translation unit for each optimisation level of
fast.txt, and one for all other files, which is compiled for size. The binaries have no unwind tables, because no
exception passes an FMU, and they contain no parts of the C library of zig. The binary for 32-bit Windows, which few
importers use, is compiled for size as a whole. For each binary, a compressed copy (PyPI: zopfli) is written, which
exports use. It is smaller than a fast compression, and its slow computation is not part of an export.
"""

import importlib.util
import struct
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "sources"))
from amalgamate import Amalgamation, source_files

# FMI 3.0 platform tuple: target of zig, suffix of libraries
TARGETS = {
    "x86_64-windows": ("x86_64-windows-gnu", "dll"),
    "x86-windows": ("x86-windows-gnu", "dll"),
    "x86_64-linux": ("x86_64-linux-gnu.2.17", "so"),
    "aarch64-linux": ("aarch64-linux-gnu.2.17", "so"),
    "x86_64-darwin": ("x86_64-macos.11.0", "dylib"),
    "aarch64-darwin": ("aarch64-macos.11.0", "dylib"),
}
# options of CMakeLists.txt, so that results are bit-identical on all platforms
MEANING = ["-std=c99", "-g0", "-ffp-contract=off", "-fno-math-errno"]
OPTIONS = [*MEANING, "-fvisibility=hidden", "-DHYST_UNDOCUMENTED"]
OPTIONS += ["-fno-asynchronous-unwind-tables", "-fno-unwind-tables", "-fno-stack-protector"]
OPTIONS += ["-fomit-frame-pointer"]  # without this option, the binary is larger and up to 4 % slower
OPTIONS += ["-mllvm", "-enable-machine-outliner=never"]  # outlining makes compression less effective
# by default, zig inlines functions marked "inline" with up to 325 instructions; the limit 60 makes an FMU 8 % smaller
# and its steps a few ns slower; the limit 50, which other functions have, makes its steps 10 % slower
OPTIONS += ["-mllvm", "-inlinehint-threshold=60"]
OPTIONS += ["-Wno-override-init", "-Wno-unused-function"]
SMALL = ["-Os", "-Xclang", "-Oz"]
WINDOWS = ("convert", "heap", "private", "runtime", "stdio", "string")
LINK = {
    "so": ["-Wl,--gc-sections", "-Wl,--hash-style=sysv"],  # GNU hashes cannot be compressed well
    "dylib": ["-Wl,-x"],  # removes local symbols, which -s keeps
    # link only libraries of Windows, because the start-up code of mingw is half as large as the core
    "dll": ["-nostdlib", "-lkernel32", *(f"-lapi-ms-win-crt-{n}-l1-1-0" for n in WINDOWS)],
}


def link(name: str) -> list[str]:
    """Return the linker options for a library with this name."""
    suffix = name.rpartition(".")[2]
    # by default, the library contains its output path, which differs in every build
    return [*LINK[suffix], *([f"-Wl,-install_name,@rpath/{name}"] if suffix == "dylib" else [])]


def levels(root: Path) -> dict[Path, str]:
    """Return the files listed in fast.txt with their optimisation levels."""
    lines = (root / "fast.txt").read_text().splitlines()
    words = [line.split() for line in lines if line and not line.startswith("#")]
    return {path: level for level, pattern in words for path in root.glob(pattern)}


def unit(root: Path, sources: list[Path]) -> str:
    """Return one translation unit of the given source files. Headers declare the functions of other files."""
    return "#define HYST_PREFIX\n" + Amalgamation(root, sources).text("")


def units(root: Path, sources: list[Path], fast: dict[Path, str]) -> dict[str, tuple[list[str], str]]:
    """Return the translation units by name, each with its compiler options and its text.

    There is one unit for each optimisation level in `fast`, and one unit for all other files.
    """
    fast = {path: level for path, level in fast.items() if path in sources}
    made = {"small": (SMALL, unit(root, [p for p in sources if p not in fast]))}
    for level in sorted(set(fast.values())):
        made[level] = ([f"-{level}"], unit(root, sorted(p for p in fast if fast[p] == level)))
    return made


def zig(*words: object) -> None:
    """Run zig cc with the given arguments; exit if it fails."""
    if subprocess.run([sys.executable, "-m", "ziglang", "cc", *map(str, words)]).returncode:
        raise SystemExit("build.py: the compiler failed")


def fmi_headers() -> Path:
    """Return the folder of the official FMI headers, which come with fmpy."""
    spec = importlib.util.find_spec("fmpy")
    if spec is None or spec.origin is None:
        raise SystemExit("build.py: fmpy is not installed; it contains the FMI headers")
    return Path(spec.origin).parent / "c-code"


def build(root: Path, out: Path, name: str) -> Path:
    """Build the binary of one platform, write it atomically, and return its path."""
    target, suffix = TARGETS[name]
    alone = [root / "fmi" / "files" / n for n in ("open_file.c", "own_folder.c")]  # see there
    fast = {} if name == "x86-windows" else levels(root)
    texts = units(root, [p for p in source_files(root) if p not in alone], fast)
    for path in [*alone, *([root / "platforms" / "windows.c"] if suffix == "dll" else [])]:
        texts[path.stem] = (SMALL, path.read_text())
    position = [] if suffix == "dll" else ["-fPIC"]
    out.mkdir(parents=True, exist_ok=True)
    made = out / f"{name}.{suffix}"
    with tempfile.TemporaryDirectory(dir=out) as where:
        objects = []
        for k, (level, text) in texts.items():
            source, compiled = Path(where, f"{k}.c"), Path(where, f"{k}.o")
            source.write_text(text)
            include = [f"-I{root}", f"-isystem{fmi_headers()}"]
            zig("-target", target, *OPTIONS, *level, *position, *include, "-c", source, "-o", compiled)
            objects.append(compiled)
        part = Path(where, made.name)
        zig("-target", target, "-Os", "-s", "-shared", *objects, *link(made.name), "-o", part)
        part.replace(made)
    return made


def universal(parts: Sequence[bytes]) -> bytes:
    """Return a universal macOS binary of the binaries for several processors.

    It consists of a big-endian header and the page-aligned binaries (mach-o/fat.h).
    """
    page = 1 << 14
    head, body, at = struct.pack(">II", 0xCAFEBABE, len(parts)), b"", page
    for part in parts:
        processor, kind = struct.unpack("<II", part[4:12])
        head += struct.pack(">5I", processor, kind, at, len(part), 14)
        padded = part + bytes(-len(part) % page)
        body, at = body + padded, at + len(padded)
    return head.ljust(page, b"\0") + body


def deflate(path: Path) -> Path:
    """Write the compressed content of a file as a raw deflate stream (RFC 1951); return the path."""
    import zopfli.zlib

    made = path.with_name(f"{path.name}.deflate")
    made.write_bytes(zopfli.zlib.compress(path.read_bytes())[2:-4])
    return made


def main() -> None:
    """Build the binaries of the given platforms, by default of all platforms."""
    root, out, *names = sys.argv[1:]
    unknown = set(names) - set(TARGETS)
    if unknown:
        got = sorted(unknown)[0]
        raise SystemExit(f"build.py: the platform must be one of {', '.join(TARGETS)}. Got {got!r} instead.")
    files = [build(Path(root).resolve(), Path(out), name) for name in names or TARGETS]
    darwin = [Path(out, f"{name}.{suffix}") for name, (_, suffix) in TARGETS.items() if suffix == "dylib"]
    if all(path.exists() for path in darwin):
        files.append(Path(out, "darwin64.dylib"))
        files[-1].write_bytes(universal([path.read_bytes() for path in darwin]))
    for path in files:
        print(f"{path}: {path.stat().st_size} bytes, deflated {deflate(path).stat().st_size}", flush=True)


if __name__ == "__main__":
    main()
