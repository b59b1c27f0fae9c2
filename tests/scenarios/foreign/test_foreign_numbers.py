"""What a foreign FMU hands on: numbers that a unit of ours cannot take, and the status of reading them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from bad_fmu import bad_fmu
from engines import ready

from hystfmu.scenario.engine.simulation import ENGINES, chunks_here
from hystfmu.scenario.outcome.trace import Stopped, Trace

H = 1e-3


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HYSTFMU_CACHE", str(tmp_path / "cache"))


def run(write: Any, engine: Any, defect: str) -> Trace:
    """Ten steps of a foreign FMU before a unit of ours, in this process; the defect shows from 5 ms on."""
    folder = write(
        {
            "name": "numbers",
            "step": H,
            "stop": 10 * H,
            "order": ["source", "bad", "sum"],
            "units": {
                "source": {"block": "reference", "values": {"shape": "steps", "T": 1.0, "levels": [1.0]}},
                "bad": {"fmu": "bad.fmu"},
                "sum": {"block": "sum", "dims": {"n": 1}, "values": {"k": [1.0]}},
            },
            "connections": {"bad.u": "source.r", "sum.u": "bad.y"},
            "metrics": {"p": {"kind": "peak", "signal": "sum.y"}},
        }
    )
    bad_fmu(folder / "bad.fmu", defect, 0.5, "#include <math.h>")
    system = ready(folder)
    return Trace.joined(chunks_here(system, engine), system.n_steps + 1)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("number", ["HUGE_VAL", "-HUGE_VAL", "NAN"])
def test_a_number_that_is_not_finite_stops_before_our_unit(write: Any, engine: str, number: str) -> None:
    with pytest.raises(Stopped, match=r"sum refuses the step .*"):
        run(write, engine, f"{{ y = {number}; return fmi2OK; }}")


@pytest.mark.parametrize("engine", ENGINES)
def test_the_status_of_reading(write: Any, engine: str) -> None:
    """A warning is no failure, all else stops the run."""
    assert run(write, engine, "got = fmi2Warning")["sum.y"][-1] == 1
    for status in ("fmi2Discard", "fmi2Error"):
        with pytest.raises(Stopped, match="bad"):
            run(write, engine, f"got = {status}")
