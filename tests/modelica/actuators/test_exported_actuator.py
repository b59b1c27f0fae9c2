"""The actuator that `export_modelica` writes: as it comes, against the FMU of the same model, and in other units."""

import re
from dataclasses import replace
from pathlib import Path

import bench
import exported
import fmpy
import library
import numpy as np
import pytest
import simulate
from click.testing import CliRunner
from invoked import invoked
from stacks import OPTIONS, SHEET, as_it_comes, demo, knee, slopes

import hystfmu as hy
from hystfmu import Graph, Input, InputError, Node, Output
from hystfmu.cli import main
from hystfmu.modelica.actuator.mechanics import COUPLING, PIEZO, Sheet
from hystfmu.modelica.actuator.slot import thinned

BOUND = 5e-3  # |actuator - FMU| / span, at 5 Hz: what the load and the relaxation add to the model
QUICK = ("actuator", "preisach, static", "zhao_tan_mlp")
STATIC = [k for k in OPTIONS if not k.startswith("g0_")]  # a mode of the model is not that of the sheet


def written(key: str, tmp_path: Path) -> Path:
    package = demo(key).export_modelica(tmp_path / "Piezo", sheet=SHEET)
    assert exported.complaints(package) == []
    return package


def parameter(package: Path, name: str) -> float:
    found = re.search(rf"\b{name} = ([-\d.e+]+)", (package / "Actuator.mo").read_text())
    assert found, name
    return float(found[1])


def under_sine(package: Path, tau: float = 5e-5) -> dict[str, np.ndarray]:
    """A free actuator for a period of 5 Hz, from the voltage at which its memory rests; slow enough to solve fast."""
    start = parameter(package, "v_start")
    text = f"""model Bench
{bench.FEED}
  HystFMU.Sources.Sine command(amplitude = 45, offset = {start!r}, frequency = 5);
  Feed drive(R = 150);
  HystFMU.Plants.Fixed wall;
  Piezo.Actuator actuator(tau = {tau!r});
equation
  connect(command.r, drive.u);
  connect(drive.p, actuator.pin_p);
  connect(drive.n, actuator.pin_n);
  connect(wall.flange, actuator.flange_a);
end Bench;
"""
    return simulate.solve_text(text, 0.2, 1e-3, 1e-9, packages=(library.ROOT, package)).instants()


@pytest.mark.turn("exported actuators")
@pytest.mark.some(1)
@pytest.mark.parametrize("key", [pytest.param(k, marks=() if k in QUICK else pytest.mark.stress) for k in STATIC])
def test_the_actuator_follows_the_fmu_of_its_model(key: str, tmp_path: Path) -> None:
    """Position in metres against the output of the FMU in micrometres, for the voltage behind the leads."""
    package = written(key, tmp_path)
    v = under_sine(package)
    model = demo(key)
    fmu = model.export(tmp_path / "m.fmu")
    rows = np.array(list(zip(v["time"], v["actuator.v"], strict=True)), dtype=[("time", float), ("u", float)])
    found = fmpy.simulate_fmu(
        str(fmu), input=rows, output=["y"], start_values={"u": v["actuator.v"][0]},
        stop_time=v["time"][-1], step_size=model.step, output_interval=model.step,
    )  # fmt: skip
    y = np.interp(v["time"], found["time"] - model.step, found["y"]) * 1e-6  # a step from t takes the input at t
    inner = slice(1, -2)
    error = np.abs(v["actuator.flange_b.s"] - y)[inner].max() / np.ptp(y)
    print(f"{key}: {error:.1e} of the span, {np.ptp(y):.2e} m")
    assert np.ptp(y) > 2e-5
    assert error <= BOUND


def off_model(model: hy.Model, v: dict[str, np.ndarray]) -> float:
    """Largest |actuator - model| / span, the model at a step far below that of its record."""
    t = np.arange(0, v["time"][-1], h := 5e-5)
    y = np.interp(v["time"], t, model.predict(np.interp(t, v["time"], v["actuator.v"]), h).reshape(-1)) * 1e-6
    return float(np.abs(v["actuator.flange_b.s"] - y)[1:-2].max() / np.ptp(y))


@pytest.mark.stress
def test_the_difference_is_that_of_the_relaxation(tmp_path: Path) -> None:
    """A lag of tau behind the rate of a sine: halving tau halves what is left, but for rounded corners."""
    package, model = written("prandtl_ishlinskii", tmp_path), demo("prandtl_ishlinskii")
    errors = [off_model(model, under_sine(package, tau)) for tau in (1e-4, 5e-5)]
    assert errors[0] > 1e-3
    assert errors[1] == pytest.approx(errors[0] / 2, rel=0.1)


