"""`make modelica`: every class of the library, every kind of exported model; exit status 1 if one is not as it should.

report.py [--record]    --record writes the references of Examples and of the models that have one anew
"""

import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

# as pytest has them
sys.path += [str(Path(__file__).parents[1]), *(str(p) for p in Path(__file__).parent.rglob("*") if p.is_dir())]

import compare
import cost
import exported
import form
import library
import outcome
import simulate
from outcome import Outcome


def main(arguments: list[str]) -> int:
    outcome.RECORDING = "--record" in arguments
    complaints = simulate.load(sorted(n for n, c in library.classes().items() if simulate.can_load(c)))
    found: dict[str, Outcome] = {}
    with tempfile.TemporaryDirectory() as folder:
        print(outcome.HEADING)
        for name in compare.models():
            found[name] = compare.compare(name)
            print(outcome.line(found[name]), flush=True)
        print(f"\n{'class':58} {'loads':9} {'simulates in':40} {'C core':>8} {'events':>6} {'s':>6}")
        for name in sorted(library.classes()):
            print(row(name, complaints, found))
        print(f"\n{'exported model':58} {'values':>6} {'rows':>5} {'predict':>9}  {'s':>5}")
        exports = [exported.compare(exported.small(key), key, Path(folder)) for key in exported.KEYS]
        print(*map(exported.line, exports), sep="\n")
        for key in exported.CONTINUOUS_KEYS:
            exports += exported.compare_realisations(exported.small(key), key, Path(folder))
        print(*map(exported.line, exports[len(exported.KEYS) :]), sep="\n")
        print(f"\n{cost.HEADING}")
        smooth, events = (cost.measure(kind) for kind in ("Smooth", "Events"))
        print(cost.line(smooth, smooth), cost.line(events, smooth), sep="\n")
    bad = [f"{name}: does not load: {complaint}" for name, complaint in complaints.items() if complaint]
    bad += [message for o in found.values() for message in o.bad]
    bad += [f"{e.name}: {e.error:.1e} from predict, allowed {e.bound:.0e}" for e in exports if not e.good]
    if events.seconds > cost.MOST * smooth.seconds:
        bad.append(f"Events takes {events.seconds / smooth.seconds:.1f} times the time of Smooth, allowed {cost.MOST}")
    print("", *bad, f"{len(bad)} problem{'' if len(bad) == 1 else 's'}", sep="\n")
    return 1 if bad else 0


def row(name: str, complaints: Mapping[str, str], found: Mapping[str, Outcome]) -> str:
    """One class: does it load, where is it simulated, the worst of the errors there, all events and seconds.

    A function, a type or a partial class loads inside those that use it.
    """
    loads = "inside" if name not in complaints else "NO" if complaints[name] else "yes"
    models = [m for m in ({name} & set(found) or form.validations(library.classes()).get(name, ())) if m in found]
    outcomes = [found[m] for m in models]
    if not outcomes:
        return f"{name:58} {loads}"
    where = ", ".join("itself" if m == name else m.split(".", 2)[2] for m in models)
    events, seconds = sum(o.events for o in outcomes), sum(o.seconds for o in outcomes)
    return f"{name:58} {loads:9} {where:40} {max(o.error_c for o in outcomes):8.1e} {events:6} {seconds:6.1f}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
