"""libcosim (an independent FMI 2.0 master in C++) gives the same outputs as the Python unit, bit for bit.

Its fixed-step algorithm calls setReal, doStep(t_k, t_{k+1} - t_k), getReal with t_k = k n / 1e9, n nanoseconds a step;
the length of a step differs by rounding from one to the next.  The comparison steps the unit with the same numbers.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fmu_master import loop, rows, single

from hystfmu.fmu import export_fmu
from hystfmu.graph import Graph
from hystfmu.unit import Unit

cosim = pytest.importorskip("libcosimpy.CosimExecution")
NANOSECONDS = 1_000_000


def _by_libcosim(graph: Graph, fmu: Path, u: np.ndarray) -> np.ndarray:
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = cosim.CosimExecution.from_step_size(NANOSECONDS)
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


def _by_unit(graph: Graph, u: np.ndarray) -> np.ndarray:
    unit = Unit(graph)
    inputs = [s for p in graph.ports if p.kind == "input" for s in p.scalar_names]
    outputs = [s for p in graph.ports if p.kind == "output" for s in p.scalar_names]
    unit.initialize(0.0)
    y = []
    for k, row in enumerate(u):
        for s, x in zip(inputs, row, strict=True):
            unit.set(s, float(x))
        t, t_end = k * NANOSECONDS / 1e9, (k + 1) * NANOSECONDS / 1e9
        unit.do_step(t, t_end - t)
        y.append([unit.get(s) for s in outputs])
    return np.array(y)


@pytest.mark.parametrize("name", ["prandtl_ishlinskii", "bouc_wen", "transfer_function", "mlp", "loop"])
def test_same_bits(name: str, tmp_path: Path) -> None:
    graph = loop() if name == "loop" else single(name)
    u = rows(graph, 200)
    got = _by_libcosim(graph, export_fmu(graph, tmp_path / "m.fmu", 2), u)
    want = _by_unit(graph, u)
    assert np.ptp(want, axis=0).max() > 1e-3
    assert got.tobytes() == want.tobytes()
