"""What every fit checks and reports, by numbers: limits of the data, free run, other signals."""

from dataclasses import replace

import numpy as np
import pytest

import hystfmu.identify as identify
from hystfmu import Dataset, Graph, Input, InputError, Node, Output
from hystfmu.data.signals import nested_reversals
from hystfmu.identify import one
from hystfmu.identify.excitation.minor_loops import Excitation
from hystfmu.identify.methods import weighted_sums
from hystfmu.model import Model, guards

H = 1e-3
RNG = np.random.default_rng(6)
U = 3 + 2 * np.interp(np.arange(400), 10 * np.arange(41), RNG.uniform(-1, 1, 41))


def gain(k=1.0, offset=0.0, name="u"):
    node = Node("a", "scaling", {"n": 1}, {"gain": k, "offset": offset})
    return Graph([node], [], [Input(name, ("a.u",))], [Output("y", "a.y")])


# ---- data of a fit --------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("key", ["prandtl_ishlinskii", "auto"])
@pytest.mark.parametrize(("u", "y", "words"), [
    (U, np.full(400, np.nan), "must have a measured output"),
    (np.where(np.arange(400) == 7, 1.01e100, U), U, r"row 7: The values of u must be at most 1e\+100. Got 1.01e\+100"),
    (U, np.where(np.arange(400) == 9, -1.01e100, U), r"row 9: The values of y must be at most 1e\+100"),
    (np.where(np.arange(400) < 300, 5.0, U), U, "The u of the training rows must vary. Got the constant 5"),
    (U, 0.99e-100 * (U - U.min()) / np.ptp(U[:300]), "The span of y in the training rows must be at least 1e-100"),
])  # fmt: skip
def test_data_that_no_fit_takes(u, y, words, key):
    with pytest.raises(InputError, match=words):
        identify.fit(Dataset.from_signal(u, y, H, "bad", slice(0, 300)), key)


def test_auto_has_no_options():
    with pytest.raises(InputError, match="must be one of: none"):
        identify.fit(Dataset.from_signal(U, U, H), "auto", N=3)


def test_data_at_the_limits():
    one.check(Dataset.from_signal(np.where(np.arange(400) == 7, 1e100, U), U, H))
    one.check(Dataset.from_signal(U, 1.01e-100 * (U - U.min()) / np.ptp(U), H))
    T = np.where(np.arange(400) < 300, 5.0, U)
    with pytest.raises(InputError, match="The T of the training rows must vary"):
        one.check(Dataset(H * np.arange(400), U, U, train=slice(0, 300), covariates={"T": T}))


def test_equations_without_a_solution_are_one_line(monkeypatch):
    """LAPACK may give up in the middle of a search; ``auto`` then leaves the candidate out."""

    def build(data, options, seed, progress):
        raise np.linalg.LinAlgError("SVD did not converge")

    monkeypatch.setitem(weighted_sums.KINDS, "prandtl_ishlinskii", identify.catalogue.Row("", build, ()))
    with pytest.raises(
        InputError, match=r"^run: The equations of a fit .* Got the error 'SVD did not converge' of LAPACK"
    ):
        one.fit_one(Dataset.from_signal(U, U, H, "run"), "prandtl_ishlinskii", 0, lambda f: None, {})


@pytest.mark.parametrize(("rms", "good"), [(0.5, True), (0.5 * (1 + 5e-10), True), (0.5001, False), (np.nan, False)])
def test_the_mean_is_the_worst_model(monkeypatch, rms, good):
    data = Dataset.from_signal(U, U, H, "run", slice(0, 300))
    y = U + rms * data.span
    y[300:] = -1e9  # only rows that count
    monkeypatch.setattr(one, "run_along", lambda graph, data: y)

    def finished():
        return one.finished(data, "kind", "", (gain(), 3, {}), 0.0, {}, 0)

    if good:
        assert finished().fit["rms_percent"] == pytest.approx(100 * rms)
    else:
        got = "a run that diverges" if np.isnan(rms) else "an error of 50 % of the span"
        with pytest.raises(InputError, match=rf"run: A model of the kind kind must follow the data\. Got {got}"):
            finished()


