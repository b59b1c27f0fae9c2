"""Models of several blocks against the C core: the hysteretic actuator, and the example against its scenario's loop."""

import csv
import tomllib
from typing import Any

import library
import numpy as np
import pytest
import simulate

from hystfmu import Graph, Input, Node, Output, Unit
from hystfmu.model import Model
from hystfmu.scenario import Cases

SCENARIOS = library.ROOT.parents[1] / "scenarios"
OMEGA_N = 2 * np.pi * 500


def test_hysteretic_actuator_agrees_with_the_chain_of_units() -> None:
    h = 1e-4
    before = simulate.run("HystFMU.Validation.BacklashSumDynamics").at(h, "left")
    hysteresis = Node("h", "backlash_sum", {}, {"w0": 0.3, "r": np.linspace(0.05, 0.5, 10), "w": np.full(10, 0.1)})
    dynamics = Node("g", "transfer_function", {}, {"b": [1.0], "a": [1 / OMEGA_N**2, 2 * 0.7 / OMEGA_N, 1.0]})
    # what the dynamics get in row k was held since instant k - 1
    v = Graph.single(hysteresis).run(before["tested.u"])
    expected = Graph.single(dynamics).run(np.r_[0.0, v[:-1]], h)
    assert np.ptp(expected) > 0.3
    # the solver at Tolerance = 1e-10
    assert np.abs(before["tested.y"] - expected).max() <= 1e-8


def closed_loop(plant: Any, rest: Unit, rows: int, h: float) -> simulate.Array:
    """r, u, y at the instants of a loop whose plant goes first in each step."""
    found = np.empty((rows, 3))
    closed = "y" in rest.variables
    plant.initialize(0.0, u=0.0)
    rest.initialize(0.0, **({"y": plant.get("y")} if closed else {}))
    for k in range(rows):
        if k > 0:
            plant.set("u", rest.get("u"))  # the command held since the last sample
            plant.do_step((k - 1) * h, h)
            if closed:
                rest.set("y", plant.get("y"))
            rest.do_step((k - 1) * h, h)
        found[k] = rest.get("r"), rest.get("u"), plant.get("y")
    return found


COMPENSATOR = ("compensator_operator", "compensator_network")
EVERETT = [0.65, 1.4, 0.65, 2.25, 1.4, 0.65, 3.2, 2.25, 1.4, 0.65]
PREISACH = Node("preisach", "preisach", {"n": 4}, {"lo": -2.0, "hi": 2.0, "E": EVERETT})
SLOPES = {"b_rise": [-0.8], "c_rise": [-0.6], "b_fall": [0.8], "c_fall": [-0.6]}
DUHEM = Node("duhem", "duhem", {}, {"k": 0.6, "a_rise": [0.5], "a_fall": [0.5], **SLOPES})
# operator of the plant, nodes and wires of its inverse, where its command comes in and out, percent of the stroke
OTHERS = {
    "Preisach": (PREISACH, [Node("inverse", "implicit_inverse", {}, {"lo": -2.0, "hi": 2.0}), PREISACH],
        [("inverse.u", "preisach.u"), ("preisach.y", "inverse.h")], ("feedforward.v", "inverse.y", "inverse.u"), 0.001),
    "Duhem": (DUHEM, [Node("inverse", "scaling", {"n": 1}, {"gain": 1 / 0.9})],
        [("feedforward.v", "pid.u_ff"), ("reference.r", "pid.y_d")], ("pid.u", "inverse.u", "inverse.y"), 0.1),
}  # fmt: skip


@pytest.mark.turn("loops in Modelica")
@pytest.mark.some(1)
@pytest.mark.parametrize("example", OTHERS)
def test_example_of_an_operator_agrees_with_a_loop_of_units(example: str) -> None:
    """An operator that no scenario has in its plant, with the references and the controller of the scenario pid."""
    operator, inverse, wires, (command, into, out), limit = OTHERS[example]
    h, units = 1e-4, Cases(SCENARIOS / "pid").spec.model_dump()["units"]
    values = {"b": [1.0], "a": [1 / OMEGA_N**2, 2 * 0.7 / OMEGA_N, 1.0]}
    ports = [Input("u", (f"{operator.name}.u",))], [Output("y", "g0.y")]
    g0 = Node("g0", "transfer_function", {"na": 2}, values)
    plant = Unit(Graph([operator, g0], [(f"{operator.name}.y", "g0.u")], *ports))
    closed = command == "pid.u"
    names = ["reference", "feedforward", *(["pid"] if closed else [])]
    nodes = [Node(n, units[n]["block"], units[n].get("dims", {}), units[n]["values"]) for n in names]
    delay = Node("delay", "delay", {"n": 1})
    joined = [(f"reference.{d}r_lead", f"feedforward.{d}r") for d in ("", "d", "dd")]
    joined += [*wires, (command, into), (out, "delay.u")]
    inputs = [Input("y", ("pid.y",))] if closed else []
    ends = [Output("u", "delay.y"), Output("r", "reference.r")]
    rest = Unit(Graph([*nodes, *inverse, delay], joined, inputs, ends, sort=False))
    now = simulate.run(f"HystFMU.Examples.{example}").at(h)
    rows = closed_loop(plant, rest, len(now["time"]), h)
    got = np.column_stack([now[n] for n in ("reference.r", "delay.y", "plant.y")])
    error = np.abs(got - rows).max(axis=0) / np.abs(rows).max(axis=0)
    print(f"{example}: largest differences of r, u, y:", *(f"{e:.1e}" for e in error))
    assert error.max() <= 1e-8
    late = now["time"] > 0.1
    tracking = 100 * np.sqrt(np.mean((got[:, 2] - got[:, 0])[late] ** 2)) / 2.0
    print(f"tracking error {tracking:.4f} % of the stroke")
    assert tracking <= limit


