"""Run an SSP archive by fmpy, libcosim and ecos: rows of the signals that its reference has."""

import csv
import importlib.util
import io
import json
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from fmu_master import Array

from hystfmu.scenario.ssp.write import REFERENCE

Reader = Callable[[Path, list[str], float, int], Array]


def reference(archive: Path) -> tuple[list[str], Array]:
    """Return the names of the signals of the reference, and its rows with the time in front."""
    rows = list(csv.reader(io.StringIO(zipfile.ZipFile(archive).read(REFERENCE).decode())))
    return rows[0][1:], np.array(rows[1:], dtype=float)


def by_fmpy(archive: Path, names: list[str], h: float, n: int) -> Array:
    """Return the rows 1 to n of fmpy.ssp, which has no row of the initialisation."""
    from fmpy.ssp.simulation import simulate_ssp

    result = simulate_ssp(str(archive), stop_time=(n - 0.5) * h, step_size=h)
    return np.column_stack([result[name] for name in names])


def by_libcosim(archive: Path, names: list[str], h: float, n: int) -> Array:
    """Return the rows 1 to n of libcosim, which takes the step from its own annotation in the archive."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    folder = archive.with_suffix(".unpacked")
    zipfile.ZipFile(archive).extractall(folder)
    execution = CosimExecution.from_ssp_file(str(folder / "SystemStructure.ssd"))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    units = {s.name.decode(): s.index for s in execution.slave_infos()}
    places = []
    for name in names:
        unit, variable = name.split(".")
        references = {v.name.decode(): v.reference for v in execution.slave_variables(units[unit])}
        places.append((units[unit], [references[variable]]))
    rows = []
    for _ in range(n):
        assert execution.step()
        rows.append([observer.last_real_values(*place)[0] for place in places])
    return np.array(rows)


_ECOS = """
import ctypes, json, sys
from pathlib import Path
tbb = Path(sys.prefix, "lib", "libtbb.so.12")  # where the package `tbb` puts it, which no loader searches
if tbb.exists():
    ctypes.CDLL(str(tbb), mode=ctypes.RTLD_GLOBAL)
from ecospy import EcosSimulation
archive, names, h, n = json.loads(sys.argv[1])
with EcosSimulation(ssp_path=archive, step_size=h) as simulation:
    simulation.init()
    rows = []
    for _ in range(n):
        simulation.step()
        rows.append([simulation.get_real(name.replace(".", "::")) for name in names])
Path(archive + ".json").write_text(json.dumps(rows))
"""


def by_ecos(archive: Path, names: list[str], h: float, n: int) -> Array:
    """Return the rows 1 to n of ecos; in a process of its own, because some FMUs crash it.

    Raises
    ------
    RuntimeError
        It ended without rows.
    """
    words = [sys.executable, "-c", _ECOS, json.dumps([str(archive), names, h, n])]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120)
    rows = Path(f"{archive}.json")
    if done.returncode or not rows.exists():
        raise RuntimeError(f"ecos ended with status {done.returncode}: {done.stderr.strip()[-300:]}")
    return np.array(json.loads(rows.read_text()))


READERS: dict[str, Reader] = {"fmpy": by_fmpy, "libcosim": by_libcosim, "ecos": by_ecos}
PACKAGES = {"fmpy": "fmpy", "libcosim": "libcosimpy", "ecos": "ecospy"}


def absent(reader: str) -> bool:
    """Whether the package of a reader is not installed."""
    return importlib.util.find_spec(PACKAGES[reader]) is None


def error(archive: Path, reader: str, h: float, most: int = 2000) -> float:
    """Return the largest difference to the reference, as a share of the span of its signal."""
    names, rows = reference(archive)
    n = min(len(rows) - 1, most)
    want = rows[1 : n + 1, 1:]
    span = np.ptp(rows[:, 1:], axis=0)
    span = np.where(span > 0, span, np.maximum(np.abs(rows[:, 1:]).max(axis=0), 1.0))
    gap = np.abs(READERS[reader](archive, names, h, n) - want) / span
    return float(gap.max())
