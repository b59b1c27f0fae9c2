"""libcosim (an independent FMI 2.0 master in C++) gives the same outputs as the Python unit, bit for bit.

Its fixed-step algorithm calls setReal, doStep(t_k, t_{k+1} - t_k), getReal with t_k = k n / 1e9, n nanoseconds a step;
the length of a step differs by rounding from one to the next.  The comparison steps the unit with the same numbers.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fmu_master import loop, rows, single
from runners import clock, run_by_libcosim, run_by_unit

from hystfmu.fmu import export_fmu

pytest.importorskip("libcosimpy.CosimExecution")


@pytest.mark.parametrize(
    "name", ["prandtl_ishlinskii", "adaptive_inverse", "bouc_wen", "transfer_function", "mlp", "loop"]
)
def test_same_bits(name: str, tmp_path: Path) -> None:
    graph = loop() if name == "loop" else single(name)
    u = rows(graph, 200)
    got = run_by_libcosim(graph, export_fmu(graph, tmp_path / "m.fmu", 2), u)
    want = run_by_unit(graph, u, times=clock(len(u)))
    assert np.ptp(want, axis=0).max() > 1e-3
    assert got.tobytes() == want.tobytes()
