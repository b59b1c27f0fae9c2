"""What the description of a fitted model says of its ports: range, size, text, units of measure, step."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest

import hystfmu as hy
from hystfmu import Dataset, Model
from hystfmu.fmu import export_fmu
from hystfmu.fmu.write.measures import base_unit
from hystfmu.identify import fit

# unit of measure: exponents of kg, m, s, A, K, rad; factor; offset (BIPM, The International System of Units, 9th ed.)
UNITS: dict[str, tuple[tuple[int, ...], float, float]] = {
    "um": ((0, 1, 0, 0, 0, 0), 1e-6, 0.0),
    "ms": ((0, 0, 1, 0, 0, 0), 1e-3, 0.0),
    "h": ((0, 0, 1, 0, 0, 0), 3600.0, 0.0),
    "kV": ((1, 2, -3, -1, 0, 0), 1e3, 0.0),
    "kV/mm": ((1, 1, -3, -1, 0, 0), 1e6, 0.0),
    "um/V": ((-1, -1, 3, 1, 0, 0), 1e-6, 0.0),
    "N.s/m2": ((1, -1, -1, 0, 0, 0), 1.0, 0.0),
    "MPa": ((1, -1, -2, 0, 0, 0), 1e6, 0.0),
    "mN": ((1, 1, -2, 0, 0, 0), 1e-3, 0.0),
    "Oe": ((0, -1, 0, 1, 0, 0), 1e3 / (4 * np.pi), 0.0),
    "degC": ((0, 0, 0, 0, 1, 0), 1.0, 273.15),
    "degC/min": ((0, 0, -1, 0, 1, 0), 1 / 60, 0.0),
    "deg": ((0, 0, 0, 0, 0, 1), np.pi / 180, 0.0),
    "%": ((0, 0, 0, 0, 0, 0), 0.01, 0.0),
    "kg": ((1, 0, 0, 0, 0, 0), 1.0, 0.0),
}


@pytest.mark.parametrize("name", UNITS)
def test_base_units(name: str) -> None:
    exponents, factor, offset = UNITS[name]
    got = base_unit(name)
    assert got is not None
    assert tuple(int(got.get(k, 0)) for k in ("kg", "m", "s", "A", "K", "rad")) == exponents
    assert float(got.get("factor", 1.0)) == pytest.approx(factor, rel=1e-15)
    assert float(got.get("offset", 0.0)) == offset


@pytest.mark.parametrize("name", ["furlong", "V/", "", "kdeg", "mmin", "m0", "V//A", "1e3", "u"])
def test_what_is_no_unit_of_measure_has_no_base_unit(name: str) -> None:
    assert base_unit(name) is None


@pytest.fixture(scope="module")
def model() -> Model:
    """A play between 20 V and 90 V, fitted to a record with a step of one millisecond."""
    t = np.arange(800) * 1e-3
    u = 55 + 35 * np.sin(2 * np.pi * 5 * t) * np.exp(-2 * t)
    y, z = np.empty_like(u), u[0]
    for k, v in enumerate(u):
        z = max(v - 8, min(v + 8, z))
        y[k] = 0.3 * v + 0.1 * z
    data = Dataset(t, u, y, name="stack 7", unit_u="V", unit_y="um")
    return fit(data, "prandtl_ishlinskii", seed=1, N=8)


def ports(model: Model, path: Path, fmi: int) -> dict[str, Any]:
    description = fmpy.read_model_description(str(export_fmu(model, path, fmi)))  # type: ignore[arg-type]
    return {v.name: v for v in description.modelVariables} | {"experiment": description.defaultExperiment}


def test_ranges_sizes_and_texts(model: Model, tmp_path: Path, fmi: int) -> None:
    lo, hi = model.provenance["trained_u"]
    found = ports(model, tmp_path / "m.fmu", fmi)
    u, y = found["u"], found["y"]
    assert (float(u.min), float(u.max)) == (min(lo, float(u.start)), hi)
    assert float(u.nominal) == pytest.approx(hi, rel=0.05)
    assert float(y.nominal) == pytest.approx(0.4 * hi, rel=0.1)  # the play follows its input
    assert (y.min, y.max) == (None, None)  # a model may leave the range on its way
    assert (u.description, y.description) == (
        "input of the record stack 7, in V",
        "output of the record stack 7, in um",
    )
    assert (u.unit, y.unit) == ("V", "um")
    threshold, weight = (next(v for n, v in found.items() if n.startswith(f"hysteresis_{k}")) for k in "rw")
    assert (threshold.unit, weight.unit) == ("V", "1")
    assert hy.validate(tmp_path / "m.fmu") == []


def test_the_step_has_no_dust(model: Model, tmp_path: Path, fmi: int) -> None:
    dusty = Model(model.key, model.graph, 0.0010000000000000009, model.text, model.fit, model.provenance)
    experiment = ports(dusty, tmp_path / "m.fmu", fmi)["experiment"]
    assert (experiment.stepSize, experiment.stopTime) == ("0.001", "1.0")
    other = Model(model.key, model.graph, 1 / 3, model.text, model.fit, model.provenance)
    assert float(ports(other, tmp_path / "n.fmu", fmi)["experiment"].stepSize) == 1 / 3


def test_a_model_that_states_no_range_has_none(model: Model, tmp_path: Path) -> None:
    bare = Model(model.key, model.graph, model.step, model.text)
    u = ports(bare, tmp_path / "m.fmu", 2)["u"]
    assert (u.min, u.max) == (None, None)
