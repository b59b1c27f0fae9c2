"""Run a graph by fmpy, libcosim, a container FMU and the Python unit, which must agree to the last bit."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
from fmpy import read_model_description, simulate_fmu
from fmu_master import Array
from fmu_slave import Slave

from hystfmu.graph import Graph
from hystfmu.unit import Unit


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
        str(path),
        fmi_type="ModelExchange",
        solver=solver,
        stop_time=(len(u) - 1) * h,
        step_size=h,
        output_interval=h,
        input=table if names else None,
        output=[p.name for p in graph.ports if p.kind == "output"],
        record_events=False,
        relative_tolerance=1e-9,
    )
    return np.array([list(row)[1:] for row in done.tolist()])