@pytest.mark.stress
@pytest.mark.parametrize("behind", ["input.y", "operator.z"])
def test_a_lag_of_two_steps_beside_a_knee_stays(behind: str, tmp_path: Path) -> None:
    """Its weight is that of the input: a lag that acts at once differs by 1.7 % of the span."""
    graph = knee().graph
    lag = Node("lag", "creep", {"n": 1}, {"w0": 0.0, "w": [1.0], "T": [2e-3]})
    k = [10.0, -5.0, 10.0] if behind == "input.y" else [20.0, -12.0, 10.0]
    total = Node("readout", "sum", {"n": 3}, {"k": k, "offset": 20.0})
    wires = [*graph.wires, (behind, "lag.u"), ("lag.y", "readout.u[3]")]
    model = replace(knee(), graph=Graph([*graph.nodes[:2], lag, total], wires, graph.inputs, graph.outputs))
    package = model.export_modelica(tmp_path / "Piezo", sheet=SHEET)
    error = off_model(model, under_sine(package))
    print(f"{behind}: {error:.1e} of the span")
    assert error <= BOUND


@pytest.mark.stress
@pytest.mark.parametrize("n", [3.2, 20.0])
def test_a_sharp_knee_stays_in_its_bound(n: float, tmp_path: Path) -> None:
    """The values that a fit of the built-in stack finds, and the sharpest knee, at the settings of the example."""
    beta, gamma = 19.1, 4.9
    v = as_it_comes(knee(-9.0, beta, gamma, n).export_modelica(tmp_path / "Piezo"))
    bound = (beta + gamma) ** (-1 / n)
    z = np.abs(v["actuator.hysteresis.z"]).max()
    print(f"n = {n}: abs(z) up to {z / bound} of its bound")
    assert 0.9 * bound < z <= (1 + 1e-6) * bound


def test_the_data_sheet_gives_stiffness_and_capacitance(tmp_path: Path) -> None:
    """Blocked at 100 V from 0 V, the force is the stiffness of the sheet times the stroke of the model."""
    package = written("prandtl_ishlinskii", tmp_path)
    k_short = SHEET["blocking_force"] / SHEET["stroke"]
    C, share, k = (parameter(package, n) for n in ("C", "share", "k"))
    stroke, v_max = (parameter(package, n) for n in ("stroke", "v_max"))
    assert pytest.approx(1.6 * 4e-6) == C
    h = share * C  # charge of the polarisation per volt
    d = stroke / (h * v_max)
    assert 1 / (d**2 * h + 1 / k) == pytest.approx(k_short)


def test_the_mass_does_not_depend_on_critical_damping(tmp_path: Path) -> None:
    """Two equal poles, between the poles of a little less and a little more damping."""
    mass = []
    for zeta in (0.99, 1.0, 1.01):
        package = demo("prandtl_ishlinskii").export_modelica(
            tmp_path / f"P{len(mass)}", sheet=SHEET | {"damping": zeta}
        )
        mass.append((parameter(package, "m"), parameter(package, "c")))
    assert mass[1] == pytest.approx(np.mean([mass[0], mass[2]], axis=0), rel=1e-4)


def test_what_no_sheet_says_is_that_of_a_soft_ceramic() -> None:
    """PI Ceramic, Piezo Material Data, PIC255: d33, s33, relative permittivity, k33; a stack of 5 x 5 x 36 mm."""
    d33, s33, eps33, k33 = 400e-12, 20.7e-12, 1750 * 8.8542e-12, 0.69
    assert pytest.approx(d33**2 / (s33 * eps33), rel=0.01) == COUPLING
    assert pytest.approx(k33**2, rel=0.06) == COUPLING
    assert 0.5 < PIEZO.stiffness * s33 * 36e-3 / 25e-6 < 1
    ratio = 38e-6 * 900 / (3.1e-6 * 120**2 * k33**2)
    assert pytest.approx(ratio, rel=0.02) == Sheet().capacitance_ratio


@pytest.mark.stress
def test_a_model_in_metres_gives_the_same_actuator(tmp_path: Path) -> None:
    """Thresholds and corners are relative: nothing in the way has a size of its own."""
    data = hy.synthetic.piezo(60, 1000.0)
    metres = hy.Dataset(t=data.t, u=data.u / 1000, y=data.y * 1e-6, unit_u="kV", unit_y="m")
    a = written("prandtl_ishlinskii", tmp_path / "um")
    fitted = hy.fit(metres, "prandtl_ishlinskii", **OPTIONS["prandtl_ishlinskii"])
    b = fitted.export_modelica(tmp_path / "m" / "Piezo", sheet=SHEET)
    x, y = (under_sine(p)["actuator.flange_b.s"] for p in (a, b))
    assert np.ptp(x) > 2e-5
    assert np.abs(x - y).max() <= 1e-6 * np.ptp(x)


