"""Fails when a generated text is stale: tables of the README, signatures of blocks, files of the Modelica library."""

import sys
from pathlib import Path

import stage_table
import tracking_table

from hystfmu.base.errors import InputError
from hystfmu.graph import listing, stubs
from hystfmu.modelica import library

README = Path(__file__).parent.parent / "README.md"
PARTS = (
    (README, "from the C tables", listing.markdown),
    (README, "from the baselines of the scenarios", tracking_table.markdown),
    (stage_table.PAGE, "from the baselines of the scenarios", stage_table.markdown),
)
STUB = README.parent / "python" / "hystfmu" / "graph" / "blocks.pyi"
MODELICA = README.parent / "modelica" / "HystFMU"
END = "<!-- end of the generated table -->"


def main(write: bool) -> int:
    fresh = {page: page.read_text() for page, _, _ in PARTS}
    for page, source, make in PARTS:
        begin = f"<!-- generated {source} by `make generate` - do not edit -->\n"
        head, rest = fresh[page].split(begin)
        fresh[page] = head + begin + make() + "\n" + END + rest.split(END, 1)[1]
    if write:
        for page, text in fresh.items():
            page.write_text(text)
        STUB.write_text(stubs.stub())
        library.write(MODELICA)
        return 0
    here = README.parent
    stale = [f"{p.relative_to(here)}: a generated table" for p, text in fresh.items() if text != p.read_text()]
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
