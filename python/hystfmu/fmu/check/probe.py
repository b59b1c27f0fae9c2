"""The child process of `validate`, which makes the checks of an unpacked FMU and writes the findings as JSON.

The process writes a note before each check. If a check ends the process, the parent can name this check, and another
process begins with the next check.
"""

import json
import math
import re
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import Any

from hystfmu.base.child import limit_memory
from hystfmu.fmu.check.check import Place
from hystfmu.fmu.check.exchange_trials import EXCHANGE_TRIALS, SCHEDULED_TRIALS
from hystfmu.fmu.check.foreign_library import MADE, ForeignFmu, Trial
from hystfmu.fmu.check.trials import STEPPED, TRIALS
from hystfmu.fmu.foreign.instance import CARRIED, TALLY, Finding, interface_of, stated, version

_RULES = "the rules of fmpy cannot be applied: {}: {}"


def rule_problems(folder: Path, description: Any) -> Iterator[str]:
    """Yield the problems that the schema and the rules of fmpy find, one sentence each.

    `description` is the model description read by fmpy without validation, or None if fmpy cannot read it.
    """
    from fmpy import read_model_description
    from fmpy.model_description import ValidationError
    from fmpy.validation import validate_model_description

    try:
        read_model_description(str(folder), validate=True)
    except ValidationError as e:
        yield from map(str, e.problems)
    except Exception as e:
        yield str(e) if description is None else _RULES.format(type(e).__name__, e)
    if description is None:
        return
    # the call above stops at the schema, before the rules of fmpy; both calls report the common problems
    for more in ({"validate_variable_names": True}, {"validate_model_structure": True}):
        try:
            found = validate_model_description(description, **more)
        except Exception as e:  # the rules of fmpy may fail if the file does not fit the schema
            found = [_RULES.format(type(e).__name__, e)]
        yield from (re.sub(r'(for naming convention "structured"\.).*', r"\1", str(p), flags=re.DOTALL) for p in found)


def description_problems(description: Any) -> Iterator[str]:
    """Yield one sentence for each contradiction in a model description, as read by fmpy."""
    for v in description.modelVariables:
        if v.type in CARRIED and v.type != "Boolean":
            yield from _range(v)
    for u in description.unitDefinitions:
        factor = getattr(u.baseUnit, "factor", None) if u.baseUnit is not None else None
        if factor is not None and float(factor) == 0:
            yield f'the unit "{u.name}" has the factor 0 to its base unit'
    experiment = description.defaultExperiment
    if experiment is not None:
        start, stop = float(experiment.startTime or 0), experiment.stopTime
        if stop is not None and float(stop) < start:
            yield f"the default experiment stops at {float(stop):g} s, before its start at {start:g} s"
        if experiment.stepSize is not None and not float(experiment.stepSize) > 0:
            yield f"the step size of the default experiment is {float(experiment.stepSize):g}; it must be positive"
    for title, unknowns in (("Outputs", description.outputs), ("Derivatives", description.derivatives)):
        for name, n in Counter(u.variable.name for u in unknowns).items():
            if n > 1:
                yield f"ModelStructure/{title} lists {name} {n} times"


def _numbers(text: Any) -> list[float]:
    return [] if text is None else [float(w) for w in str(text).split()]


def _range(v: Any) -> Iterator[str]:
    bounds = [_numbers(stated(v, name)) for name in ("min", "max")]
    low, high = (b[0] if b else None for b in bounds)
    if low is not None and high is not None and low > high:
        yield f"{v.name}: the minimum {low:g} is above the maximum {high:g}"
        return
    for x in _numbers(v.start):
        if (low is not None and x < low) or (high is not None and x > high):
            shown = " to ".join("..." if b is None else f"{b:g}" for b in (low, high))
            yield f"{v.name}: the start value {x:g} is outside its range {shown}"
            break
    nominal = _numbers(stated(v, "nominal"))
    if nominal and not (math.isfinite(nominal[0]) and nominal[0] > 0):
        yield f"{v.name}: the nominal value is {nominal[0]:g}; it must be positive"


MOST_GIGABYTES = 4.0
ODD_FOLDER = "Größe 1 %41"
MOST_SECONDS = 10.0  # s: duration of a trial that repeats an action as often as possible
_TABLES = {"CoSimulation": TRIALS, "ModelExchange": EXCHANGE_TRIALS, "ScheduledExecution": SCHEDULED_TRIALS}


class Notes:
    """Findings and current activity, in a file. The file is always up to date, because any call may end the process."""

    def __init__(self, path: Path, place: Place) -> None:
        self.path, self.doing, self.place = path, "starting", place
        self.number, self.steps, self.failed = -1, place.steps, set(place.failed)
        self.problems: list[str] = []
        self.checks: list[dict[str, Any]] = []
        self.save(False)

    def save(self, done: bool) -> None:
        """Write the notes atomically to the file; `done` states whether all checks are completed."""
        place = Place(self.number + 1, self.steps, sorted(self.failed))
        content = {"doing": self.doing, "problems": self.problems, "checks": self.checks, "place": asdict(place)}
        part = self.path.with_suffix(".part")
        part.write_text(json.dumps(content | {"done": done}))
        part.replace(self.path)

    def due(self) -> bool:
        """Count the next check, and return whether it must be made. An earlier process may have made it already."""
        self.number += 1
        return self.number >= self.place.first

    def add(self, problems: Iterator[str]) -> int:
        """Add new problems to the findings, each as one line; return the number of problems."""
        lines = [" ".join(p.split()) for p in problems]
        self.problems += [p for p in dict.fromkeys(lines) if p not in self.problems]
        return len(lines)

    @contextmanager
    def check(self, doing: str, tried: str = "") -> Iterator[None]:
        """Write the activity `doing` to the notes before a check, and the extent of the check after the check.

        A crash is attributed to the activity in the notes.
        """
        self.doing = doing
        self.save(False)
        begin, known, before = time.monotonic(), len(self.problems), TALLY.copy()
        yield
        done = ", ".join(_counted(n, what) for what, n in (TALLY - before).items())
        found = {"name": doing, "tried": tried or done, "problems": len(self.problems) - known}
        self.checks.append(found | {"seconds": time.monotonic() - begin})

    def reach(self, steps: int) -> None:
        """Record the number of steps that the FMU can make. After a crash, later trials make at most this number."""
        self.steps = steps
        if steps:
            self.failed.discard(STEPPED)
        self.save(False)


