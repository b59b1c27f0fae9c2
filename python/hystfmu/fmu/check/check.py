"""Find problems in an FMU of any origin: in its archive, by static checks, and by trial runs in child processes."""

from __future__ import annotations

import importlib.util
import json
import re
import signal
import tempfile
import zipfile
from pathlib import Path

from hystfmu.base.child import Child
from hystfmu.base.confine import Box
from hystfmu.base.errors import InputError
from hystfmu.base.files import check_source, read_bytes
from hystfmu.fmu.archive.unpack import archive_problems, unpack, xml_problems

MOST_NOTES = 2**24  # bytes of the findings


def _signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _run_problems(process: Child, result: Path, seconds: float) -> list[str]:
    """Return the findings of the child process, including the trial in which it crashed or hung."""
    lines, in_time = process.finish(seconds)
    try:
        notes = json.loads(read_bytes(result, MOST_NOTES))  # the FMU may have written it
        problems = [" ".join(str(p).split()) for p in notes["problems"]]
        doing, finished = str(notes["doing"]), bool(notes["done"])
    except (ValueError, KeyError, TypeError, RecursionError):
        return [f"the check failed: {lines[-1] if lines else process.status}"]
    if not in_time:
        problems.append(f"the FMU did not finish within {seconds:g} s while {doing}")
    elif process.status < 0:
        problems.append(f"the FMU crashed ({_signal(-process.status)}) while {doing}")
    elif not finished:
        problems.append(f"the FMU ended its process with status {process.status} while {doing}")
    if problems and lines and re.search("cannot be instantiated|failed with status", problems[0]):
        problems[0] += f" ({lines[-1]})"  # append the log message of the FMU
    return problems


def _fmutool_problems(process: Child | None, seconds: float) -> list[str]:
    """Return the errors that fmutool reports.  It is optional (extra `dev`)."""
    if process is None:
        return []
    lines, _ = process.finish(seconds)
    found = (re.match(r"(?:ERROR|CRITICAL)\s*\|\s*(.*)", line) for line in lines)
    summary = re.compile(r"This FMU does not validate|error\(s\)")
    return [f"fmutool: {m[1]}" for m in found if m and not summary.search(m[1])]


def check_fmu(path: str | Path, seconds: float = 60.0, confined: bool = True) -> list[str]:
    """Check archive, model description and behaviour of an FMU of any origin.

    The archive is inspected before it is unpacked.  Then the static checks of fmpy and, if installed, of fmutool are
    applied.  The trials of `hystfmu.fmu.check.trials` run the FMU in Co-Simulation and check start values,
    repeatability, side effects of get and set, reset, saved states, NULL pointers, two instances, lengths of steps,
    dependencies, directional derivatives, memory leaks, repeated loading, and folders with spaces and non-ASCII
    letters.  The trials of `hystfmu.fmu.check.exchange_trials` run it in Model Exchange and check repeatability,
    events, the order of states, effects of rejected steps, dependencies and directional derivatives.  Those of
    `hystfmu.fmu.check.scheduled_trials` activate the partitions of Scheduled Execution.  An FMU may end its simulation
    by itself: a run is then as long as the FMU allows.  All but the inspection of the archive runs in child processes
    with limits of time and memory, without network, and writes into a folder of its own only.

    Parameters
    ----------
    path : str or Path
        The FMU.  Its native code is executed in a child process.
    seconds : float
        Time limit of the checks (s).
    confined : bool
        Whether the FMU runs without network and writes into a folder of its own only, where the system can.

    Returns
    -------
    list of str
        Problems, one line each; empty if none is found.  A problem of the archive ends the check before unpacking.

    Raises
    ------
    InputError
        If the file cannot be read or is not a complete ZIP archive.
    """
    check_source(path)
    try:
        with zipfile.ZipFile(path) as archive:
            problems = archive_problems(archive)
            if problems:
                return problems
            with tempfile.TemporaryDirectory(prefix="hystfmu-check-") as folder:
                return unpack(archive, Path(folder, "fmu")) or _content_problems(
                    Path(path), Path(folder), seconds, confined
                )
    except (zipfile.BadZipFile, ValueError, NotImplementedError) as e:
        raise InputError(f"{path}: not a ZIP archive, or truncated ({e})") from None
    except OSError as e:
        raise InputError(f"{path}: {e.strerror or f'not a ZIP archive, or truncated ({e})'}") from None


def _content_problems(path: Path, folder: Path, seconds: float, confined: bool) -> list[str]:
    problems = xml_problems(folder / "fmu")
    if problems:
        return problems
    first = re.search(rb"""fmiVersion\s*=\s*["']1\.""", (folder / "fmu" / "modelDescription.xml").read_bytes())
    result = folder / "result.json"
    box = Box.of(folder, path) if confined else None
    probe = Child("-m", "hystfmu.fmu.check.probe", str(folder / "fmu"), str(result), box=box)
    fmutool = None
    if importlib.util.find_spec("fmu_manipulation_toolbox") and not first:  # it knows FMI 2.0 and 3.0
        start = "from fmu_manipulation_toolbox.cli.fmutool import fmutool; fmutool()"
        fmutool = Child("-c", start, "-input", str(path.absolute()), "-check", box=box)
    return [*_run_problems(probe, result, seconds), *_fmutool_problems(fmutool, seconds)]
