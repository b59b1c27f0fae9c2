"""One small closed loop for the tests of this folder: plays -> G0 under a PID, written as a scenario file."""

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import tomli_w

Write = Callable[..., Path]


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of unpacked FMUs, empty for each test."""
    monkeypatch.setenv("HYSTFMU_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def loop() -> dict[str, Any]:
    """The scenario as a dictionary, to be changed."""
    return tomllib.loads(Path(__file__).with_name("loop.toml").read_text())


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Writes a dictionary as scenarios/<folder>/scenario.toml below tmp_path and returns the folder."""

    def writer(data: dict[str, Any], folder: str = "loop") -> Path:
        path = tmp_path / "scenarios" / folder
        path.mkdir(parents=True, exist_ok=True)
        (path / "scenario.toml").write_text(tomli_w.dumps(data))
        return path

    return writer
