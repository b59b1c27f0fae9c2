"""Fails when a generated text is stale: tables of the README, signatures of blocks, files of the Modelica library."""

import sys
from pathlib import Path

import tracking_table

from hystfmu.base.errors import InputError
from hystfmu.graph import listing, stubs
from hystfmu.modelica import library

README = Path(__file__).parent.parent / "README.md"
PARTS = (
    ("from the C tables", listing.markdown),
    ("from the baselines of the scenarios", tracking_table.markdown),
)
STUB = README.parent / "python" / "hystfmu" / "graph" / "blocks.pyi"
MODELICA = README.parent / "modelica" / "HystFMU"
END = "<!-- end of the generated table -->"


def main(write: bool) -> int:
    text = fresh = README.read_text()
    for source, make in PARTS:
        begin = f"<!-- generated {source} by `make generate` - do not edit -->\n"
        head, rest = fresh.split(begin)
        fresh = head + begin + make() + "\n" + END + rest.split(END, 1)[1]
    if write:
        README.write_text(fresh)
        STUB.write_text(stubs.stub())
        library.write(MODELICA)
        return 0
    stale = ["README.md: a generated table"] if fresh != text else []
    stale += [] if STUB.read_text() == stubs.stub() else ["python/hystfmu/graph/blocks.pyi"]
    stale += [f"modelica/HystFMU/{file}" for file in library.stale(MODELICA)]
    found = [*library.missing(MODELICA), *(f"{what} is stale; run 'make generate'" for what in stale)]
    print(*found, sep="\n", end="\n" if found else "")
    return 1 if found else 0


if __name__ == "__main__":
    try:
        status = main("--write" in sys.argv)
    except InputError as e:
        status = f"{e}"
    sys.exit(status)
