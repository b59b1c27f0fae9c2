"""Modified Bouc-Wen model of a damper: records of solvers of their own, and the comparison of kinds on them."""

import numpy as np
import pytest
from foreign import truth
from foreign.records import FORMS, Case
from foreign.solvers import in_time

import hystfmu as hy
from hystfmu.model import guards

NAME = "Spencer's MR damper"
H, FINER, ROWS = 1e-3, 8, 1500


def tones(seed, rows=ROWS, band=(0.5, 8.0)):
    """Tones that begin at 0 with the velocity 0."""
    t, rng = H * np.arange(rows), np.random.default_rng(seed)
    u = sum(np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) / f**0.5 for f in np.geomspace(*band, 9))
    u *= np.minimum(1, t / 0.1) ** 2
    return u / np.abs(u).max()


def damper(u, c_0, c_1, k_0, k_1, alpha, beta, gamma, n):
    """Force of the paper for a ramp between rows; the velocity is that of the last ramp."""

    def rate(w, z, x, v):
        moved = (alpha * z + k_0 * (x - w) + c_0 * v) / (c_0 + c_1)
        d = v - moved
        return moved, d - gamma * abs(d) * abs(z) ** (n - 1) * z - beta * d * abs(z) ** n

    fine = np.interp(np.arange((len(u) - 1) * FINER + 1) / FINER, np.arange(len(u)), u)
    w, z = in_time(fine, H / FINER, rate)[::FINER].T
    v = np.diff(u, prepend=u[0]) / H
    return c_1 * rate(w, z, u, v)[0] + k_1 * u


@pytest.mark.turn("oscillators")
@pytest.mark.some(1)
@pytest.mark.parametrize("sign", [1, -1])
def test_the_numbers_of_a_damper_are_found_in_units_of_measure(sign):
    """Displacements of 20 mm and forces of some hundred newtons, in a record that begins with an offset."""
    size, rng = 0.02, np.random.default_rng(3)
    want = {"c_0": 300.0, "c_1": 6e3, "k_0": 2e3, "alpha": 4e4, "beta": 2e4, "gamma": 5e4, "n": 1.8}
    y, spring = damper(size * tones(1), k_1=0.0, **want), 800.0
    u = size * tones(1)
    y = sign * y + spring * u + 30 + 2e-4 * np.ptp(y) * rng.normal(size=ROWS)
    model = hy.fit(hy.Dataset.from_signal(u + 0.1, y, H), "modified_bouc_wen")
    found = model.fit["free"]
    assert found["readout.k[2]"]["value"] == pytest.approx(spring, rel=0.05)
    assert float(model.graph.node("readout").value("k")[0]) == sign
    for name, value in want.items():
        one = found[f"damper.{name}"]
        assert abs(one["value"] - value) <= 5 * one["standard_error"] + 0.01 * value, name
    other = size * tones(2)
    error = model.predict(other + 0.1) - (sign * damper(other, k_1=0.0, **want) + spring * other + 30)
    assert np.sqrt(np.mean(error**2)) <= 1e-3 * np.ptp(y)


@pytest.mark.turn("oscillators")
@pytest.mark.some(1)
@pytest.mark.parametrize("form", FORMS)
def test_the_fit_is_as_good_as_the_fit_of_the_true_structure(form):
    """Both do not know the velocity that the device takes from the next row; lugre leaves 2 % after one oscillation."""
    case = Case(NAME, form, 31337)
    model = hy.fit(case.data, "modified_bouc_wen")
    reached, of_truth = case.error(model), case.error(truth.by_graph(NAME, 31337, case.data))
    print(f"{form}: {reached:.3g} %FS, true structure as a graph {of_truth:.3g} %FS")
    assert reached <= 1.2 * of_truth
    assert not any("leaves the range" in line for line in model.fit.get("warnings", []))


@pytest.mark.stress
def test_the_choice_takes_the_damper_after_one_oscillation():
    """The velocity of its first row, which no model knows, does not hide the difference from lugre."""
    assert hy.fit(Case(NAME, "decaying sine", 31337).data).key == "modified_bouc_wen"


def test_the_force_of_a_dashpot_at_a_jump_is_no_extrapolation():
    """The guard simulates jumps, at which this force is as large as the sample time is short."""
    data = hy.Dataset.from_signal(tones(4), damper(tones(4), 0.1, 2.0, 0.2, 0.0, 5.0, 4.0, 4.0, 2.0), H)
    node = hy.Node("damper", "modified_bouc_wen")
    assert np.ptp(hy.Graph.single(node).run(guards.other_signal(data.u, 0.0), H)) > 10 * data.span
    assert guards.excursion("modified_bouc_wen", hy.Graph.single(node), data) == []
