"""Kinds of model with covariates: error on held-out signals with and without them; file, FMU, Modelica, refusals."""

import json
import re
import xml.etree.ElementTree as ET
import zipfile

import exported
import numpy as np
import plants
import pytest
from click.testing import CliRunner
from invoked import invoked

from hystfmu import Dataset, InputError, Model, fit, validate
from hystfmu.cli import main
from hystfmu.data.signals import training
from hystfmu.identify import METHODS, auto
from hystfmu.identify.catalogue import candidates, method

H = 1e-3
KINDS = [key for key in METHODS if key != "auto" and method(key).covariates]
QUICK = {"starts": 1, "iterations": 40}
SMALL = {"polynomial_narx": {"n_u": 2, "n_f": 2, "q": 3}, "play_bank_mlp": {"N": 16}}  # for the rows of a record
CHEAP = "constraint_factor_mlp"
REACHED = {  # % of the span on another signal, after a quick fit
    "actuator": 0.3,
    "constraint_factor_mlp": 0.5,
    "fitted_operator_mlp": 1.0,
    "play_bank_mlp": 0.5,
    "polynomial_narx": 1.0,
    "rate_mlp": 0.5,
    "zhao_tan_mlp": 1.5,
}


def record(seed, reversals=60, speed=0.05):
    """Random reversals, while temperature and load wander."""
    u = training(reversals, seed, speed)
    rng, n = np.random.default_rng(seed), len(u)
    T, load = (np.interp(np.arange(n), np.linspace(0, n, 16), rng.uniform(-1, 1, 16)) for _ in range(2))
    T, load = 40 + 20 * T, 5 * load
    y = plants.drifting(u, T, load)
    return Dataset(np.arange(n) * H, u, y, unit_u="V", unit_y="um", covariates={"T [degC]": T, "load [N]": load})


@pytest.fixture(scope="module")
def data():
    return record(1)


@pytest.fixture(scope="module")
def model(data):
    return fit(data, CHEAP, **QUICK)


def bare(data):
    return Dataset(data.t, data.u, data.y)


def test_no_kind_is_left_out():
    assert sorted(KINDS) == sorted(REACHED)


def test_the_covariates_explain_the_drift(model, data):
    """On another signal with other temperatures and loads; without them the error is that of the drift."""
    other = record(2)
    assert model.score(other)["rms_percent"] < REACHED[CHEAP]
    assert fit(bare(data), CHEAP, **QUICK).score(other)["rms_percent"] > 4


def scheduled(seed):
    """A chain with creep whose gain follows the temperature and whose offset follows the load."""
    part = record(seed)
    warm, load = ((part.covariates.values - [40, 0]) / [20, 5]).T
    v = plants.prandtl_ishlinskii(part.u) / 8
    bent = (1 + 0.2 * warm) * (v + 0.15 * v**2 - 0.05 * v**3) + 0.1 * load
    lag = np.empty(len(bent))
    lag[0] = bent[0]
    for k in range(1, len(bent)):
        lag[k] = lag[k - 1] - np.expm1(-H / 0.05) * (bent[k] - lag[k - 1])
    return part.with_output(bent + 0.05 * lag)


@pytest.fixture(scope="module")
def actuator():
    return fit(scheduled(1), "actuator", dynamics="no", N=20)


@pytest.mark.turn("parameters of a kind")
def test_the_actuator_finds_what_follows_each_covariate(actuator):
    assert actuator.fit["parts"].startswith(
        "plays, static nonlinearity of degree 3, gain that follows T, offset that follows load"
    )
    assert actuator.score(scheduled(2))["rms_percent"] < 0.2
    T = scheduled(1).covariates.values[:, 0]
    middle, half = (T.max() + T.min()) / 2, np.ptp(T) / 2  # the gain counts from the middle of the range
    g = 0.2 * half / 20 / (1 + 0.2 * (middle - 40) / 20)
    assert actuator.graph.node("gain").value("k") == pytest.approx([g, 0], abs=2e-3)


def test_auto_takes_them_on_the_command_line_and_start_refuses_before_the_fit(tmp_path, monkeypatch):
    """The table of the candidates states inverses, which covariates once ended."""
    found = candidates()
    monkeypatch.setattr(auto, "candidates", lambda: {"polynomial_narx": found["polynomial_narx"]})
    data = record(1)
    csv, out = str(tmp_path / "d.csv"), str(tmp_path / "m.model.toml")
    data.to_csv(csv)
    asked = [csv, "--covariate", "load", "--covariate", "T [degC]"]
    invoked(["fit", *asked, "-o", out])
    assert Model.load(out).key == "polynomial_narx"
    refused = invoked(["start", *asked, "-o", str(tmp_path / "start")], status=2)
    assert "The record of a loop must have one input. Got the covariates load, T: leave them out" in refused.output
    assert not (tmp_path / "start").exists()


