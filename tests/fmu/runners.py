"""The ways to run a graph that must agree to the last bit: an FMU by fmpy, and the Python unit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmu_master import Array, unpack

from hystfmu.graph import Graph
from hystfmu.unit import Unit


def run_by_fmpy(fmu: Path, folder: Path, u: Array, h: float) -> Array:
    """Rows of outputs: row 0 after the initialisation with u[0], row k after set u[k], doStep((k - 1) h, h)."""
    unpack(fmu, folder)
    description = read_model_description(str(folder))
    fmi = int(description.fmiVersion[0])
    kind = FMU2Slave if fmi == 2 else FMU3Slave
    slave = kind(
        guid=description.guid,
        unzipDirectory=str(folder),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="i",
    )
    slave.instantiate()
    get, set_ = (slave.getReal, slave.setReal) if fmi == 2 else (slave.getFloat64, slave.setFloat64)
    size = {v.name: int(np.prod(v.shape)) if v.shape else 1 for v in description.modelVariables}
    inputs = [v for v in description.modelVariables if v.causality == "input"]
    outputs = [v for v in description.modelVariables if v.causality == "output"]

    def values() -> list[float]:
        return [
            x for v in outputs for x in (get([v.valueReference]) if fmi == 2 else get([v.valueReference], size[v.name]))
        ]

    def write(row: Array) -> None:
        at = 0
        for v in inputs:
            set_([v.valueReference], [float(x) for x in row[at : at + size[v.name]]])
            at += size[v.name]

    if fmi == 2:
        slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    write(u[0])
    slave.exitInitializationMode()
    y = [values()]
    for k in range(1, len(u)):
        write(u[k])
        slave.doStep((k - 1) * h, h)
        y.append(values())
    slave.terminate()
    slave.freeInstance()
    return np.array(y)


def run_by_unit(graph: Graph, u: Array, h: float) -> Array:
    unit = Unit(graph)
    inputs = [s for p in graph.ports if p.kind == "input" for s in p.scalar_names]
    outputs = [s for p in graph.ports if p.kind == "output" for s in p.scalar_names]
    unit.initialize(0.0, **dict(zip(inputs, map(float, u[0]), strict=True)))
    y = [[unit.get(s) for s in outputs]]
    for k in range(1, len(u)):
        for s, x in zip(inputs, u[k], strict=True):
            unit.set(s, float(x))
        unit.do_step((k - 1) * h, h)
        y.append([unit.get(s) for s in outputs])
    return np.array(y)
