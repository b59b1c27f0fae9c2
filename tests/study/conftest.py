"""A small study of a first-order system whose response is known in closed form."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import tomli_w

pytest.importorskip("pyarrow")

Write = Callable[..., Path]
SCENARIO: dict[str, Any] = {
    "name": "decay",
    "step": 1e-2,
    "stop": 1.0,
    "order": ["lag", "command"],
    "units": {
        "lag": {
            "block": "transfer_function",
            "dims": {"na": 1, "nb": 0},
            "values": {"b": [1.0], "a": [0.5, 1.0], "hold": "zoh"},
        },
        "command": {"block": "disturbance", "values": {"step": 2.0, "amplitude": 0.0}},
    },
    "connections": {"lag.u": "command.d"},
    "metrics": {"last": {"kind": "final", "signal": "lag.y"}, "peak": {"kind": "peak", "signal": "command.d"}},
    "case": [{"name": "one"}, {"name": "half", "stop": 0.5}],
}
STUDY: dict[str, Any] = {
    "name": "decay",
    "scenario": "../scenarios/decay",
    "method": "grid",
    "parameters": {
        "command.step": {"range": [1.0, 4.0], "steps": 4},
        "lag.b": {"scale": [0.5, 2.0], "steps": 3, "log": True},
    },
}


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write the scenario and the study with changes; return the path of the study."""

    def writer(**changes: Any) -> Path:
        folder = tmp_path / "scenarios" / "decay"
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "scenario.toml").write_text(tomli_w.dumps({**SCENARIO, **changes.pop("of_scenario", {})}))
        path = tmp_path / "studies" / "study.toml"
        path.parent.mkdir(exist_ok=True)
        path.write_text(tomli_w.dumps({**STUDY, **changes}))
        return path

    return writer
