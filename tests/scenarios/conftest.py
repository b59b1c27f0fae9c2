"""One small closed loop for the tests of this folder: plays -> G0 under a PID, written as a scenario file."""

import copy
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import tomli_w

OMEGA = 2 * math.pi * 500
PLANT = {
    "blocks": [
        {
            "name": "hysteresis",
            "type": "backlash_sum",
            "values": {"w0": 0.3, "r": [0.1, 0.2, 0.3], "w": [0.3, 0.2, 0.1]},
        },
        {
            "name": "g0",
            "type": "transfer_function",
            "dims": {"na": 2, "nb": 0},
            "values": {"b": [OMEGA**2], "a": [1.0, 1.4 * OMEGA, OMEGA**2]},
        },
    ],
    "wires": [["hysteresis.y", "g0.u"]],
    "inputs": [{"name": "u", "to": ["hysteresis.u"]}],
    "outputs": [{"name": "y", "source": "g0.y"}, {"name": "v", "source": "hysteresis.y"}],
}
LOOP: dict[str, Any] = {
    "name": "loop",
    "step": 1e-4,
    "stop": 0.03,
    "order": ["plant", "reference", "pid"],
    "units": {
        "plant": {"graph": PLANT},
        "reference": {"block": "reference", "values": {"shape": "sine", "amplitude": 1.0, "frequency": 50.0}},
        "pid": {"block": "pid", "values": {"Kp": 1.0, "Ki": 2000.0, "Kd": 2e-4}, "inputs": {"u_ff": 0.125}},
    },
    "connections": {"plant.u": "pid.u", "pid.y_d": "reference.r", "pid.y": "plant.y"},
    "record": ["reference.r", "plant.y"],
    "loops": [["pid.u", "plant.y"]],
    "metrics": {
        "tracking": {
            "kind": "rms_percent",
            "signal": "plant.y",
            "against": "reference.r",
            "stroke": 2.0,
            "after": 0.01,
            "limit": 50.0,
        }
    },
}

Write = Callable[..., Path]


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of unpacked FMUs, empty for each test."""
    monkeypatch.setenv("HYSTFMU_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def loop() -> dict[str, Any]:
    """A copy of the scenario as a dictionary, to be changed."""
    return copy.deepcopy(LOOP)


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Writes a dictionary as scenarios/<folder>/scenario.toml below tmp_path and returns the folder."""

    def writer(data: dict[str, Any], folder: str = "loop") -> Path:
        path = tmp_path / "scenarios" / folder
        path.mkdir(parents=True, exist_ok=True)
        (path / "scenario.toml").write_text(tomli_w.dumps(data))
        return path

    return writer
