"""Model Exchange under CVode, in fmpy: every fitted kind ends, at every tolerance.

fmpy sets inputs at accepted steps only: for its solver they jump.  What is left is the delay of that importer, which is
at most one step: the response of the model to the input one row late is the measure.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu
from test_keys import H, fitted_model, signal_for

from hystfmu import Model
from hystfmu.fmu import export_fmu
from hystfmu.identify import METHODS

ROWS, TOLERANCES = 150, (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
DYNAMIC = ("actuator", "bouc_wen_oscillator", "g0_bouc_wen", "g0_prandtl_ishlinskii")


def ends(model: Model, fmi: int, tolerance: float, folder: Path) -> None:
    u = signal_for(model)[:ROWS]
    t = np.arange(ROWS) * H
    y, late = model.predict(u), model.predict(np.concatenate([u[:1], u[:-1]]))
    result = simulate_fmu(
        str(export_fmu(model, folder / "m.fmu", fmi)),  # type: ignore[arg-type]
        fmi_type="ModelExchange",
        solver="CVode",
        input=np.array(list(zip(t, u, strict=True)), dtype=[("time", "f8"), ("u", "f8")]),
        output_interval=H,
        stop_time=t[-1],
        relative_tolerance=tolerance,
        record_events=False,
        output=["y"],
    )
    assert np.abs(result["time"] - t).max() < 1e-12
    error = np.abs(result["y"] - y).max()
    if model.graph.continuous_states:
        assert error <= 1.05 * np.abs(late - y).max()
    else:
        assert error == 0.0


@pytest.mark.parametrize("tolerance", [1e-4, 1e-9])
@pytest.mark.parametrize("key", DYNAMIC)
def test_kinds_with_dynamics_end(key: str, tolerance: float, fitted: dict[str, Model], tmp_path: Path) -> None:
    ends(fitted_model(key, fitted), 2, tolerance, tmp_path)


@pytest.mark.stress
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("key", list(METHODS))
def test_every_kind_ends(key: str, fmi: int, fitted: dict[str, Model], tmp_path: Path) -> None:
    for tolerance in TOLERANCES:
        ends(fitted_model(key, fitted), fmi, tolerance, tmp_path)
