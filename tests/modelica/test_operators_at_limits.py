"""The memory of dominant extrema when its list is full: nested loops are forgotten, and one sweep closes all."""

from pathlib import Path

import exported
import fmpy
import numpy as np
import plants
import pytest
import simulate

from hystfmu import Dataset, Graph, Node, signals
from hystfmu.fmu import export_fmu
from hystfmu.identify import fit
from hystfmu.model import Model

DEPTHS = (4, 5, 8)


def bursts(rows: int) -> np.ndarray:
    """Bursts of decaying reversals of random length and size: each begins with a sweep across the ones before."""
    rng = np.random.default_rng(0)
    found: list[float] = []
    while len(found) < rows:
        size = rng.choice([-1, 1]) * rng.uniform(0.5, 2)
        found += [size * (-0.93) ** j for j in range(rng.integers(2, 14))]
    return np.array(found[:rows])


@pytest.mark.turn("loops in Modelica")
def test_full_memory_agrees_with_the_c_core() -> None:
    u = bursts(90)
    parts = [f"HystFMU.Operators.Sampled.ZhaoTan d{d}(depth = {d}, Ts = 0.1);" for d in DEPTHS]
    wires = [f"connect(signal.r, d{d}.x);" for d in DEPTHS]
    levels = ", ".join(map(repr, u.tolist()))
    source = (
        f"model M HystFMU.Sources.Steps signal(m = {len(u)}, levels = {{{levels}}}, T = 0.1); {' '.join(parts)} "
        f"equation {' '.join(wires)} end M;"
    )
    rows = simulated(source, len(u))
    for d in DEPTHS:
        expected = Graph.single(Node("tested", "zhao_tan", {"depth": d}, {})).run(rows["signal.r"])
        assert rows[f"d{d}.extrema[1]"].max() == d, "the list was never full"
        assert np.abs(rows[f"d{d}.h"] - expected).max() <= 1e-12 * np.abs(expected).max()


CASES = 1000
# Peaks of growing size on either side of x0, each with a reversal of one to three roundings behind it.  A peak passes
# the mirror image of the one before, so that it is on the virgin branch: the reversal is its outermost extremum.  From
# there the input goes some way back, and then to below or above the peak.  Below x0 a rounding of the input is less
# than one of its distance to x0.
ROUNDINGS = """
model M
  HystFMU.Operators.Sampled.ZhaoTan d8(depth = 8, x0 = 1, Ts = 0.1);
  Integer k(start = -1, fixed = true);
  discrete Real side(start = 1, fixed = true), peak(start = 1, fixed = true), u(start = 1, fixed = true);
  discrete Real whole(start = 5, fixed = true), drawn(start = 0, fixed = true), other(start = 0, fixed = true);
equation
  when sample(0, 0.1) then
    k = pre(k) + 1;
    whole = mod(16807*pre(whole), 2147483647);
    drawn = whole/2147483647;
    other = mod(16807*whole, 2147483647)/2147483647;
    side = if mod(k, 8) < 4 then 1 else -1;
    peak = if mod(k, 4) == 0 then 1 + side*(0.9 + 0.00005*k + 0.0001*drawn) else pre(peak);
    u = if mod(k, 4) == 0 then peak
      elseif mod(k, 4) == 1 then peak - side*(if side > 0 then 2.3e-16 else 1.4e-17)*(1 + floor(3*drawn))
      elseif mod(k, 4) == 2 then 1 + (peak - 1)*(1.85*drawn - 0.9)
      else 1 + (peak - 1)*(if other > 0.5 then 0.96 + 0.03*drawn else 1 + 1e-6*drawn);
  end when;
  d8.x = u;
end M;
"""