# example, scenario, case, time from which its error counts (s)
FIGURES = [
    ("SlidingMode", "sliding_mode", "sine_10", 0.1), ("SuperTwisting", "super_twisting", "sine_10", 0.1),
    ("Pid", "pid", "sine_10", 0.1), ("PidObserver", "pid_observer", "sine_10", 0.1),
    ("LeadLag", "lead_lag", "sine_10", 0.1), ("IterativeLearning", "iterative_learning", "sine_100", 0.2),
    ("Cascade", "cascade", "sine_10", 0.1), ("ZhaoTan", "cascade_learned", "zhao_tan_sine_10", 0.1),
    ("BoucWen", "pid", "other_class_10", 0.1),
]  # fmt: skip
QUICK_FIGURES = ("ZhaoTan", "BoucWen")


@pytest.mark.turn("loops in Modelica")
@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("example", "name", "case", "settled"),
    [r if r[0] in QUICK_FIGURES else pytest.param(*r, marks=pytest.mark.stress) for r in FIGURES],
)
def test_example_gives_the_figures_of_the_scenario(example: str, name: str, case: str, settled: float) -> None:
    """Rows and tracking error that the scenario has recorded, between samples, too."""
    c = library.classes()[f"HystFMU.Examples.{example}"]
    scenario = Cases(SCENARIOS / name).spec.model_dump()
    fine = scenario["step"] / scenario["ripple"]
    with (SCENARIOS / name / "baseline.csv").open() as text:
        recorded = np.array([[r["t"], r["plant.y"]] for r in csv.DictReader(text) if r["case"] == case], float)
    assert len(recorded) >= 20
    stop = max(library.experiment(c)["StopTime"], round(recorded[-1, 0] / 0.1 + 0.5) * 0.1)
    now = simulate.solve(c.file, c.name, stop, fine, 1e-10).instants()
    at = np.rint(recorded[:, 0] / fine).astype(int)
    assert np.abs(now["plant.y"][at] - recorded[:, 1]).max() <= 1e-8
    e = (now["plant.y"] - now["reference.r"])[now["time"] >= settled - 1e-9]
    figures = tomllib.loads((SCENARIOS / name / "baseline.toml").read_text())["case"][case]["metrics"]
    assert 100 * np.sqrt(np.mean(e**2)) / 2 == pytest.approx(figures["tracking"], rel=1e-6)


@pytest.mark.stress
def test_network_of_the_ipmc_sensor_gives_the_figures_of_the_scenario() -> None:
    """Plays sampled ten times as fast as there: their output is held for 0.1 ms, not run straight for 1 ms."""
    now = simulate.run("HystFMU.Examples.IpmcNetwork").at(1e-3)
    r, v, s = (now[k] for k in ("reference.r", "sensor.y", "compensator.u"))
    name = "papers/ipmc_bfbnn_compensator"
    models = {k: Model.load(SCENARIOS / "models" / f"ipmc_{k}.model.toml") for k in ("sensor", *COMPENSATOR)}
    sensed = np.ravel(models["sensor"].predict(r, 1e-3))
    inner = models["compensator_operator"].graph.run(sensed, 1e-3)
    made = np.ravel(models["compensator_network"].graph.run(inner, 1e-3))
    print(
        f"sensor {np.abs(v - sensed).max() / np.ptp(sensed):.1e}, network {np.abs(s - made).max() / 10:.1e} of the span"
    )
    assert np.abs(v - sensed).max() <= 2e-3 * np.ptp(sensed)
    assert np.abs(s - made).max() <= 5e-3 * 10
    # the network of the scenario on the voltage of this sensor: the same operations
    again = np.ravel(models["compensator_network"].graph.run(models["compensator_operator"].graph.run(v, 1e-3), 1e-3))
    assert np.abs(s - again).max() <= 1e-9 * 10
    with (SCENARIOS / name / "baseline.csv").open() as text:
        rows = [row for row in csv.DictReader(text) if row["case"] == "sine_3" and float(row["t"]) < 0.99]
    at = [round(float(row["t"]) * 1e3) for row in rows]
    assert len(at) > 5
    assert np.abs(s[at] - [float(row["compensator.y"]) for row in rows]).max() <= 5e-3 * 10
    tracking = 100 * np.sqrt(np.mean((s - r)[now["time"] >= 0.1] ** 2)) / 10
    print(f"error {tracking:.3f} % of the stroke")
    assert tracking <= 0.73  # the limit of the scenario