class _NotedFmu(ForeignFmu):
    """A foreign FMU whose number of possible steps is recorded in the notes."""

    def __init__(self, folder: Path, description: Any, seconds: float, notes: Notes) -> None:
        super().__init__(folder, description, seconds)
        self.notes, self.steps = notes, notes.steps

    def reach(self, steps: int) -> None:
        super().reach(steps)
        self.notes.reach(steps)


def _counted(n: int, what: str) -> str:
    """Return a number with a noun, e.g. "2 values read". The first word of the noun gets the plural form."""
    first, *others = what.split(" ")
    return " ".join([f"{n}", first if n > 1 else first[:-1], *others])


def _try(fmu: ForeignFmu, trial: Trial, notes: Notes) -> None:
    """Make a trial, unless a trial that it needs has failed; add the problems to the notes."""
    missing = "a binary" if trial.name in notes.failed else repr(trial.needs) if trial.needs in notes.failed else ""
    notes.failed.add(trial.name)  # removed when the trial is completed
    if missing:
        with notes.check(trial.name, f"not tried: needs {missing}"):
            return
    with notes.check(trial.name):
        try:
            notes.add(trial.find(fmu))
            notes.failed.discard(trial.name)
        except Finding as e:
            # if no instance can be created, the problem is the same for every interface and is listed once
            notes.add(iter([f"{e} (while {trial.name})" if trial.needs else str(e)]))
        except Exception as e:  # any failure of a foreign FMU is a finding
            notes.add(iter([f"{trial.name}: {type(e).__name__}: {e}"]))


def _odd_folder(fmu: ForeignFmu) -> Iterator[str]:
    """Check that the FMU can be loaded from a folder with a space and non-ASCII letters in its name."""
    odd = fmu.folder.parent / ODD_FOLDER
    fmu.folder.rename(odd)
    there = ForeignFmu(odd, fmu.description)
    try:
        if fmu.description.coSimulation:
            with there.running() as made:
                there.run(made, range(min(fmu.steps, 3)))
        else:
            with there.instance("ModelExchange" if fmu.description.modelExchange else "ScheduledExecution"):
                pass
    except Finding as e:
        yield f"in a folder with a space and non-ASCII letters: {e}"


def _binary_problems(folder: Path, description: Any, notes: Notes) -> Iterator[str]:
    """Yield one problem if the FMU has no binary for this platform, or one for each interface without a binary."""
    from fmpy import platform, platform_tuple

    host = platform_tuple if version(description) == 3 else platform
    there = folder / "binaries" / host
    names = {p.stem for p in there.iterdir()} if there.is_dir() else None
    if names is None:
        yield f"the FMU has no binary for this platform ({host}): it was not run"
    for interface in MADE:
        found = interface_of(description, interface)
        if found is None or (names is not None and found.modelIdentifier in names):
            continue
        notes.failed.add(MADE[interface])
        if names is not None:
            yield f"{interface}: no binary is named after the modelIdentifier {found.modelIdentifier!r}"


def probe(folder: Path, seconds: float, notes: Notes) -> None:
    """Make all checks of the FMU that is unpacked in `folder`, and add the findings to `notes`."""
    from fmpy import read_model_description

    try:
        description = read_model_description(str(folder), validate=False)
    except Exception:  # the checks below find the reason
        description = None
    if notes.due():
        with notes.check("reading modelDescription.xml", "schema and rules of fmpy"):
            notes.add(rule_problems(folder, description))
    if description is None:
        return
    if notes.due():
        with notes.check("looking for contradictions in it", f"{len(description.modelVariables)} variables"):
            notes.add(description_problems(description))
    if notes.due():
        with notes.check("looking for the binary", "of this platform"):
            notes.add(_binary_problems(folder, description, notes))
    interfaces = [i for i in MADE if interface_of(description, i) is not None]
    trials = [trial for i in interfaces for trial in _TABLES[i]]
    for i in interfaces[:1]:
        trials.append(Trial("loading from a folder with a space and non-ASCII letters", _odd_folder, MADE[i]))
    fmu = _NotedFmu(folder, description, min(MOST_SECONDS, seconds / 2), notes)
    for trial in trials:
        if notes.due():
            _try(fmu, trial, notes)


def main() -> None:
    """Run ``python -m hystfmu.fmu.check.probe FOLDER RESULT SECONDS PLACE``."""
    import_module("fmpy.validation")  # imported before the first check, because it takes longer than some checks
    folder, result = map(Path, sys.argv[1:3])
    limit_memory(MOST_GIGABYTES)
    notes = Notes(result, Place.of(json.loads(sys.argv[4])))
    try:
        probe(folder, float(sys.argv[3]), notes)
    except Exception as e:
        notes.add(iter([f"{notes.doing}: {e}"]))
    notes.doing = "ending"
    notes.save(True)


if __name__ == "__main__":
    main()
