"""A hysteresis of micrometres, in metres: nothing in the way from data to FMU and Modelica has a size of its own."""

from pathlib import Path

import exported
import fmpy
import numpy as np
import plants
import simulate

from hystfmu.data import Dataset, signals
from hystfmu.fmu import export_fmu
from hystfmu.graph import Graph, Node
from hystfmu.identify import fit
from hystfmu.model import Model

MICRO = 1e-6


def test_a_model_in_metres_is_the_one_in_micrometres(tmp_path: Path) -> None:
    u, v = signals.training(20, 1), signals.nested_reversals(10, 5)
    y = plants.prandtl_ishlinskii(u)
    expected = fit(Dataset.from_signal(u, y), "prandtl_ishlinskii", N=8).predict(v)
    fit(Dataset.from_signal(MICRO * u, MICRO * y), "prandtl_ishlinskii", N=8).save(tmp_path / "m.model.toml")
    model = Model.load(tmp_path / "m.model.toml")
    predicted = model.predict(MICRO * v)
    assert np.abs(predicted / MICRO - expected).max() <= 1e-6 * np.ptp(expected)
    export_fmu(model, tmp_path / "m.fmu")
    t = np.arange(len(v)) * model.step
    rows = np.array(list(zip(t, MICRO * v, strict=True)), dtype=[("time", float), ("u", float)])
    found = fmpy.simulate_fmu(
        str(tmp_path / "m.fmu"), input=rows, output=["y"], start_values={"u": MICRO * v[0]},
        stop_time=t[-1], step_size=model.step, output_interval=model.step,
    )  # fmt: skip
    assert np.array_equal(found["y"][1:], predicted[:-1])  # a step from t to t + h takes the input at t
    outcome = exported.compare(model, "Metres", tmp_path)
    assert outcome.good, exported.line(outcome)


def test_the_smooth_operator_keeps_plays_of_micrometres() -> None:
    r, w = np.array([0.1, 0.4]) * MICRO, [0.5, 1.0]
    kinds = {"Smooth": "s", "Events": "e"}
    parts = " ".join(
        f"HystFMU.Operators.{kind}.PrandtlIshlinskii {name}(n = 2, r = {{{r[0]}, {r[1]}}}, w = {{0.5, 1}}, w0 = 0.2);"
        for kind, name in kinds.items()
    )
    wires = " ".join(f"connect(signal.r, {n}.u); connect(signal.dr_lead, {n}.du);" for n in kinds.values())
    rows = under_sine(parts, wires, MICRO, 2.0)
    plays = Node("p", "prandtl_ishlinskii", {"n": 2}, {"r": r, "w": w, "w0": 0.2})
    expected = Graph.single(plays).run(rows["signal.r"]).ravel()
    assert np.abs(rows["s.y"] - expected).max() <= 3e-3 * np.ptp(expected)
    assert np.abs(rows["e.y"] - expected).max() <= 1e-9 * np.ptp(expected)


def under_sine(parts: str, wires: str, amplitude: float, stop: float = 1.0) -> dict[str, np.ndarray]:
    text = f"model M HystFMU.Sources.Sine signal(amplitude = {amplitude}); {parts} equation {wires} end M;"
    return simulate.solve_text(text, stop, 0.002, 1e-14).at(0.002)


def test_a_constraint_factor_of_nanometres() -> None:
    """Nothing in the classes is wider than the hysteresis; 3e-3 is the bound of the rounded corners."""
    values = "m = 1, depth = 16, a0 = 0.5, a = {4e8}, d_max = 3e-9"
    kinds = ("Smooth", "Events")
    parts = " ".join(f"HystFMU.Operators.{k}.ConstraintFactor {k[0].lower()}({values});" for k in kinds)
    wires = " ".join(f"connect(signal.r, {n}.x); connect(signal.dr_lead, {n}.dx);" for n in ("s", "e"))
    rows = under_sine(parts, wires, 1e-9)
    operator = Node("p", "constraint_factor", {"m": 1, "depth": 16}, {"a0": 0.5, "a": [4e8], "d_max": 3e-9})
    expected = Graph.single(operator).run(rows["signal.r"]).ravel()
    assert np.abs(rows["s.h"] - expected).max() <= 3e-3 * np.ptp(expected)
    assert np.abs(rows["e.h"] - expected).max() <= 1e-9 * np.ptp(expected)


def test_inverses_with_events_of_nanometres() -> None:
    r, w = [1e-10, 4e-10], [0.5, 1.0]
    parts = (
        "HystFMU.Inverse.Events.PrandtlIshlinskiiInverse p(n = 2, r = {1e-10, 4e-10}, w = {0.5, 1}, w0 = 0.2); "
        "HystFMU.Inverse.Events.ConstraintFactorInverse c(m = 1, depth = 16, a0 = 0.5, a = {4e8}, d_max = 3e-9);"
    )
    wires = (
        "connect(signal.r, p.y); connect(signal.dr_lead, p.dy); connect(signal.r, c.h); connect(signal.dr_lead, c.dh);"
    )
    rows = under_sine(parts, wires, 5e-10)
    plays = Node("p", "prandtl_ishlinskii_inverse", {"n": 2}, {"r": r, "w": w, "w0": 0.2})
    factor = Node("c", "constraint_factor_inverse", {"m": 1, "depth": 16}, {"a0": 0.5, "a": [4e8], "d_max": 3e-9})
    for node, found in ((plays, rows["p.u"]), (factor, rows["c.x"])):
        expected = Graph.single(node).run(rows["signal.r"]).ravel()
        assert np.abs(found - expected).max() <= 1e-9 * np.ptp(expected), node.type
