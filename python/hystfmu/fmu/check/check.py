"""The function `validate`, which finds problems in the archive, the description and the behaviour of any FMU."""

from __future__ import annotations

import importlib.util
import json
import re
import tempfile
import time
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from hystfmu.base import InputError, check_source, checked
from hystfmu.base.child import Child, read_result
from hystfmu.base.confine import Box
from hystfmu.base.printable import printable
from hystfmu.fmu.archive import archive_problems, unpack, xml_problems
from hystfmu.fmu.check.foreign_library import STEPS

MOST_CHECKS, MOST_WORDS = 40, 200


@dataclass(frozen=True)
class Check:
    """Result of the check of one property of an FMU.

    Attributes
    ----------
    name : str
        Name of the check.
    tried : str
        Extent of the check, such as ``3 instances, 250 steps``. It is empty if the check does not apply to the FMU.
    problems : int
        Number of problems found.
    seconds : float in (0, inf)
        Duration of the check (s).
    """

    name: str
    tried: str
    problems: int
    seconds: float


@dataclass(frozen=True)
class Place:
    """Start point of a child process: the first check that it makes after a check has ended the previous process.

    `first` is the number of the check, and `steps` is the number of steps that the FMU can make. `failed` contains the
    names of the checks that could not be completed; a check that needs one of them is skipped.
    """

    first: int
    steps: int
    failed: Sequence[str]

    @classmethod
    def of(cls, notes: Any) -> Place:
        """Return the start point in the notes of a child process, a JSON file that the FMU may have changed.

        Raises
        ------
        TypeError, ValueError, KeyError
            The notes do not contain a valid start point.
        """
        failed = [str(name)[:MOST_WORDS] for name in notes["failed"][:MOST_CHECKS]]
        return cls(int(notes["first"]), int(notes["steps"]), failed)


class Findings(list[str]):
    """Problems of an FMU, one line each. `checks` lists the completed checks, and the check that ended a process."""

    def __init__(self, problems: Sequence[str] = (), checks: Sequence[Check] = ()) -> None:
        super().__init__(map(printable, problems))  # a problem may contain variable names of the FMU
        self.checks = tuple(checks)


def checks_of(notes: Any) -> list[Check]:
    """Return the checks in the notes of a child process, a JSON file that the FMU may have changed.

    Raises
    ------
    TypeError, ValueError, KeyError
        The notes do not contain valid checks.
    """
    return [
        Check(
            printable(str(c["name"])[:MOST_WORDS]),
            printable(str(c["tried"])[:MOST_WORDS]),
            int(c["problems"]),
            float(c["seconds"]),
        )
        for c in notes[:MOST_CHECKS]
    ]


MOST_NOTES = 2**24  # maximum size of the notes (bytes)
MOST_START = 60.0  # s: time limit until the first check of a child begins; no code of the FMU runs before it
ABOUT = 24  # approximate number of checks of an FMU with both interfaces, for the progress
Progress = Callable[[float], None]


class _Watch:
    """Reader of the notes of a running child process: a JSON file with its findings and its current check.

    The time limit of a check starts when the file names this check.
    """

    def __init__(self, result: Path, progress: Progress) -> None:
        self.result, self.progress = result, progress
        self.number, self.begin = -1, time.monotonic()

    def notes(self) -> dict[str, Any]:
        """Return the notes of the child process. The FMU may have changed the notes."""
        notes: dict[str, Any] = json.loads(read_result(self.result, MOST_NOTES))
        return notes

    def look(self) -> bool:
        """Return whether a new check has begun since the last call, or whether no check has begun yet."""
        with suppress(ValueError, KeyError, TypeError, RecursionError):
            if not self.result.exists():
                return time.monotonic() - self.begin < MOST_START
            number = min(Place.of(self.notes()["place"]).first, MOST_CHECKS)
            self.progress(min(number / ABOUT, 1.0))
            number, self.number = self.number, max(self.number, number)
            return self.number > number
        return False


def _part(process: Child, watch: _Watch, seconds: float) -> tuple[Findings, Place | None]:
    """Return the findings of one child process, and the start point of the next one if a check ended this process."""
    lines, in_time = process.finish(seconds, watch.look)
    try:
        notes = watch.notes()
        problems = [" ".join(str(p).split()) for p in notes["problems"]]
        doing, finished, checks = str(notes["doing"]), bool(notes["done"]), checks_of(notes["checks"])
        place = Place.of(notes["place"])
    except (ValueError, KeyError, TypeError, RecursionError):
        return Findings([f"the check failed: {lines[-1] if lines else process.status}"]), None
    known = len(problems)
    if not in_time:
        problems.append(f"the FMU did not finish within {seconds:g} s while {doing}")
    elif process.status < 0:
        problems.append(f"the FMU {process.ending} while {doing}")
    elif not finished:
        problems.append(f"the FMU ended its process with status {process.status} while {doing}")
    if problems and lines and re.search("cannot be instantiated|failed with status", problems[0]):
        problems[0] += f" ({lines[-1]})"  # append the log message of the FMU
    if len(problems) > known:
        checks.append(Check(doing, "not finished", len(problems) - known, 0.0))
    return Findings(problems, checks), None if finished else place


