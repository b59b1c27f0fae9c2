"""Mass and damping of an exported actuator: those of a known mode, and none where the mode is not known."""

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import bench
import exported
import library
import numpy as np
import pytest
import simulate
from invoked import invoked
from scipy.optimize import least_squares
from scipy.signal import lfilter

import hystfmu as hy

F_N, ZETA = 300.0, 0.1  # of the device
STACK = {"stroke": 40e-6, "blocking_force": 800.0, "capacitance": 4e-6}
SHEET = {**STACK, "resonance": 2000.0, "damping": 0.05}
KINDS = {"g0_prandtl_ishlinskii": {"N": 8}, "actuator": {"N": 8, "creep": "no", "bend": 1, "dynamics": "yes"}}


def record(highest: float, noise: float) -> hy.Dataset:
    """A sum of ten plays with a mode behind it, under tones up to `highest` (Hz), in numpy at a tenth of the step."""
    h, finer, rng = 1e-4, 10, np.random.default_rng(1)
    t = np.arange(6000 * finer) * h / finer
    f = np.geomspace(5, highest, 9)
    tones = 20 / (1 + f / 40) * np.sin(2 * np.pi * np.outer(t, f) + rng.uniform(0, 6, 9))
    u = 50 + tones.sum(axis=1) * np.minimum(1, t / 0.02)
    x = (u - 50) / 50
    y = 20 * (0.3 * x + 0.07 * hy.synthetic.plays(x, np.linspace(0.05, 0.5, 10)).sum(axis=1))
    w, s = 2 * np.pi * F_N, 2 * finer / h  # bilinear rule at the fine step
    den = np.array([s * s + 2 * ZETA * w * s + w * w, 2 * (w * w - s * s), s * s - 2 * ZETA * w * s + w * w])
    y = lfilter(w * w * np.array([1.0, 2.0, 1.0]), den, y)[::finer]
    y = y + rng.normal(0, noise, len(y))
    return hy.Dataset(t=t[::finer], u=u[::finer], y=y, unit_u="V", unit_y="um")


@cache
def fitted(key: str, highest: float = 700.0, noise: float = 0.002) -> hy.Model:
    return hy.fit(record(highest, noise), key, **KINDS[key])


def ringing(package: Path, ratio: float, f: float) -> tuple[float, float]:
    """Natural frequency and damping ratio of what is left of a small velocity, under `ratio` times the own mass."""
    text = (package / "Actuator.mo").read_text()
    m, start = (float(re.search(rf"\b{k} = ([-\d.e+]+)", text)[1]) for k in ("m", "v_start"))
    load = f"  HystFMU.Plants.SpringMassLoad load(m = {float(ratio * m)!r}, c = 0, k = 0);\n" if ratio else ""
    joined = "  connect(load.flange, actuator.flange_b);\n" if ratio else ""
    bench_text = f"""model Bench
{bench.FEED}  Feed feed(R = 0);
  HystFMU.Plants.Fixed wall;
  Piezo.Actuator actuator(inertia(v_start = 1e-4));
{load}equation
  feed.u = {start!r};
  connect(feed.p, actuator.pin_p);
  connect(feed.n, actuator.pin_n);
  connect(wall.flange, actuator.flange_a);
{joined}end Bench;
"""
    v = simulate.solve_text(bench_text, 3 / f, 0.01 / f, 1e-10, packages=(library.ROOT, package)).values
    t, s = v["time"], v["actuator.flange_b.s"]
    s = (s - s[0]) / np.abs(s - s[0]).max()

    def rest(q: np.ndarray) -> np.ndarray:
        w, zeta, a, b, c = q
        damped = w * np.sqrt(abs(1 - zeta**2))
        return np.exp(-zeta * w * t) * (a * np.cos(damped * t) + b * np.sin(damped * t)) + c - s

    near = [2 * np.pi * f * 1.05, 0.1, 0.0, 1.0, 0.0]
    found = least_squares(rest, near, x_scale=[2 * np.pi * f, 0.1, 1, 1, 1], xtol=1e-12, ftol=1e-12)
    return found.x[0] / (2 * np.pi), found.x[1]


