"""Run a graph by fmpy, libcosim, a container FMU and the Python unit, which must agree to the last bit."""

import csv
import importlib.util
import io
import json
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from fmpy import read_model_description, simulate_fmu
from fmu_master import Array
from fmu_slave import Slave

from hystfmu import Graph, Unit
from hystfmu.scenario.ssp.write import REFERENCE


def run_by_fmpy(fmu: Path, folder: Path, u: Array, h: float) -> Array:
    """Return rows of outputs: row 0 after initialisation with u[0], row k after set u[k] and doStep((k - 1) h, h)."""
    slave = Slave(fmu, folder)
    y = [slave.start(u[0]), *(slave.step((k - 1) * h, h, u[k]) for k in range(1, len(u)))]
    slave.free()
    return np.array(y)


def run_by_unit(graph: Graph, u: Array, h: float = 0.0, times: list[float] | None = None) -> Array:
    """Run the Python unit in the same way; with `times`, row k belongs to the step from times[k] to times[k + 1]."""
    unit = Unit(graph)
    inputs = [s for p in graph.ports if p.kind == "input" for s in p.scalar_names]
    outputs = [s for p in graph.ports if p.kind == "output" for s in p.scalar_names]
    unit.initialize(0.0, **({} if times else dict(zip(inputs, map(float, u[0]), strict=True))))
    y = [] if times else [[unit.get(s) for s in outputs]]
    for k in range(0 if times else 1, len(u)):
        for s, x in zip(inputs, u[k], strict=True):
            unit.set(s, float(x))
        unit.do_step(*((times[k], times[k + 1] - times[k]) if times else ((k - 1) * h, h)))
        y.append([unit.get(s) for s in outputs])
    return np.array(y)


NANOSECONDS = 1_000_000


def clock(n: int) -> list[float]:
    """Return the times of libcosim, which counts nanoseconds, so that step sizes differ by rounding."""
    return [k * NANOSECONDS / 1e9 for k in range(n + 1)]


def run_by_libcosim(graph: Graph, fmu: Path, u: Array) -> Array:
    """Return rows of outputs: row k after override u[k] and step k, without a row for the initialisation."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(NANOSECONDS)
    slave = execution.add_local_slave(CosimLocalSlave(fmu_path=str(fmu), instance_name="i"))
    override, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(override)
    execution.add_observer(observer)
    inputs = [p.reference + i for p in graph.ports if p.kind == "input" for i in range(p.size)]
    outputs = [p.reference + i for p in graph.ports if p.kind == "output" for i in range(p.size)]
    y = []
    for row in u:
        override.slave_real_values(slave, inputs, [float(x) for x in row])
        assert execution.step()
        y.append(list(observer.last_real_values(slave, outputs)))
    return np.array(y)


def run_in_container(fmu: Path, folder: Path, u: Array, h: float) -> Array:
    """Run a container of the FMU, made by fmu-manipulation-toolbox, as `run_by_fmpy` does."""
    folder.mkdir()
    shutil.copy(fmu, folder / "m.fmu")
    (folder / "box.json").write_text(json.dumps({"name": "box.fmu", "fmu": ["m.fmu"], "step_size": h}))
    start = "from fmu_manipulation_toolbox.cli.fmucontainer import fmucontainer; fmucontainer()"
    fmi = read_model_description(str(fmu), validate=False).fmiVersion[0]
    words = [sys.executable, "-c", start, "-container", "box.json", "-fmu-directory", ".", "-fmi", fmi]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=120)
    assert (folder / "box.fmu").exists(), done.stdout + done.stderr
    return run_by_fmpy(folder / "box.fmu", folder / "box", u, h)


def exchange_by_fmpy(path: Path, graph: Graph, u: Array, solver: str, h: float) -> Array:
    """Run Model Exchange by fmpy.simulate_fmu with a table of inputs and return rows of outputs."""
    names = [s for p in graph.ports if p.kind == "input" for s in p.scalar_names]
    assert all(p.size == 1 for p in graph.ports if p.kind in ("input", "output"))
    table = np.array([(k * h, *row) for k, row in enumerate(u)], dtype=[(n, "f8") for n in ("time", *names)])
    done = simulate_fmu(
        str(path), fmi_type="ModelExchange", solver=solver, stop_time=(len(u) - 1) * h, step_size=h, output_interval=h,
        input=table if names else None, output=[p.name for p in graph.ports if p.kind == "output"], record_events=False,
        relative_tolerance=1e-9,
    )  # fmt: skip
    return np.array([list(row)[1:] for row in done.tolist()])


# ---- Run an SSP archive by fmpy, libcosim and ecos: rows of the signals that its reference has
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


def by_libcosim(file: Path, names: list[str], h: float, n: int) -> Array:
    """Return the rows 1 to n of libcosim, which takes the step of an archive from its own annotation in it."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    if file.suffix == ".fmu":
        execution = CosimExecution.from_step_size(round(h * 1e9))
        execution.add_local_slave(CosimLocalSlave(fmu_path=str(file), instance_name="m"))
        names = [f"m.{name}" for name in names]
    else:
        folder = file.with_suffix(".unpacked")
        zipfile.ZipFile(file).extractall(folder)
        execution = CosimExecution.from_ssp_file(str(folder / "SystemStructure.ssd"))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    units = {s.name.decode(): s.index for s in execution.slave_infos()}
    places = []
    for name in names:
        unit, variable = name.split(".", 1)
        references = {v.name.decode(): v.reference for v in execution.slave_variables(units[unit])}
        places.append((units[unit], [references[variable]]))
    rows = []
    for _ in range(n):
        assert execution.step()
        rows.append([observer.last_real_values(*place)[0] for place in places])
    return np.array(rows)


