"""FMUs with the explorer have at most 200 kB for this machine, 530 kB for all, whatever the kind of model."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import pytest

from hystfmu import Model
from hystfmu.fmu.write import platforms

SCENARIOS = Path(__file__).parents[3] / "scenarios"
LIMITS = {"host": 200_000, "all": 530_000}  # bytes
# one file per kind of model, the longest: the identified models, inverses and plants of the scenarios
MODELS = {Model.load(p).key: p for p in sorted(SCENARIOS.rglob("*.model.toml"), key=lambda p: p.stat().st_size)}


@pytest.mark.parametrize("which", ["host", "all"])
def test_every_fmu_is_small(which: Literal["host", "all"], fmi: int, tmp_path: Path) -> None:
    if which == "all" and (missing := platforms.missing()):
        pytest.skip(f"no binary is installed for {', '.join(missing)}: 'make platforms' builds them")
    assert {"actuator", "play_bank_mlp", "polynomial_narx", "prandtl_ishlinskii", "rate_mlp"} <= set(MODELS)
    sizes = {}
    for key, path in MODELS.items():
        made = Model.load(path).export(tmp_path / "m.fmu", fmi, platforms=which)  # type: ignore[arg-type]
        sizes[key] = made.stat().st_size
    print(f"FMI {fmi}, {which}: {min(sizes.values())} to {max(sizes.values())} bytes")
    assert {key: n for key, n in sizes.items() if n > LIMITS[which]} == {}
    assert min(sizes.values()) > 30_000  # each contains a binary
