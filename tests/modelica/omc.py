"""OpenModelica in place of rumoca, where there is one: $HYSTFMU_OMC, else `omc` on the path."""

import csv
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

import library
import numpy as np

TIME_LIMIT = 1800.0  # s, of one script
REASON = "no OpenModelica: set HYSTFMU_OMC, or put omc on the path"
# where OpenModelica finds an event, and a solver with steps of its own behind an input that is held
EVENTS, HELD = 1e-8, 5e-9


def compiler() -> str:
    """The command, or ""."""
    return os.environ.get("HYSTFMU_OMC") or shutil.which("omc") or ""


def run(script: str | Path, folder: Path) -> str:
    """What the compiler prints about a script (its text, or a file) that runs in `folder`, where its files come to lie.

    Raises
    ------
    AssertionError
        It ends with another exit status than 0.
    """
    if isinstance(script, str):
        file = folder / "run.mos"
        file.write_text(script)
    else:
        file = script
    command = [compiler(), str(file)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder, timeout=TIME_LIMIT, check=False)
    assert done.returncode == 0, f"{file.name}: {done.stdout[-1000:]}{done.stderr[-1000:]}"
    return done.stdout


def checked(said: str) -> tuple[int, int]:
    """Classes that a check of a package looked at, and those that failed.

    "Error String:" stands before each class, also before a sound one.
    """
    found = re.findall(r"checked / failed: (\d+)/(\d+)", said)
    return (int(found[-1][0]), int(found[-1][1])) if found else (0, 0)


def result_files(said: str) -> list[str]:
    """The file of each simulation of a script; "" where it failed."""
    return re.findall(r'resultFile = "([^"]*)"', said)


def simulate(*arguments: str | Path, packages: Sequence[Path] = (library.ROOT,)) -> str:
    """As simulate.rumoca: FILE MODEL STOP STEP TOLERANCE OUT.npz [START]; the complaint, or ""."""
    file, model, stop, step, tolerance, out, *rest = arguments
    start = float(rest[0]) if rest else 0.0
    intervals = round((float(stop) - start) / float(step) - 0.25)  # a last instant may lie half a step beyond them
    files = [p / "package.mo" for p in packages]
    if not any(Path(file).is_relative_to(p) for p in packages) or not _listed(Path(file)):
        files.append(Path(file))
    loads = [f'loadFile("{Path(f).resolve().as_posix()}"); getErrorString();' for f in files]
    end = start + intervals * float(step)
    settings = (
        f"startTime = {start!r}, stopTime = {end!r}, numberOfIntervals = {intervals}, tolerance = {tolerance}, "
        'outputFormat = "csv", fileNamePrefix = "run"'
    )
    script = "\n".join([*loads, f"simulate({model}, {settings}); getErrorString();", ""])
    with tempfile.TemporaryDirectory() as folder:
        said = run(script, Path(folder))
        results = result_files(said)
        if results in ([], [""]):
            return f"no result file: {' '.join(said.split())[-1500:]}"
        np.savez(str(out), allow_pickle=False, **read(Path(folder) / results[-1]))
    return ""


def read(file: Path) -> dict[str, np.ndarray]:
    """The columns of a result in CSV."""
    with file.open(newline="") as lines:
        rows = csv.reader(lines)
        head = next(rows)
        table = np.array([[float(x) for x in row if x] for row in rows])
    return {name: table[:, k] for k, name in enumerate(h for h in head if h)}


def _listed(file: Path) -> bool:
    """Is a file one of the classes that its package lists? A test may have put it there."""
    order = file.with_name("package.order")
    return order.is_file() and file.stem in order.read_text().split()
