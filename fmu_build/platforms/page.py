"""Build the core as a WebAssembly module for pages by zig cc (PyPI: ziglang): page.py FMU_BUILD OUT.

The module, OUT/core.wasm, has no imports.  It is compiled as the other binaries are, so it gives their bits; it omits
texts, because pages contain it.
"""

from __future__ import annotations

import sys
import tempfile
import zlib
from pathlib import Path

from build import MEANING, levels, units, zig

MADE = "core.wasm"
TARGET = ["-target", "wasm32-wasi", "-msimd128"]  # every browser that inflates a stream has vectors
OPTIONS = [*MEANING, "-fvisibility=hidden", "-DHYST_UNDOCUMENTED", "-Wno-override-init", "-Wno-unused-function"]
LINK = ["-mexec-model=reactor", "-Wl,--no-entry", "-Wl,--gc-sections", "-Wl,-z,stack-size=65536", "-Os", "-s"]
TEXTS = "message.c"  # sentences need printf, which is as large as a dozen blocks


def build(root: Path, out: Path) -> Path:
    """Build the module and write it atomically."""
    blocks = sorted(root.glob("core/blocks/*/*.c"))
    others = sorted(p for p in set(root.glob("core/**/*.c")) - set(blocks) if p.name != TEXTS)
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out) as where:
        objects = []
        sources = [*blocks, *others, root / "platforms" / "page.c"]
        for name, (level, text) in units(root, sources, levels(root)).items():
            source, compiled = Path(where, f"{name}.c"), Path(where, f"{name}.o")
            source.write_text(text)
            zig(*TARGET, *OPTIONS, *level, f"-I{root}", "-c", source, "-o", compiled)
            objects.append(compiled)
        part = Path(where, MADE)
        zig(*TARGET, *objects, *LINK, "-o", part)
        return part.replace(out / MADE)


if __name__ == "__main__":
    made = build(Path(sys.argv[1]).resolve(), Path(sys.argv[2]))
    content = made.read_bytes()
    print(f"{made}: {len(content)} bytes, deflated {len(zlib.compress(content, 9))}")