@pytest.mark.parametrize(("parameters", "warned"), [(299, False), (300, True)])
def test_a_fit_states_its_numbers(monkeypatch, parameters, warned):
    def build(data, options, seed, progress):
        return gain(2.0), parameters, {"f_n": 3.0, "warnings": ["first"], "bounded": {"p": (0.0, 0.0, 1.0)}}

    kinds = weighted_sums.KINDS
    monkeypatch.setitem(kinds, "prandtl_ishlinskii", replace(kinds["prandtl_ishlinskii"], build=build))
    data = Dataset.from_signal(U, 2 * U + np.where(np.arange(400) % 2, 0.1, -0.1), H, "x", slice(0, 300))
    model = one.fit_one(data, "prandtl_ishlinskii", 3, lambda f: None, {"N": 7})
    assert (model.fit["parameters"], model.fit["f_n"], model.step) == (parameters, 3.0, H)
    assert model.fit["rms"] == pytest.approx(0.1)
    assert model.fit["rms_percent"] == pytest.approx(100 * 0.1 / data.span)
    found = model.fit["warnings"]
    assert found[0] == "first"
    assert any(w.startswith(f"{parameters} parameters from 300 training rows") for w in found) is warned
    assert found[-1].startswith("p = 0 is a bound of the search (0 to 1)")
    p = model.provenance
    assert (p["seed"], p["options"], p["rows"], p["train"]) == (3, {"N": 7, "w0_min": 0.0}, 400, "0:300")
    assert p["span_u"] == [U.min(), U.max()]
    assert "starts" not in p
    assert "span_covariates" not in p
    assert 0 <= model.fit["seconds"] < 60


def test_what_a_record_shows_is_added():
    seen = Excitation(1, 1.0, 0, 0.0, False, "x", ("poor",), ("coarse",))
    late = {"lag_rows": 3}, ["late"]
    model = Model("k", gain(), H, "", {"rms_percent": 1.5, "warnings": ["own"]}, {})
    found = identify._told(model, seen, late, ["loop"]).fit
    assert found["warnings"] == ["own", "poor", "coarse", "late", "loop"]
    assert found["lag_rows"] == 3
    delay = Graph([Node("d", "delay", {"n": 1})], [], [Input("u", ("d.u",))], [Output("y", "d.y")])
    follows = Model("k", delay, H, "", {"rms_percent": 1.5}, {})
    assert identify._told(follows, seen, late, ["loop"]).fit["warnings"] == ["poor", "loop"]
    nothing = Excitation(1, 1.0, 0, 0.0, False, "x", (), ())
    assert "warnings" not in identify._told(follows, nothing, late, []).fit


# ---- another signal -------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("step", [1, 3])
def test_the_other_signal_is_steps_and_two_speeds(step):
    u = np.interp(np.arange(0, 400, 1 / step), np.arange(400), U)[: 399 * step]
    data = Dataset.from_signal(u, u, H, "o", slice(10, len(u) - 5))
    rows = u[data.train]
    lo, hi = rows.min(), rows.max()
    speed = np.clip(np.sqrt(np.mean(np.diff(rows) ** 2)) / ((hi - lo) / 2), 0.01, 0.1)
    want = [nested_reversals(80, 77, speed), nested_reversals(80, 78, 0.01)]
    steps = np.repeat([u[0], hi, lo, (lo + hi) / 2], 100)
    other = guards.other_signal(rows, u[0])
    assert other == pytest.approx(np.r_[steps, (lo + hi) / 2 + (hi - lo) / 2 * np.concatenate(want)])


@pytest.mark.parametrize(
    ("beyond", "words"), [(0.99, None), (1.01, "by 1 times its span"), (99.0, "by 99"), (101.0, "")]
)
@pytest.mark.parametrize("sign", [1, -1])
def test_how_far_an_output_may_leave_its_range(monkeypatch, beyond, words, sign):
    data = Dataset.from_signal(U, sign * U, H, "far")
    lo, hi = data.y.min(), data.y.max()
    value = hi + beyond * data.span if sign > 0 else lo - beyond * data.span
    graph = gain(0.0, value)
    if words == "":
        with pytest.raises(InputError, match=r"Got an output 1e\+02 spans of y outside its range"):
            guards.excursion("kind", graph, data)
    else:
        found = guards.excursion("kind", graph, data)
        assert len(found) == (words is not None)
        assert all(words in line for line in found)
