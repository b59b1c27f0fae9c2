"""One truth: the FMU run by fmpy, the Python unit and the graph executor give the same bits, for every block."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu
from fmu_master import BLOCKS, Array, H, loop, rows, single, unpack

from hystfmu.fmu import export_fmu
from hystfmu.graph import Graph
from hystfmu.unit import Unit

GRAPHS = [*BLOCKS, "loop"]


def graph_of(name: str) -> Graph:
    return loop() if name == "loop" else single(name)


def run_by_fmpy(fmu: Path, folder: Path, fmi: int, u: Array) -> Array:
    """Rows of outputs: row 0 after the initialisation with u[0], row k after set u[k], doStep((k - 1) h, h)."""
    unpack(fmu, folder)
    description = read_model_description(str(folder))
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
        slave.doStep((k - 1) * H, H)
        y.append(values())
    slave.terminate()
    slave.freeInstance()
    return np.array(y)


def run_by_unit(graph: Graph, u: Array) -> Array:
    unit = Unit(graph)
    inputs = [s for p in graph.ports if p.kind == "input" for s in p.scalar_names]
    outputs = [s for p in graph.ports if p.kind == "output" for s in p.scalar_names]
    unit.initialize(0.0, **dict(zip(inputs, map(float, u[0]), strict=True)))
    y = [[unit.get(s) for s in outputs]]
    for k in range(1, len(u)):
        for s, x in zip(inputs, u[k], strict=True):
            unit.set(s, float(x))
        unit.do_step((k - 1) * H, H)
        y.append([unit.get(s) for s in outputs])
    return np.array(y)


@pytest.mark.parametrize("name", GRAPHS)
def test_same_bits_and_valid(name: str, tmp_path: Path) -> None:
    graph = graph_of(name)
    u = rows(graph)
    want = graph.executor().run(u, graph.n_outputs, H)
    assert np.isfinite(want).all()
    assert np.ptp(want, axis=0).max() > 1e-3, "the run must move"
    assert run_by_unit(graph, u).tobytes() == want.tobytes()
    for fmi in (2, 3):
        fmu = export_fmu(graph, tmp_path / f"{name}{fmi}.fmu", fmi)  # type: ignore[arg-type]
        assert validate_fmu(str(fmu)) == []
        assert run_by_fmpy(fmu, tmp_path / f"{fmi}", fmi, u).tobytes() == want.tobytes()