@pytest.mark.stress
def test_reversal_of_one_rounding_behind_a_peak_agrees_with_the_c_core() -> None:
    rows = simulated(ROUNDINGS, 4 * CASES + 1)
    u = rows["u"][: 4 * CASES]
    assert len(u) == 4 * CASES
    behind, peak = u[1::4], u[::4]
    # what a comparison without a sign takes for a loop that closes
    assert np.count_nonzero((behind != peak) & (np.abs(behind - 1) == np.abs(peak - 1))) > 250
    expected = Graph.single(Node("tested", "zhao_tan", {"depth": 8}, {"x0": 1.0})).run(u)
    assert np.abs(rows["d8.h"][: len(u)] - expected).max() <= 1e-12 * np.abs(expected).max()


def simulated(source: str, samples: int) -> dict[str, np.ndarray]:
    """What the model M has after each of its samples, a tenth of a second apart."""
    return simulate.solve_text(source, 0.1 * samples, 0.1, 1e-6).at(0.1)


# ---- Duhem operator at the limits of its integration: as many steps in a sample as the C core takes, and overflow
LEVELS = np.array([0.0, 0.9, 0.8])
LONG_WAYS = {
    "ten thousand steps and never more, and the bound": ({"du_max": 8e-5, "w_max": 0.3}, {}),
    "not a number on the way to the bound": ({"du_max": 0.5, "w_max": 2.0}, {"a": 1e200, "b": 1e200, "c": 1e200}),
}


@pytest.mark.stress
@pytest.mark.parametrize("case", LONG_WAYS)
def test_long_ways_agree_with_the_c_core(case: str) -> None:
    values, size = dict(LONG_WAYS[case][0]), LONG_WAYS[case][1]
    for name in "abc":
        for end, sign in (("rise", 1), ("fall", -1)):
            values[f"{name}_{end}"] = size.get(name, 0.5) * (-1 if name == "c" else -sign if name == "b" else 1)
    given = ", ".join(f"{k} = {{{v!r}}}" if k[0] in "abc" else f"{k} = {v!r}" for k, v in values.items())
    levels = ", ".join(map(repr, LEVELS.tolist()))
    text = (
        f"model M HystFMU.Sources.Steps signal(m = {len(LEVELS)}, levels = {{{levels}}}, T = 0.1); "
        f"HystFMU.Operators.Sampled.Duhem tested({given}, Ts = 0.1); equation connect(signal.r, tested.u); end M;"
    )
    rows = simulate.solve_text(text, 0.1 * len(LEVELS), 0.1, 1e-6).at(0.1)
    assert rows["tested.u"] == pytest.approx(LEVELS)
    expected = Graph.single(Node("tested", "duhem", {}, values)).run(LEVELS)
    assert np.ptp(expected) > 0.3
    assert np.abs(rows["tested.y"] - expected).max() <= 1e-12 * np.abs(expected).max()


# ---- A hysteresis of micrometres, in metres: nothing in the way from data to FMU and Modelica has a size of its own
MICRO = 1e-6


@pytest.mark.stress
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


@pytest.mark.stress
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


@pytest.mark.stress
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


@pytest.mark.stress
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


# ---- The realisation Events has an event at each reversal of its input and no other
@pytest.mark.turn("loops in Modelica")
@pytest.mark.some(1)
@pytest.mark.parametrize("kind", ["Events", "Smooth"])
def test_ten_plays_have_one_event_for_each_reversal(kind: str) -> None:
    text = f"""model M
  HystFMU.Sources.Multisine signal(m = 2, f = {{3, 17}}, a = {{0.7, 0.4}}, ph = {{0, 0}});
  HystFMU.Operators.{kind}.PrandtlIshlinskii tested(n = 10, w0 = 0.3, r = linspace(0.05, 0.5, 10), w = fill(0.1, 10));
equation
  connect(signal.r, tested.u);
  connect(signal.dr_lead, tested.du);
end M;
"""
    found = simulate.solve_text(text, 3, 1e-3, 1e-6)
    t = np.linspace(0, 3, 3_000_001)
    rate = 0.7 * 3 * np.cos(6 * np.pi * t) + 0.4 * 17 * np.cos(34 * np.pi * t)
    reversals = np.count_nonzero(rate[1:] * rate[:-1] < 0)
    assert reversals > 50
    assert found.events == (reversals if kind == "Events" else 0)