@pytest.mark.turn("exported actuators")
@pytest.mark.some(1)
@pytest.mark.parametrize("sheet", [None, STACK], ids=["assumed", "sheet"])
@pytest.mark.parametrize("key", KINDS)
def test_an_exported_actuator_has_the_identified_mode(key: str, sheet: dict[str, float] | None, tmp_path: Path) -> None:
    """With every mass that it was identified with, and in short circuit: to 1 %, whatever stiffness it has."""
    model = fitted(key)
    assert model.fit["f_n"] == pytest.approx(F_N, rel=0.02)
    assert model.fit["f_n_se"] < 0.02 * F_N
    package = model.export_modelica(tmp_path / "Piezo", sheet=sheet)
    assert exported.complaints(package) == []
    f, zeta = ringing(package, 0, F_N)
    print(f"{key}: f_n {f:.3f} for {model.fit['f_n']:.3f} Hz, damping {zeta:.5f} for {model.fit['zeta']:.5f}")
    assert f == pytest.approx(model.fit["f_n"], rel=0.01)
    assert zeta == pytest.approx(model.fit["zeta"], rel=0.01)


@pytest.mark.stress
def test_an_exported_actuator_has_the_mode_of_its_data_sheet(tmp_path: Path) -> None:
    package = fitted("g0_prandtl_ishlinskii").export_modelica(tmp_path / "Piezo", sheet=SHEET)
    f, zeta = ringing(package, 0, SHEET["resonance"])
    print(f"sheet: f_n {f:.2f} Hz, damping {zeta:.5f}")
    assert f == pytest.approx(SHEET["resonance"], rel=0.01)
    assert zeta == pytest.approx(SHEET["damping"], rel=0.01)


@pytest.mark.stress
@pytest.mark.parametrize("ratio", [0.1, 1.0, 10.0])
def test_a_load_adds_to_the_own_mass_and_not_to_the_damping(ratio: float, tmp_path: Path) -> None:
    """m s^2 + c s + k = 0 with the same k and c: f_n falls with the root of the mass, the damping ratio too."""
    model = fitted("g0_prandtl_ishlinskii")
    package = model.export_modelica(tmp_path / "Piezo", sheet=STACK)
    expected = model.fit["f_n"] / np.sqrt(1 + ratio)
    f, zeta = ringing(package, ratio, expected)
    print(f"load of {ratio} times the mass: f_n {f:.2f} for {expected:.2f} Hz, damping {zeta:.5f}")
    assert f == pytest.approx(expected, rel=0.01)
    assert zeta == pytest.approx(model.fit["zeta"] / np.sqrt(1 + ratio), rel=0.02)


@pytest.mark.stress
def test_an_unknown_mode_gives_no_mass(tmp_path: Path) -> None:
    """Tones up to a fifteenth of the resonance, in noise."""
    model = fitted("g0_prandtl_ishlinskii", 20.0, 0.3)
    print(f"f_n = {model.fit['f_n']:.4g} Hz with a standard error of {model.fit.get('f_n_se')} Hz")
    assert not model.fit.get("f_n_se", np.inf) < 0.1 * model.fit["f_n"]
    model.save(tmp_path / "piezo.model.toml")
    command = ["export", str(tmp_path / "piezo.model.toml"), "--modelica", str(tmp_path)]
    done = invoked(command)
    assert "no mass, because f_n = " in done.output
    assert "stiffness assumed, 2e+07 N/m" in done.output
    text = (tmp_path / "Piezo" / "Actuator.mo").read_text()
    assert "withMass = false" in text
    assert not re.search(r"\n    m = ", text)
    command[-1] = str(tmp_path / "sheet")
    named = [*command, *(x for k, v in SHEET.items() for x in ("--sheet", f"{k}={v!r}"))]
    done = invoked(named)
    assert "kg and damping from the data sheet, resonance 2000 Hz, damping ratio 0.05" in done.output
    assert "withMass" not in (tmp_path / "sheet" / "Piezo" / "Actuator.mo").read_text()


@pytest.mark.turn("exported actuators")
def test_an_older_model_file_does_not_say_how_well_its_mode_is_known(tmp_path: Path) -> None:
    model = fitted("g0_prandtl_ishlinskii")
    older = {k: v for k, v in model.fit.items() if not k.endswith("_se")}
    package = replace(model, fit=older).export_modelica(tmp_path / "Piezo")
    assert "does not state its standard error" in (package / "Actuator.mo").read_text()
