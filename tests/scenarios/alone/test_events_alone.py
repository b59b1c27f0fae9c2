"""Times of the events of every source, where steps are cut, and what is said about events that no step ends on."""

from __future__ import annotations

from typing import Any

import pytest
from engines import ready

from hystfmu.base.errors import InputError
from hystfmu.scenario.system import events as module
from hystfmu.scenario.system.events import cuts
from hystfmu.scenario.system.system import System

H = 2.0**-6  # exact in binary


def system(
    write: Any, source: dict[str, Any], *, read: tuple[str, ...] = ("r",), stop: float = 1.0, **more: Any
) -> System:
    """A source and a lag that reads outputs of it, located."""
    n = len(read)
    lag = {"block": "sum", "dims": {"n": n}, "values": {"k": [1.0] * n}}
    ends = [f"lag.u_{k + 1}" for k in range(n)] if n > 1 else ["lag.u"]
    data = {
        "name": "events",
        "step": H,
        "stop": stop,
        "coupling": {"scheme": "gauss_seidel", **more.pop("coupling", {})},
        "order": ["source", "lag"],
        "units": {"source": source, "lag": lag},
        "connections": {end: f"source.{output}" for end, output in zip(ends, read, strict=True)},
        "metrics": {"peak": {"kind": "peak", "signal": "lag.y"}},
    }
    return ready(write(data | more))


def reference(**values: Any) -> dict[str, Any]:
    dims = {"dims": {"m": values.pop("m")}} if "m" in values else {}
    return {"block": "reference", **dims, "values": values}


def step(at: float, height: float = 1.0) -> dict[str, Any]:
    return {"block": "disturbance", "values": {"step": height, "t_step": at, "amplitude": 0.0}}


def test_as_many_reversals_as_steps_may_be(write: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_STEPS", 80)  # 64 fine steps and 16 cuts
    for f, good in [(8.0, True), (8.5, False)]:
        s = system(write, reference(shape="triangle", frequency=f, phase=0.3))
        if good:
            assert len(cuts(s)[1]) == 16
        else:
            with pytest.raises(InputError, match=r"more than 80 "):
                cuts(s)
    monkeypatch.setattr(module, "MOST_STEPS", 32)
    with pytest.raises(InputError, match=r"case nominal: more than 32 fine steps and events$"):
        cuts(system(write, reference(shape="triangle", frequency=8.0, phase=0.3)))
    monkeypatch.setattr(module, "MOST_STEPS", 31)
    with pytest.raises(InputError, match=r"source\.frequency: more than 31 reversals; got 16 Hz$"):
        cuts(system(write, reference(shape="triangle", frequency=16.0, phase=0.3)))
