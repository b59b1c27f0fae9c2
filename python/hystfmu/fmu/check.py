"""Looks for problems in an FMU of anybody: the archive, the description (fmpy), then a run in a child process."""

from __future__ import annotations

import io
import json
import os
import signal
import stat
import subprocess
import sys
import tempfile
import zipfile
import zlib
from collections import Counter
from pathlib import Path

from hystfmu.errors import InputError
from hystfmu.files import read_bytes

MOST_ENTRIES = 10_000
MOST_UNPACKED = 512 * 2**20
MOST_XML = 64 * 2**20
XML = "modelDescription.xml"


def _unsafe(entry: zipfile.ZipInfo) -> str:
    """Why this entry must not be unpacked, or an empty string."""
    name = entry.orig_filename
    if "\\" in name or "\0" in name:
        return "has a backslash or a zero byte in its name"
    if name.startswith("/") or ":" in name.split("/")[0] or ".." in name.split("/"):
        return "would be written outside the folder"
    if stat.S_ISLNK(entry.external_attr >> 16):
        return "is a symbolic link"
    return "is encrypted" if entry.flag_bits & 1 else ""


def _archive_problems(archive: zipfile.ZipFile) -> list[str]:
    entries = archive.infolist()
    if len(entries) > MOST_ENTRIES:
        return [f"the archive has {len(entries)} files; the limit is {MOST_ENTRIES}"]
    size = sum(e.file_size for e in entries)
    if size > MOST_UNPACKED:
        return [f"the archive unpacks to {size} bytes; the limit is {MOST_UNPACKED}"]
    problems = [f"{e.filename!r} {why}" for e in entries if (why := _unsafe(e))]
    twice = [name for name, n in Counter(e.filename for e in entries).items() if n > 1]
    problems += [f"{name!r} is in the archive more than once" for name in twice]
    names = {e.filename for e in entries}
    if XML not in names:
        problems.append(f"the archive has no {XML}")
    elif archive.getinfo(XML).file_size > MOST_XML:
        problems.append(f"{XML} is larger than {MOST_XML} bytes")
    return problems


def _unpack(archive: zipfile.ZipFile, folder: Path) -> list[str]:
    """Write the entries of an archive that was found safe; the names of damaged ones."""
    problems = []
    for entry in archive.infolist():
        if entry.is_dir():
            continue
        try:
            content = archive.read(entry)  # never more than the declared size, and its checksum is compared
        except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, OSError) as e:
            problems.append(f"{entry.filename!r} cannot be unpacked: {e}")
            continue
        path = folder / entry.filename
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        except OSError as e:
            problems.append(f"{entry.filename!r} cannot be unpacked: {e.strerror}")
    return problems


def _run_problems(folder: Path, seconds: float) -> list[str]:
    """Load and step the unpacked FMU in a child, whose crash or hang is only a problem in a list."""
    result = folder / "result.json"
    package = str(Path(__file__).parents[2])
    path = os.pathsep.join([package, *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-m", "hystfmu.fmu.probe", str(folder / "fmu"), str(result)]
    try:
        child = subprocess.run(
            command, env={**os.environ, "PYTHONPATH": path}, capture_output=True, timeout=seconds, cwd=folder
        )
    except subprocess.TimeoutExpired:
        return [f"the FMU did not finish 100 steps within {seconds:g} s"]
    lines = (child.stdout + child.stderr).decode(errors="replace").strip().splitlines()
    if result.exists():
        # what the FMU itself logged says more than "failed to instantiate"
        return [f"{p} ({lines[-1]})" if lines else str(p) for p in json.loads(result.read_text())]
    if child.returncode < 0:
        return [f"the FMU crashed: {signal.Signals(-child.returncode).name}"]
    return [f"the FMU ended its process with status {child.returncode}" + (f": {lines[-1]}" if lines else "")]


def check_fmu(path: str | Path, seconds: float = 60.0) -> list[str]:
    """Problems of an FMU: archive, description, and a load-and-step round trip in a child process.

    The round trip reads the start values back, makes 100 steps with moving inputs, wants finite outputs, and, where the
    FMU declares it, restores a saved state and compares the second half of the run bit for bit.

    Parameters
    ----------
    path : str or Path
        The FMU; of any origin.  Its binary is executed (in a child process).
    seconds : float
        Time limit of the run.

    Returns
    -------
    list of str
        One line each; empty if there are none.  Archive problems end the check before anything is unpacked.

    Raises
    ------
    InputError
        If the file cannot be read or is not a whole zip archive.
    """
    try:
        archive = zipfile.ZipFile(io.BytesIO(read_bytes(path)))
    except (zipfile.BadZipFile, ValueError, OSError, NotImplementedError) as e:
        if isinstance(e, InputError):
            raise
        raise InputError(f"{path}: not a zip archive, or cut off ({e})") from None
    problems = _archive_problems(archive)
    if problems:
        return problems
    with tempfile.TemporaryDirectory(prefix="hystfmu-check-") as folder:
        problems = _unpack(archive, Path(folder, "fmu"))
        if problems:
            return problems
        xml = Path(folder, "fmu", XML).read_bytes()
        if b"<!DOCTYPE" in xml or b"<!ENTITY" in xml:
            return [f"{XML} declares a document type; entities are refused"]
        from fmpy.validation import validate_fmu

        problems = [" ".join(str(p).split()) for p in validate_fmu(str(Path(folder, "fmu")))]
        return problems or _run_problems(Path(folder), seconds)
