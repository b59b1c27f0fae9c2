"""The FMU in fmpy, the Python unit and the graph executor give the same bits, for every block."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fmpy.validation import validate_fmu
from fmu_master import BLOCKS, H, loop, rows, single
from runners import run_by_fmpy, run_by_unit

from hystfmu.fmu import export_fmu
from hystfmu.graph import Graph

GRAPHS = [*BLOCKS, "loop"]


def graph_of(name: str) -> Graph:
    return loop() if name == "loop" else single(name)


@pytest.mark.parametrize("name", GRAPHS)
def test_same_bits_and_valid(name: str, tmp_path: Path) -> None:
    graph = graph_of(name)
    u = rows(graph)
    want = graph.executor().run(u, graph.n_outputs, H)
    assert np.isfinite(want).all()
    assert np.ptp(want, axis=0).max() > 1e-3, "the outputs must vary"
    assert run_by_unit(graph, u, H).tobytes() == want.tobytes()
    for fmi in (2, 3):
        fmu = export_fmu(graph, tmp_path / f"{name}{fmi}.fmu", fmi)  # type: ignore[arg-type]
        assert validate_fmu(str(fmu)) == []
        assert run_by_fmpy(fmu, tmp_path / f"{fmi}", u, H).tobytes() == want.tobytes()
