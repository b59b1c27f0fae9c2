"""`make modelica`: every class of the library, every kind of exported model; exit status 1 if one is not as it should.

report.py [--record]    --record writes the references of the Validation models anew
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import compare
import exported
import implicit
import library
import simulate


def main(arguments: list[str]) -> int:
    compare.RECORDING = "--record" in arguments
    bad = 0
    complaints = simulate.load(sorted(n for n, c in library.classes().items() if simulate.can_load(c)))
    for name, complaint in complaints.items():
        if complaint:
            print(f"{name}: does not load: {complaint}")
            bad += 1
    print(f"{len(complaints) - bad} of {len(complaints)} blocks and models load in rumoca\n")
    print(f"{'model':58} {'rows':>6} {'turn':>4}  {'C core':>8}  {'numpy':>8}  {'before':>8}  {'s':>5}")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "result.npz"
        for name in sorted(library.classes()):
            o = None
            if compare.is_operator(name):
                o = compare.compare(name, out)
            elif compare.is_other(name):
                o = compare.compare_other(name, out)
            elif name == implicit.VALIDATION:
                o = implicit.compare_inverse(out)
            elif compare.is_example(name):
                o = compare.compare_example(name, out)
            if o is not None:
                print(compare.line(o), flush=True)
                bad += not o.good
        print(f"\n{'exported model':58} {'values':>6} {'rows':>5} {'predict':>9}  {'s':>5}")
        for key in exported.KEYS:
            e = exported.compare(exported.small(key), key, Path(folder))
            print(exported.line(e), flush=True)
            bad += not e.good
    print(f"\n{bad} problem{'' if bad == 1 else 's'}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
