"""The child process of `check_fmu`: run the static checks of fmpy and all trials, and write the findings as JSON.

It records every trial before it begins, so that the parent can name the trial in which the FMU crashed or hung.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hystfmu.base.child import limit_memory
from hystfmu.fmu.check.description_problems import description_problems
from hystfmu.fmu.check.exchange_trials import EXCHANGE_TRIALS
from hystfmu.fmu.check.foreign_library import ForeignFmu
from hystfmu.fmu.check.scheduled_trials import SCHEDULED_TRIALS
from hystfmu.fmu.check.trials import TRIALS, Trial
from hystfmu.fmu.foreign.finding import Finding
from hystfmu.fmu.foreign.instance import TALLY, version

MOST_GIGABYTES = 4.0
ODD_FOLDER = "Größe 1 %41"
FIRST = list(TRIALS)[:2]


class Notes:
    """Findings and current activity, always up to date on disk: any call may end the process."""

    def __init__(self, path: Path) -> None:
        self.path, self.doing = path, "reading modelDescription.xml"
        self.problems: list[str] = []
        self.checks: list[dict[str, Any]] = []
        self.save(False)

    def save(self, done: bool) -> None:
        """Write the file atomically."""
        part = self.path.with_suffix(".part")
        part.write_text(json.dumps(self._content | {"done": done}))
        part.replace(self.path)

    @property
    def _content(self) -> dict[str, Any]:
        return {"doing": self.doing, "problems": self.problems, "checks": self.checks}

    @contextmanager
    def check(self, doing: str, tried: str = "") -> Iterator[None]:
        """Record an activity; a crash from now on is attributed to it.  Then record how much was tried."""
        self.doing = doing
        self.save(False)
        begin, known, before = time.monotonic(), len(self.problems), TALLY.copy()
        yield
        done = ", ".join(_counted(n, what) for what, n in (TALLY - before).items())
        found = {"name": doing, "tried": tried or done, "problems": len(self.problems) - known}
        self.checks.append(found | {"seconds": time.monotonic() - begin})


def _counted(n: int, what: str) -> str:
    """Return a number of things, whose word has the plural at the end of its first part."""
    first, *others = what.split(" ")
    return " ".join([f"{n}", first if n > 1 else first[:-1], *others])


def _try(fmu: ForeignFmu, trials: dict[str, Trial], notes: Notes) -> None:
    """Run all trials.  A finding that ends one trial does not end the others."""
    for title, trial in trials.items():
        with notes.check(title):
            try:
                found = list(trial(fmu))
            except Finding as e:
                found = [f"{e} (while {title})"]
            except Exception as e:  # any failure of a foreign FMU is a finding
                found = [f"{title}: {type(e).__name__}: {e}"]
            lines = [" ".join(p.split()) for p in found]
            notes.problems += [p for p in lines if p not in notes.problems]
        if found and title in FIRST:
            return  # the FMU does not run: further trials would repeat the finding


def _try_odd_folder(folder: Path, description: Any, notes: Notes) -> None:
    """Run from a folder with a space and non-ASCII letters, as some importers do."""
    with notes.check("loading from a folder with a space and non-ASCII letters"):
        odd = folder.parent / ODD_FOLDER
        folder.rename(odd)
        fmu = ForeignFmu(odd, description)
        try:
            if description.coSimulation:
                with fmu.running() as made:
                    fmu.run(made, range(3))
            else:
                with fmu.instance("ModelExchange" if description.modelExchange else "ScheduledExecution"):
                    pass
        except Finding as e:
            notes.problems.append(f"in a folder with a space and non-ASCII letters: {e}")


def probe(folder: Path, notes: Notes) -> None:
    """Check the FMU unpacked in `folder` and add the findings to `notes`."""
    from fmpy import platform, platform_tuple, read_model_description
    from fmpy.validation import validate_fmu

    with notes.check("reading modelDescription.xml", "schema and rules of fmpy"):
        notes.problems += [" ".join(str(p).split()) for p in validate_fmu(str(folder))]
    if notes.problems:
        return
    description = read_model_description(str(folder), validate=False)
    host = platform_tuple if version(description) == 3 else platform
    if not (folder / "binaries" / host).is_dir():
        notes.problems.append(f"the FMU has no binary for this platform ({host}): it was not run")
        return
    with notes.check("looking for contradictions in it", f"{len(description.modelVariables)} variables"):
        notes.problems += description_problems(description, folder / "binaries" / host)
    if notes.problems:
        return
    fmu = ForeignFmu(folder, description)
    if description.coSimulation:
        _try(fmu, TRIALS, notes)
    if description.modelExchange and not notes.problems:
        _try(fmu, EXCHANGE_TRIALS, notes)
    if description.scheduledExecution and not notes.problems:
        _try(fmu, SCHEDULED_TRIALS, notes)
    if not notes.problems:
        _try_odd_folder(folder, description, notes)


def main() -> None:
    """Run ``python -m hystfmu.fmu.check.probe FOLDER RESULT``."""
    folder, result = map(Path, sys.argv[1:])
    limit_memory(MOST_GIGABYTES)
    notes = Notes(result)
    try:
        probe(folder, notes)
    except Exception as e:
        notes.problems.append(f"{notes.doing}: {' '.join(str(e).split())}")
    notes.save(True)


if __name__ == "__main__":
    main()
