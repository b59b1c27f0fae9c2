"""Fails when a generated text is stale: the block table of the README comes from the C tables."""

import sys
from pathlib import Path

from hystfmu import listing

README = Path(__file__).parent.parent / "README.md"
BEGIN = "<!-- generated from the C tables by `make generate` - do not edit -->\n"
END = "<!-- end of the generated table -->"


def main(write: bool) -> int:
    text = README.read_text()
    head, rest = text.split(BEGIN)
    fresh = head + BEGIN + listing.markdown() + "\n" + END + rest.split(END, 1)[1]
    if write:
        README.write_text(fresh)
    elif fresh != text:
        print("README.md: the block table is stale; run 'make generate'")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main("--write" in sys.argv))