@pytest.mark.stress
def test_realisations_of_minor_loops_agree() -> None:
    v = simulate.run("HystFMU.Examples.MinorLoops").values
    # width = 1e-3 and weights that add up to 1; the sampled one holds for Ts
    assert np.abs(v["events.y"] - v["hysteresis.y"]).max() <= 1e-3
    rate = np.abs(v["signal.dr_lead"]).max()
    assert np.abs(v["events.y"] - v["sampled.y"]).max() <= 1.3 * rate * 1e-3
    assert np.ptp(v["events.y"]) > 0.8


@pytest.mark.stress
def test_rate_dependence_comes_from_creep_and_dynamics_alone() -> None:
    v = simulate.run("HystFMU.Examples.RateDependence").values

    def loop(side: str, part: str, period: float) -> float:
        """Area of the loop over the last period."""
        late = v["time"] > 0.4 - period - 1e-9
        return float(np.abs(np.trapezoid(v[f"{side}{part}"][late], v[f"{side}.r"][late])))

    hysteresis = [loop(s, "Hysteresis.y", T) for s, T in (("slow", 0.2), ("fast", 0.01))]
    assert hysteresis[0] == pytest.approx(hysteresis[1], rel=0.01)
    # G0 turns the phase at 100 Hz by 16 degrees: a wider loop; at 5 Hz it does nothing
    dynamics = [loop(s, "Dynamics.y", T) for s, T in (("slow", 0.2), ("fast", 0.01))]
    assert dynamics[0] == pytest.approx(hysteresis[0], rel=0.1)
    assert dynamics[1] > 1.5 * hysteresis[1]
    # creep at 5 Hz widens the loop by more than at 100 Hz
    creep = [loop(s, "Creep.y", T) for s, T in (("slow", 0.2), ("fast", 0.01))]
    assert creep[0] > 2 * creep[1]


@pytest.mark.stress
def test_stack_agrees_with_its_equations_solved_elsewhere() -> None:
    """Drive, stack and load by Heun's steps of a tenth of the relaxation, plays with sharp corners."""
    v = simulate.run("HystFMU.Examples.StackMovesMass").values
    identified = Model.load(SCENARIOS / "models" / "backlash_identified.model.toml").graph.node("hysteresis")
    w0, r, w = (np.asarray(identified.value(k)) for k in ("w0", "r", "w"))
    C, v_max, k, tau, share, h = 6e-6, 100.0, 4e7, 1e-5, 0.9, 1e-6
    d = 26e-6 / (share * C * v_max)

    def played(e: float, z: np.ndarray) -> np.ndarray:
        return np.maximum(e / v_max - r, np.minimum(e / v_max + r, z))

    def within(x: float, limit: float) -> float:
        return max(min(x, limit), -limit)

    def stroke(e: float, z: np.ndarray) -> float:
        return 26e-6 / 1.025 * float(w0[0] * e / v_max + w @ z)

    def rates(t: float, x: list[float], z: np.ndarray) -> tuple[list[float], float, float]:
        volts, i, q, e, s, speed = x
        free = stroke(e, z)
        behind, F = (q - free / d) / ((1 - share) * C), k * (s - free)
        command = 100 * (0.5 + 0.45 * np.exp(-20 * t) * np.sin(2 * np.pi * 50 * t))
        slew = within((command - volts) / 2e-5, 1e6)
        di = (within((volts - behind - i) / 10, 0.2) - i) / 5e-6
        moved = (-F - 20 * speed - 300 * speed - 2e6 * s) / 0.2
        return [slew, di, i, (behind + d * F - e) / tau, speed, moved], behind, free

    z, rows = np.full(len(r), 0.5), {}
    x = [50.0, 0.0, stroke(50.0, z) / d + (1 - share) * C * 50, 50.0, 0.0, 0.0]
    wanted = {round(float(t) / h): n for n, t in enumerate(v["time"]) if t <= 0.01}
    for j in range(max(wanted) + 1):
        a, behind, free = rates(j * h, x, z)
        if j in wanted:
            rows[wanted[j]] = behind, free, x[4]
        ahead = [p + h * dp for p, dp in zip(x, a, strict=True)]
        b, *_ = rates((j + 1) * h, ahead, played(ahead[3], z))
        x = [p + h / 2 * (da + db) for p, da, db in zip(x, a, b, strict=True)]
        z = played(x[3], z)
    at = sorted(rows)
    for column, name in enumerate(("stack.v", "stack.hysteresis.y", "load.s")):
        own = np.array([rows[n][column] for n in at])
        assert np.ptp(own) > 0.5 * np.ptp(v[name])
        assert np.abs(v[name][at] - own).max() < 2e-3 * np.abs(own).max(), name