class Failure(Exception):
    """What an importer said instead of a result."""


_ECOS = """
import ctypes, json, sys
from pathlib import Path
tbb = Path(sys.prefix, "lib", "libtbb.so.12")  # where the package `tbb` puts it, which no loader searches
if tbb.exists():
    ctypes.CDLL(str(tbb), mode=ctypes.RTLD_GLOBAL)
from ecospy import EcosSimulation, EcosSimulationStructure
file, inputs, outputs, h, rows = json.loads(sys.stdin.read())
given = {"ssp_path": file}
if file.endswith(".fmu"):
    given = {"structure": EcosSimulationStructure()}
    given["structure"].add_model("m", file)
with EcosSimulation(step_size=h, **given) as simulation:
    simulation.init()
    got = []
    for row in rows:
        for name, value in zip(inputs, row):
            simulation.set_real("m::" + name, value)
        simulation.step()
        got.append([simulation.get_real(name) for name in outputs] or [simulation.get_time()])
Path(sys.argv[1]).write_text(json.dumps(got))
"""


def in_ecos(file: Path, inputs: list[str], outputs: list[str], h: float, u: Array) -> Array:
    """Rows of outputs after each step, or of its clock; in a process of its own, because some FMUs crash ecos.

    Raises
    ------
    Failure
        It ended without rows.
    """
    out = Path(f"{file}.json")
    ends = [f"m::{n}" if file.suffix == ".fmu" else n.replace(".", "::") for n in outputs]
    task = json.dumps([str(file), inputs, ends, h, u.tolist()])
    words = [sys.executable, "-c", _ECOS, str(out)]
    done = subprocess.run(words, input=task, capture_output=True, text=True, timeout=120)
    if done.returncode or not out.exists():
        raise Failure("crashes" if done.returncode < 0 else done.stderr.strip().splitlines()[-1][:80])
    return np.array(json.loads(out.read_text()))


def by_ecos(file: Path, names: list[str], h: float, n: int) -> Array:
    """Return the rows 1 to n of ecos."""
    return in_ecos(file, [], names, h, np.zeros((n, 0)))


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