def _run_problems(folder: Path, box: Box | None, seconds: float, progress: Progress) -> Findings:
    """Return the findings of all child processes. Each process begins after the check that ended the previous one."""
    found, place = Findings(), Place(0, STEPS, [])
    while True:
        result = folder / f"result{place.first}.json"
        arguments = str(folder / "fmu"), str(result), str(seconds), json.dumps(asdict(place))
        process = Child("-m", "hystfmu.fmu.check.probe", *arguments, box=box)
        part, further = _part(process, _Watch(result, progress), seconds)
        found = Findings([*found, *(p for p in part if p not in found)], [*found.checks, *part.checks])
        if further is None or not place.first < further.first <= MOST_CHECKS:
            return found
        place = further


def _fmutool_problems(process: Child | None, seconds: float) -> Findings:
    """Return the errors that the optional tool fmutool reports. The extra `dev` installs fmutool."""
    if process is None:
        return Findings()
    begin = time.monotonic()
    lines, _ = process.finish(seconds)
    found = (re.match(r"(?:ERROR|CRITICAL)\s*\|\s*(.*)", line) for line in lines)
    summary = re.compile(r"This FMU does not validate|error\(s\)")
    problems = [f"fmutool: {m[1]}" for m in found if m and not summary.search(m[1])]
    return Findings(problems, [Check("fmutool", "rules of fmutool", len(problems), time.monotonic() - begin)])


@checked
def validate(
    path: str | Path, seconds: float = 60.0, confined: bool = True, progress: Progress = lambda fraction: None
) -> Findings:
    """Find problems in the archive, the description and the behaviour of an FMU of any origin.

    The archive is inspected before it is unpacked. Then the static checks of fmpy are applied, and those of fmutool if
    it is installed. Trial runs in Co-Simulation check start values, repeatability, side effects of get and set, reset,
    saved states, NULL pointers, and two instances in one process. They also check steps of different lengths,
    dependencies, directional derivatives, memory leaks, repeated loading, and folders with spaces and non-ASCII
    letters. Trial runs in Model Exchange check repeatability, events, the order of states, effects of rejected steps,
    dependencies and directional derivatives. Trial runs in Scheduled Execution activate the model partitions.

    If the FMU ends the simulation by itself, a trial run ends at this time. All checks except the inspection of the
    archive run in child processes. These processes have limits of time and memory, no network access, and write access
    to one folder only. After a crash, the next check runs in another process. If a check needs something that is
    missing, such as an instance, the findings state this in one line.

    Parameters
    ----------
    path : str or Path
        The FMU. Its native code is executed in a child process.
    seconds : float
        Time limit of each check (s).
    confined : bool
        Whether the FMU is confined: it has no access to the network and can write only to one private folder. Some
        operating systems do not offer this protection.
    progress : function, optional
        Function that is called with the approximate fraction of completed checks, 0..1.

    Returns
    -------
    Findings
        Problems, one line each; empty if no problem is found. Its attribute `checks` lists the checks that were made.
        If the archive has a problem, it is not unpacked, and no further check is made.

    Raises
    ------
    InputError
        The file cannot be read, or it is not a complete zip archive.

    Examples
    --------
    >>> import hystfmu as hy
    >>> model = hy.Model("creep", hy.blocks.Creep().graph)
    >>> found = hy.validate(model.export("creep.fmu"))
    >>> found
    []
    >>> next(c.tried for c in found.checks if c.name == "making 100 steps")
    '1 instance, 100 values read, 100 values set, 100 steps'
    """
    check_source(path)
    begin = time.monotonic()
    try:
        with zipfile.ZipFile(path) as archive:
            problems, tried = archive_problems(archive), f"{len(archive.infolist())} entries"
            with tempfile.TemporaryDirectory(prefix="hystfmu-check-") as folder:
                unpacked = Path(folder, "fmu")
                problems = problems or unpack(archive, unpacked) or xml_problems(unpacked)
                first = Check("archive", tried, len(problems), time.monotonic() - begin)
                if problems:
                    return Findings(problems, [first])
                found = _content_problems(Path(path), Path(folder), seconds, confined, progress)
                return Findings(found, [first, *found.checks])
    except (zipfile.BadZipFile, ValueError, NotImplementedError) as e:
        raise InputError(f"{path}: not a ZIP archive, or truncated ({e})") from None
    except OSError as e:
        raise InputError(f"{path}: {e.strerror or f'not a ZIP archive, or truncated ({e})'}") from None


def _content_problems(path: Path, folder: Path, seconds: float, confined: bool, progress: Progress) -> Findings:
    first = re.search(rb"""fmiVersion\s*=\s*["']1\.""", (folder / "fmu" / "modelDescription.xml").read_bytes())
    box = Box.of(folder, path) if confined else None
    fmutool = None
    if importlib.util.find_spec("fmu_manipulation_toolbox") and not first:  # fmutool supports FMI 2.0 and 3.0
        start = "from fmu_manipulation_toolbox.cli.fmutool import fmutool; fmutool()"
        fmutool = Child("-c", start, "-input", str(path.absolute()), "-check", box=box)
    run = _run_problems(folder, box, seconds, progress)
    static = _fmutool_problems(fmutool, seconds)
    return Findings([*run, *static], [*run.checks, *static.checks])
