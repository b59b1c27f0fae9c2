"""The child process of `check_fmu`: static checks of fmpy, then all trials, with limits; writes what it found as JSON.

Before every trial it notes what it is about to do, so that the parent can say during what the FMU crashed or hung.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from hystfmu.base.child import limit_memory
from hystfmu.fmu.check.exchange_trials import EXCHANGE_TRIALS
from hystfmu.fmu.check.foreign_library import Finding, Guest
from hystfmu.fmu.check.trials import TRIALS, Trial

MOST_GIGABYTES = 4.0
ODD_FOLDER = "Größe 1 %41"
FIRST = list(TRIALS)[:2]


class Notes:
    """The problems so far and the work at hand, on disk at any time: the next call may be the last one."""

    def __init__(self, path: Path) -> None:
        self.path, self.doing = path, "reading modelDescription.xml"
        self.problems: list[str] = []
        self.save(False)

    def save(self, done: bool) -> None:
        """Write the file as a whole."""
        part = self.path.with_suffix(".part")
        part.write_text(json.dumps({"done": done, "doing": self.doing, "problems": self.problems}))
        part.replace(self.path)

    def begin(self, doing: str) -> None:
        """From now on a crash belongs to this."""
        self.doing = doing
        self.save(False)


def _try(guest: Guest, trials: dict[str, Trial], notes: Notes) -> None:
    """All trials; the first finding of a kind that ends a trial does not end the others."""
    for title, trial in trials.items():
        notes.begin(title)
        try:
            found = list(trial(guest))
        except Finding as e:
            found = [f"{e} (while {title})"]
        except Exception as e:  # whatever a foreign FMU provokes is a finding
            found = [f"{title}: {type(e).__name__}: {e}"]
        lines = [" ".join(p.split()) for p in found]
        notes.problems += [p for p in lines if p not in notes.problems]
        if found and title in FIRST:
            return  # it does not even run: what follows would say the same in other words


def _try_odd_folder(folder: Path, description: Any, notes: Notes) -> None:
    """Some importers unpack below folders with spaces and letters beyond ASCII."""
    notes.begin("loading from a folder with a space and non-ASCII letters")
    odd = folder.parent / ODD_FOLDER
    folder.rename(odd)
    guest = Guest(odd, description)
    try:
        if description.coSimulation:
            with guest.running() as made:
                guest.run(made, range(3))
        else:
            with guest.instance(exchange=True):
                pass
    except Finding as e:
        notes.problems.append(f"in a folder with a space and non-ASCII letters: {e}")


def probe(folder: Path, notes: Notes) -> None:
    """Fill `notes` with what is wrong with the FMU unpacked in `folder`."""
    from fmpy import platform, platform_tuple, read_model_description
    from fmpy.validation import validate_fmu

    notes.problems += [" ".join(str(p).split()) for p in validate_fmu(str(folder))]
    if notes.problems:
        return
    description = read_model_description(str(folder), validate=False)
    if description.coSimulation is None and description.modelExchange is None:
        notes.problems.append("the FMU has neither Co-Simulation nor Model Exchange: it was not run")
        return
    host = platform if description.fmiVersion.startswith("2") else platform_tuple
    if not (folder / "binaries" / host).is_dir():
        notes.problems.append(f"the FMU has no binary for this platform ({host}): it was not run")
        return
    guest = Guest(folder, description)
    if description.coSimulation:
        _try(guest, TRIALS, notes)
    if description.modelExchange and not notes.problems:
        _try(guest, EXCHANGE_TRIALS, notes)
    if not notes.problems:
        _try_odd_folder(folder, description, notes)


def main() -> None:
    """``python -m hystfmu.fmu.check.probe FOLDER RESULT``."""
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
