"""Check of a device by a new record: which part moved, from changes that are made on purpose."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import plants
import pytest
from click.testing import CliRunner

import hystfmu as hy
from hystfmu.base.arrays import Array
from hystfmu.cli import main
from hystfmu.data.signals import nested_reversals, training

H = 1e-3
NOISE = 2e-3


def noisy(y: Array, seed: int) -> Array:
    return y + NOISE * np.ptp(y) * np.random.default_rng(seed).normal(size=len(y))


def new(change: str = "") -> hy.Dataset:
    u = 0.9 * nested_reversals(30, 8, 0.02)
    y = plants.prandtl_ishlinskii(u)
    if change == "lag":
        y = np.concatenate([np.full(4, y[0]), y[:-4]])
    elif change == "loop":
        y = 2 * y - 1.5 * u
    y = noisy(y, 4)
    return hy.Dataset.from_signal(u, y * (1.1 if change == "gain" else 1) + 0.2 * (change == "offset"), H, "new")


@pytest.fixture(scope="module")
def model() -> hy.Model:
    u = training(30, 1, 0.02)
    data = hy.Dataset.from_signal(u, noisy(plants.prandtl_ishlinskii(u), 1), H, "first").with_train(":900")
    return hy.fit(data, "prandtl_ishlinskii", N=20)


def test_the_same_device_has_not_drifted(model: hy.Model) -> None:
    found = model.check(new())
    assert (found.drifted, found.moved, found.of) == (False, "", "held-out")
    assert found.rms == pytest.approx(model.score(new())["rms"], rel=1e-12)
    assert found.stated == model.fit["held_out_rms"]
    assert found.inside == 100
    lo, hi = model.provenance["trained_u"]
    assert found.reached == pytest.approx(100 * np.ptp(new().u) / (hi - lo))


@pytest.mark.parametrize(
    ("change", "value", "off"), [("offset", 0.2, 0.01), ("gain", 1.1, 0.005), ("lag", 4, 0), ("loop", 11, 0)]
)
def test_the_part_that_moved_is_named(model: hy.Model, change: str, value: float, off: float) -> None:
    found = model.check(new(change))
    assert found.drifted
    assert found.moved == change
    part = next(p for p in found.parts if p.name == change)
    assert float(part.value.split()[0]) == pytest.approx(value, abs=off)
    assert part.left <= 3 * NOISE * np.ptp(new(change).y)


def test_rows_outside_the_trained_range_do_not_count(model: hy.Model) -> None:
    u = np.concatenate([new().u, [1.5, 3.0, 1.0]])
    y = np.concatenate([new().y, [50.0, 60.0, 70.0]])
    found = model.check(hy.Dataset.from_signal(u, y, H, "further"))
    assert found.inside == pytest.approx(100 * (len(u) - 2) / len(u))
    with pytest.raises(hy.InputError, match="far: At least 52 rows must have an input within the trained range"):
        model.check(hy.Dataset.from_signal(np.linspace(2, 3, 100), np.linspace(2, 3, 100), H, "far"))


def test_the_command_tells_it_by_its_status(model: hy.Model, tmp_path: Path) -> None:
    model.save(tmp_path / "m.model.toml")
    for change, status in (("", 0), ("gain", 1)):
        new(change).to_csv(tmp_path / "new.csv")
        done = CliRunner().invoke(main, ["check", str(tmp_path / "m.model.toml"), str(tmp_path / "new.csv")])
        assert done.exit_code == status, done.output
        assert ("no drift" if status == 0 else "the gain moved most") in done.output
    done = CliRunner().invoke(main, ["check", str(tmp_path / "m.model.toml"), str(tmp_path / "new.csv"), "--json"])
    assert json.loads(done.output.splitlines()[-1])["moved"] == "gain"
    done = CliRunner().invoke(
        main, ["check", str(tmp_path / "m.model.toml"), str(tmp_path / "new.csv"), "--factor", "1"]
    )
    assert done.exit_code == 2
    assert "factor of a check must be greater than 1" in done.output


def test_a_model_without_a_stated_error_is_refused() -> None:
    with pytest.raises(hy.InputError, match=r"must state its RMS error, fit\.rms > 0\. Got None of creep"):
        hy.Model.of_block(hy.blocks.Creep()).check(new())