@pytest.mark.turn("parameters of a kind")
def test_a_covariate_without_effect_is_no_input(data):
    part = Dataset(data.t, data.u, plants.asymmetric(data.u), covariates={"T": data.covariates.values[:, 0]})
    model = fit(part, "actuator", dynamics="no", creep="no", N=20)
    assert [i.name for i in model.graph.inputs] == ["u"]
    assert model.fit["warnings"][0].startswith("the covariate 'T' does not reduce the error on validation blocks")
    assert model.score(part)["rms"] == model.fit["rms"]


def test_a_polynomial_network_is_as_good_as_without_drift(data):
    small, other = SMALL["polynomial_narx"], record(2)
    steady = (part.with_output(plants.drifting(part.u, 40.0, 0.0)) for part in map(bare, (data, other)))
    (fitted, held), model = steady, fit(data, "polynomial_narx", **small)
    assert model.score(other)["rms_percent"] < 1.3 * fit(fitted, "polynomial_narx", **small).score(held)["rms_percent"]
    assert fit(bare(data), "polynomial_narx", **small).score(other)["rms_percent"] > 4
    with pytest.raises(InputError, match="The option 'n_y' of polynomial_narx with covariates must be 0"):
        fit(data, "polynomial_narx", **{**small, "n_y": 1})
    with pytest.raises(InputError, match="Got a dependence on past inputs only, which has no causal inverse"):
        model.inverse()


@pytest.mark.stress
@pytest.mark.parametrize("key", [key for key in KINDS if key != CHEAP])
def test_every_kind_explains_the_drift(key, data, tmp_path):
    """And goes from its file to Modelica."""
    other = record(2)
    fit(data, key, **SMALL.get(key, {})).save(tmp_path / "m.model.toml")
    found = Model.load(tmp_path / "m.model.toml")
    assert found.score(other)["rms_percent"] < REACHED[key]
    assert fit(bare(data), key, **SMALL.get(key, {})).score(other)["rms_percent"] > 4
    outcome = exported.compare(found, key, tmp_path)
    assert outcome.error <= outcome.bound


def test_the_file_keeps_names_and_units_of_measure(model, data, tmp_path):
    model.save(tmp_path / "m.model.toml")
    again = Model.load(tmp_path / "m.model.toml")
    assert [(i.name, i.unit) for i in again.graph.inputs] == [("u", "V"), ("T", "degC"), ("load", "N")]
    assert again.graph.inputs[1].start == data.covariates.values[:, 0].mean()
    assert again.provenance["span_covariates"] == data.covariates.ranges
    given = {name: values for name, _, values in data.covariates}
    np.testing.assert_array_equal(again.predict(data.u, covariates=given), model.predict(data.u, covariates=given))
    held = again.predict(data.u, covariates={"T": 25, "load": 0.0})
    np.testing.assert_array_equal(held, model.graph.run(np.column_stack([data.u, 0 * data.u + 25, 0 * data.u])))


def test_the_unit_takes_them_step_by_step(model, data):
    expected = model.graph.run(np.column_stack([data.u, data.covariates.values])[:50], H)
    unit, found = model.unit(), []
    for k in range(50):
        inputs = dict(zip(("u", "T", "load"), (data.u[k], *data.covariates.values[k]), strict=True))
        if k == 0:
            unit.initialize(0.0, **inputs)
        else:
            for name, value in inputs.items():
                unit.set(name, value)
            unit.do_step((k - 1) * H, H)
        found.append(unit.get("y"))
    np.testing.assert_array_equal(found, expected)


@pytest.mark.turn("good FMUs")
@pytest.mark.some(1)
@pytest.mark.parametrize("fmi", [2, 3])
def test_the_fmu_has_them_as_inputs_with_units_of_measure(model, fmi, tmp_path):
    path = model.export(tmp_path / "m.fmu", fmi=fmi)
    if fmi == 3:
        assert validate(path) == []
    with zipfile.ZipFile(path) as archive:
        root = ET.fromstring(archive.read("modelDescription.xml"))
        header = archive.read("extra/org.fmi-standard.fmi-ls-ref/input.csv").splitlines()
    found = [e for e in root.iter() if e.get("causality") == "input"]
    assert [e.get("name") for e in found] == ["u", "T", "load"]
    assert [e.get("unit") or e[0].get("unit") for e in found] == ["V", "degC", "N"]
    drift = [float(line.split(b",")[2]) for line in (header[1], header[-1])]
    assert drift == model.provenance["span_covariates"]["T"]


def test_modelica_has_them_as_connectors(model, tmp_path):
    package = model.export_modelica(tmp_path / "Warm")
    text = (package / "Ports.mo").read_text()
    assert 'HystFMU.Interfaces.RealInput T(unit = "K"' in text
    assert 'HystFMU.Interfaces.RealInput load(unit = "N") "Covariate"' in text
    start = model.graph.inputs[1].start
    (kelvin,) = re.findall(r"  tested\.T = ([\d.]+);", (package / "Example.mo").read_text())
    assert float(kelvin) == pytest.approx(start + 273.15, rel=1e-12)


