"""Fails when a generated file is stale: tables and picture of pages, signatures of blocks, Modelica library.

`make generate` also builds the core for pages, which needs a compiler of its own; `make check` compares it.
"""

import sys
from pathlib import Path

import hard_table
import papers_table
import stage_table
import switching_table
import tracking_table

from hystfmu.base.errors import InputError
from hystfmu.graph import listing

sys.path.insert(0, str(Path(__file__).parent.parent / "python" / "docs"))
sys.path.insert(0, str(Path(__file__).parent.parent / "modelica"))
import first_screen

import generator

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "python" / "docs"
HARD = "from the records of scenarios/models/run_hard.py"
LOOPS = tracking_table.LOOPS | {"adaptive_pid": "PID beside the adaptive inverse"}
PARTS = (
    (DOCS / "blocks.md", "from the C tables", lambda: listing.markdown("##")),
    (DOCS / "tracking.md", "from the baselines of the scenarios", tracking_table.markdown),
    (DOCS / "tracking.md", "from scenarios/loops/switching.record.toml", switching_table.markdown),
    (stage_table.PAGE, "from the baselines of the scenarios", stage_table.markdown),
    (DOCS / "tracking.md", HARD, lambda: hard_table.markdown("loops", LOOPS)),
    (stage_table.PAGE, HARD, lambda: hard_table.markdown("stage", stage_table.CONTROLLERS)),
    (ROOT / "README.md", HARD, hard_table.claims),
    (DOCS / "papers.md", "from the records of `make papers`", papers_table.markdown),
)
STUB = ROOT / "python" / "hystfmu" / "graph" / "blocks.pyi"
MODELICA = ROOT / "modelica" / "HystFMU"
PICTURE = DOCS / "first_screen.svg"
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
        STUB.write_text(listing.stub())
        PICTURE.write_text(first_screen.first_screen())
        generator.write(MODELICA)
        return 0
    stale = [f"{p.relative_to(ROOT)}: a generated table" for p, text in fresh.items() if text != p.read_text()]
    stale += [] if STUB.read_text() == listing.stub() else ["python/hystfmu/graph/blocks.pyi"]
    stale += [] if PICTURE.read_text() == first_screen.first_screen() else [f"{PICTURE.relative_to(ROOT)}"]
    stale += [f"modelica/HystFMU/{file}" for file in generator.stale(MODELICA)]
    found = [*generator.missing(MODELICA), *(f"{what} is stale; run 'make generate'" for what in stale)]
    print(*found, sep="\n", end="\n" if found else "")
    return 1 if found else 0


if __name__ == "__main__":
    try:
        status = main("--write" in sys.argv)
    except InputError as e:
        status = f"{e}"
    sys.exit(status)
