"""A small study of a first-order system whose response is known in closed form."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from decay import LAG

pytest.importorskip("pyarrow")

Write = Callable[..., Path]
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
        (folder / "scenario.toml").write_text(tomli_w.dumps({**LAG, **changes.pop("of_scenario", {})}))
        path = tmp_path / "studies" / "study.toml"
        path.parent.mkdir(exist_ok=True)
        path.write_text(tomli_w.dumps({**STUDY, **changes}))
        return path

    return writer