@pytest.mark.parametrize("name", ["actuator", "model"])
def test_the_inverse_takes_them_too(name, request, data):
    """Exact where they enter a gain and an offset, else by a root per step, at temperatures that move."""
    forward = request.getfixturevalue(name)
    inverse = forward.inverse()
    assert inverse.provenance["inverse"] == {"actuator": "exact", "model": "implicit"}[name]
    assert [i.name for i in inverse.graph.inputs] == ["u", "T", "load"]
    assert inverse.fit["cascade_max_percent"] < 1e-9
    given = {label: values for label, _, values in data.covariates}
    wanted = forward.predict(0.8 * data.u, covariates=given)
    reached = forward.predict(inverse.predict(wanted, covariates=given), covariates=given)
    np.testing.assert_allclose(reached, wanted, atol=1e-9)


def test_an_inverse_that_cannot_be_is_refused(actuator, model):
    node = actuator.graph.node("gain")
    falling = actuator.graph.replace(node.with_values(k=np.array([1.5, 0.0])))
    with pytest.raises(
        InputError, match=r"The factor gain.y of scheduled must keep its sign for an inverse. Got one from -0"
    ):
        type(actuator)(actuator.key, falling, actuator.step, "", {}, actuator.provenance).inverse("exact")
    with pytest.raises(InputError, match=r"A model to invert by learning must have no covariates. Got T, load"):
        model.inverse("learned")
    with pytest.raises(InputError, match=r"must depend only on its own input in Modelica. Got 'features'"):
        model.inverse("implicit").export_modelica("Inverse")


@pytest.mark.parametrize("key", [key for key in METHODS if key not in ("auto", *KINDS)])
def test_other_kinds_name_those_that_take_them(key, data):
    with pytest.raises(InputError, match=f"The data of {key} must have no covariates. Got T, load, which .* take"):
        fit(data, key)


def test_refusals_name_the_covariate(model, data):
    cases = (
        (lambda: model.predict(data.u), "covariates of the model must be given: T, load. Got no 'T'"),
        (lambda: model.predict(data.u, covariates={"T": 1}), "Got no 'load'"),
        (lambda: model.predict(data.u, covariates={"heat": 1}), "must be one of T, load. Got 'heat'"),
        (lambda: model.predict(data.u, covariates={"T": 1, "load": data.u[:3]}), "'load' must be a number or have"),
        (lambda: model.score(bare(data)), "data: The data must have the covariates of the model, T, load. Got no 'T'"),
        (
            lambda: model.score(Dataset(data.t, data.u, data.y, covariates={"T [K]": data.u, "load": data.u})),
            "The covariate 'T' must be in degC, as in the model. Got K instead",
        ),
        (
            lambda: fit(Dataset(data.t, data.u, data.y, covariates={"T": 0 * data.u}), KINDS[0]),
            "The T of the training rows must vary. Got the constant 0",
        ),
    )
    for call, words in cases:
        with pytest.raises(InputError, match=words):
            call()


def test_fit_predict_and_check_on_the_command_line(data, tmp_path):
    """Fit names the columns; predict and check find them by the names in the model, whatever their order."""
    csv, out, predicted = (str(tmp_path / name) for name in ("d.csv", "m.model.toml", "p.csv"))
    data.to_csv(csv)
    run = CliRunner()
    asked = ["fit", csv, "--covariate", "load", "--covariate", "T [degC]", "--model", "zhao_tan_mlp", "-o", out]
    quick = [s for o in ("range=1", "starts=1", "iterations=10", "hidden=2") for s in ("--set", o)]
    told = json.loads(run.invoke(main, [*asked, *quick, "--json"]).stdout)
    done = json.loads(run.invoke(main, ["predict", out, csv, "-o", predicted, "--json"]).stdout)
    assert done["errors"][0]["rms"] == pytest.approx(told["rms"], rel=1e-9)
    with open(predicted) as f:
        assert f.readline() == "t,u,y,load [N],T [degC]\n"
    with open(csv) as f:
        text = f.read().replace("T [degC]", "oven", 1)
    (tmp_path / "e.csv").write_text(text)
    assert run.invoke(main, ["predict", out, str(tmp_path / "e.csv"), "-o", predicted]).exit_code == 2
    named = ["--covariate", "load", "--covariate", "oven"]
    renamed = run.invoke(main, ["predict", out, str(tmp_path / "e.csv"), "-o", predicted, "--json", *named, "--force"])
    assert json.loads(renamed.stdout)["errors"] == done["errors"]
    checked = [
        run.invoke(main, ["check", out, str(file), "--json", *w])
        for file, w in ((csv, []), (tmp_path / "e.csv", named))
    ]
    assert [json.loads(c.stdout)["rms"] for c in checked] == [pytest.approx(told["rms"], rel=1e-9)] * 2