def test_a_bend_with_fewer_knots_goes_through_those_that_are_left() -> None:
    rng = np.random.default_rng(seed := int(np.random.default_rng().integers(2**31)))
    r, w = np.sort(rng.uniform(-1, 1, 100)), rng.uniform(-0.02, 0.03, 100)

    def bent(v: np.ndarray, at_0: float, w0: float, r: np.ndarray, w: np.ndarray) -> np.ndarray:
        side = np.where(r > 0, np.maximum(v[:, None] - r, 0), np.minimum(v[:, None] - r, 0))
        return at_0 + w0 * v + side @ w

    fewer = thinned(1.0, r, w)
    outside = np.array([-3.0, 3.0])
    for v in (fewer[2], outside):
        assert np.abs(bent(v, 0.0, 1.0, r, w) - bent(v, *fewer)).max() < 1e-12, seed


@pytest.mark.parametrize(("sheet", "says"), [
    ({"stroke": 1e-5}, "both stroke and blocking_force"),
    ({"stiffness": 1.0}, "no value 'stiffness'"),
    ({"resonance": -1.0}, "'resonance' of a data sheet must be a float in"),
    ({"capacitance": 1e-9}, "must exceed"),
])  # fmt: skip
def test_a_wrong_data_sheet_is_one_line(sheet: dict[str, float], says: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=re.escape(says)) as refused:
        demo("prandtl_ishlinskii").export_modelica(tmp_path / "Piezo", sheet=sheet)
    assert "\n" not in str(refused.value)
    assert not (tmp_path / "Piezo").exists()


def test_the_command_writes_the_actuator(tmp_path: Path) -> None:
    demo("prandtl_ishlinskii").save(tmp_path / "piezo.model.toml")
    command = ["export", str(tmp_path / "piezo.model.toml"), "--modelica", str(tmp_path)]
    given = [x for k, v in SHEET.items() for x in ("--sheet", f"{k}={v!r}")]
    done = invoked(command + given)
    assert "Piezo.ActuatorExample" in done.output
    direct = written("prandtl_ishlinskii", tmp_path / "direct")
    texts = [(p / "Actuator.mo").read_text().split("\n", 1)[1] for p in (tmp_path / "Piezo", direct)]
    assert texts[0] == texts[1]
    wrong = CliRunner().invoke(main, [*command, "--sheet", "stroke=wide"])
    assert wrong.exit_code != 0
    assert "'stroke' of a data sheet must be a float" in wrong.output


def test_a_model_without_volts_has_no_actuator(tmp_path: Path) -> None:
    t = np.arange(400) * 1e-3
    data = hy.Dataset(t=t, u=np.sin(30 * t), y=np.sin(30 * t - 0.2))
    model = hy.fit(data, "prandtl_ishlinskii", N=4)
    assert not (model.export_modelica(tmp_path / "Plain") / "Actuator.mo").exists()
    with pytest.raises(InputError, match="must map a voltage or a current"):
        model.export_modelica(tmp_path / "Plain", sheet=SHEET)


@pytest.mark.parametrize(
    ("falls", "slope", "rises", "name"),
    [(knee(-20.0), r"-6\.67", knee(), "BoucWen"), (slopes(3.0), r"-1\.71", slopes(), "Duhem")],
)
def test_a_loop_that_falls_after_a_reversal_is_no_stack(
    falls: hy.Model, slope: str, rises: hy.Model, name: str, tmp_path: Path
) -> None:
    """Its charge would fall while the voltage rises: of the knee 20 - 20 * 4/3 after a reversal."""
    assert not (falls.export_modelica(tmp_path / "Falls") / "Actuator.mo").exists()
    with pytest.raises(InputError, match=f"must rise with the input on every branch. Got a slope of {slope} after"):
        falls.export_modelica(tmp_path / "Falls", sheet=SHEET)
    text = (rises.export_modelica(tmp_path / "Rises") / "Actuator.mo").read_text()
    assert f"redeclare HystFMU.Actuators.Hysteresis.{name}" in text


def test_a_lone_block_is_no_stack(tmp_path: Path) -> None:
    """A block without a size n."""
    graph = Graph(
        [Node("b", "bouc_wen_oscillator")], [], [Input("u", ("b.u",), unit="V")], [Output("y", "b.y", unit="m")]
    )
    package = hy.Model("bouc_wen_oscillator", graph, 1e-3).export_modelica(tmp_path / "Plain")
    assert not (package / "Actuator.mo").exists()
