"""Run a scenario by every engine, and a container; their results must have the same bits."""

from pathlib import Path

import numpy as np
import python_master
from fmu_slave import Slave

from hystfmu.base.arrays import Array
from hystfmu.scenario import Cases, build, simulate
from hystfmu.scenario.engine.simulation import ENGINES
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.system.system import System


def ready(folder: Path) -> System:
    """Return the first case of the scenario in a folder, ready to run."""
    return build(Cases(folder).cases[0])


def same(*systems: System) -> Trace:
    """Run the systems by every engine and by a master in Python; return one trace.

    All have the same bits and the same number of sweeps.
    """
    traces = [simulate(system, engine) for system in systems for engine in ENGINES]
    traces += [python_master.run(system) for system in systems if not system.foreign]
    assert len({t.values.tobytes() for t in traces}) == 1
    assert len({(t.sweeps.all, t.sweeps.most) for t in traces}) == 1
    return traces[0]


def boxed(fmu: Path, folder: Path, h: float, n: int) -> dict[str, Array]:
    """Rows 0 to n of all outputs of a container by their ends (`unit.output`); steps of h at t = k h."""
    slave = Slave(fmu, folder)
    slave.start()
    read = [(getattr(slave.fmu, f"get{v.type}"), v.valueReference) for v in slave.variables.values()]
    rows = []
    for k in range(n + 1):
        if k:
            slave.fmu.doStep((k - 1) * h, h)
        rows.append([float(get([reference])[0]) for get, reference in read])
    slave.free()
    return {v.description: x for v, x in zip(slave.variables.values(), np.array(rows).T, strict=True)}
