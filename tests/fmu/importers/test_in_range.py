"""Output `in_range`: whether the input lies within the range of the training rows, in Python, units and FMUs alike."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import plants
import pytest
from click.testing import CliRunner
from runners import run_by_fmpy, run_by_unit

import hystfmu as hy
from hystfmu.cli import main
from hystfmu.data import signals
from hystfmu.model.coverage import trained_range

H = 1e-3


@pytest.fixture(scope="module")
def model() -> hy.Model:
    """Fitted to the rows with |u| <= 0.5; others of the record reach 1."""
    u = np.concatenate([0.5 * signals.training(12, 1, 0.05), signals.training(12, 2, 0.05)])
    first = len(signals.training(12, 1, 0.05))
    data = hy.Dataset.from_signal(u, plants.prandtl_ishlinskii(u), H, "plays").with_train((0, first))
    return hy.fit(data, "prandtl_ishlinskii", N=10, w0_min=0.1)


def test_the_range_is_that_of_the_training_rows(model: hy.Model) -> None:
    assert model.provenance["trained_u"] == [-0.5, 0.5]
    assert model.provenance["span_u"] == [-1.0, 1.0]
    u = np.array([0.0, 0.5, 0.5 + 1e-12, 0.9, -0.5, -0.500001, 0.1])
    y = model.with_in_range().predict(u)
    assert y[:, 1].tolist() == [1, 1, 0, 0, 1, 0, 1]
    assert y[:, 0].tobytes() == model.predict(u).tobytes()


@pytest.mark.parametrize("fmi", [2, 3])
def test_fmus_of_the_command_have_the_output(model: hy.Model, fmi: int, tmp_path: Path) -> None:
    file, fmu = tmp_path / "m.model.toml", tmp_path / "m.fmu"
    model.save(file)
    done = CliRunner().invoke(main, ["export", str(file), "--in-range", "--fmi", str(fmi), "-o", str(fmu)])
    assert done.exit_code == 0, done.output
    u = signals.nested_reversals(4, 5, step=0.02)
    y = model.with_in_range().predict(u)
    assert 0 < np.mean(y[:, 1]) < 1
    assert run_by_fmpy(fmu, tmp_path / "run", u[:, None], H).tobytes() == y.tobytes()
    assert run_by_unit(model.with_in_range().graph, u[:, None], H).tobytes() == y.tobytes()


@pytest.mark.parametrize("method", ["exact", "implicit"])
def test_an_inverse_tells_it_of_the_command(model: hy.Model, method: str) -> None:
    """An implicit inverse stops at the end of its range, which is outside."""
    options = {"lo": -0.5, "hi": 0.5} if method == "implicit" else {}
    made = model.inverse(method, **options).with_in_range()
    least, most = model.predict([0.0, -0.5, 0.5])[1:]
    told = made.predict([0.0, 0.99 * least, 0.99 * most, most + 1, 0.0])
    assert told[:, 1].tolist() == [1, 1, 1, 0, 1]
    assert np.abs(told[[0, 1, 2, 4], 0]).max() < 0.5


def test_covariates_count_too() -> None:
    u = signals.training(8, 1, 0.05)
    load = np.linspace(2.0, 3.0, len(u))
    data = hy.Dataset(H * np.arange(len(u)), u, u + load, covariates={"load [N]": load})
    total = hy.Node("total", "sum", {"n": 2})
    inputs = [hy.Input("u", ("total.u[1]",)), hy.Input("load", ("total.u[2]",))]
    graph = hy.Graph([total], [], inputs, [hy.Output("y", "total.y")])
    made = hy.Model("loaded", graph, H, provenance=trained_range(data)).with_in_range()
    rows = np.array([[0.0, 2.5], [0.5, 3.1], [0.5, 2.0], [1.1, 2.5]])
    assert made.predict(rows)[:, 1].tolist() == [1, 0, 1, 0]


def test_a_model_that_does_not_know_its_range_says_so(model: hy.Model) -> None:
    with pytest.raises(hy.InputError, match=r"must state trained_u = \[least, largest\]"):
        hy.Model.of_block(hy.blocks.Creep()).with_in_range()
    with pytest.raises(hy.InputError, match="must have no output 'in_range' yet"):
        model.with_in_range().with_in_range()
