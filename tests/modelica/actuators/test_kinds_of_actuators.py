"""Every static kind in the slot of an actuator, untouched and under loads, and one line for each that has none."""

import re
from dataclasses import replace
from pathlib import Path

import exported
import library
import numpy as np
import pytest
import simulate
import stacks
from invoked import invoked

import hystfmu as hy

QUICK = ("prandtl_ishlinskii", "zhao_tan_mlp")
KINDS = [pytest.param(k, marks=() if k in QUICK else pytest.mark.stress) for k in stacks.OPTIONS]
LOADS = {"light": 0.1, "equal": 1.0, "heavy": 10.0}  # times the own mass


ROD_QUICK = ("jiles_atherton, strain", "prandtl_ishlinskii")
RODS = [pytest.param(k, marks=() if k in ROD_QUICK else pytest.mark.stress) for k in stacks.ROD_KINDS]


def runs_as_it_comes(package: Path, key: str) -> None:
    assert exported.complaints(package) == []
    v = stacks.as_it_comes(package)
    off = np.ptp(v["actuator.residual"]) / np.ptp(v["actuator.supplied"])
    print(f"{key}: {np.ptp(v['load.s']):.2e} m, balance {off:.1e}")
    assert np.ptp(v["load.s"]) > 1e-5
    assert off <= 1e-5


@pytest.mark.turn("exported actuators")
@pytest.mark.some(1)
@pytest.mark.parametrize("key", KINDS)
def test_an_actuator_of_a_record_without_a_mode_has_no_mass_and_runs(key: str, tmp_path: Path) -> None:
    """The record of the stack ends at 18 Hz: without a data sheet the example is as it comes, and quasi-static."""
    package = stacks.demo(key).export_modelica(tmp_path / "Piezo")
    text = (package / "Actuator.mo").read_text()
    assert "withMass = false" in text
    assert not re.search(r"\n    m = ", text)
    runs_as_it_comes(package, key)


@pytest.mark.stress
@pytest.mark.parametrize("key", RODS)
def test_an_exported_rod_runs_as_it_comes(key: str, tmp_path: Path) -> None:
    package = stacks.rod(key).export_modelica(tmp_path / "Piezo")
    assert "BaseClasses.Magnetostrictive(" in (package / "Actuator.mo").read_text()
    runs_as_it_comes(package, key)


@pytest.mark.stress
@pytest.mark.parametrize("key", KINDS)
def test_an_actuator_with_a_mass_runs_under_loads(key: str, tmp_path: Path) -> None:
    """A tenth, one and ten times the own mass, each at the settings of the example."""
    package = stacks.demo(key).export_modelica(tmp_path / "Piezo", sheet=stacks.SHEET)
    m = float(re.search(r"\n    m = ([-\d.e+]+)", (package / "Actuator.mo").read_text())[1])
    file = package / "Loads.mo"
    parts = [f"  ActuatorExample {name}(load(m = {ratio * m!r}));\n" for name, ratio in LOADS.items()]
    file.write_text(f"within Piezo;\nmodel Loads\n  import HystFMU;\n{''.join(parts)}end Loads;\n")
    found = simulate.as_stated(file, "Piezo.Loads", (library.ROOT, package), of=package / "ActuatorExample.mo").values
    for name in LOADS:
        s, f = found[f"{name}.load.s"], found[f"{name}.actuator.residual"]
        off = np.ptp(f) / np.ptp(found[f"{name}.actuator.supplied"])
        print(f"{key}, {name}: {np.ptp(s):.2e} m, balance {off:.1e}")
        assert np.isfinite(s).all()
        assert np.ptp(s) > 1e-5
        assert off <= 1e-5


REFUSED = {
    "polynomial_narx": (exported.OPTIONS["polynomial_narx"], "the block polynomial_narx has dynamics"),
    "rate_mlp": ({**exported.QUICK, "N": 4}, "the block differentiator has dynamics"),
}


@pytest.mark.parametrize("key", REFUSED)
def test_a_kind_without_an_actuator_says_why_in_one_line(key: str, tmp_path: Path) -> None:
    """Without a data sheet, too."""
    options, why = REFUSED[key]
    t = 1e-3 * np.arange(600)
    u = 50 + 40 * np.sin(30 * t) * np.exp(-t)
    data = hy.Dataset(t=t, u=u, y=0.3 * u - 0.01 * np.gradient(u, t), unit_u="V", unit_y="um")
    hy.fit(data, key, **options).save(tmp_path / "m.model.toml")
    done = invoked(["export", str(tmp_path / "m.model.toml"), "--modelica", str(tmp_path / "out")])
    lines = [line for line in done.output.splitlines() if line.startswith("no actuator: ")]
    assert len(lines) == 1
    assert why in lines[0]


def test_a_literal_memory_has_no_actuator(tmp_path: Path) -> None:
    """memory = last drifts: no plays stand for it."""
    model = stacks.demo("zhao_tan_mlp")
    literal = model.graph.replace(model.graph.node("operator").with_values(memory="last"))
    last = replace(model, graph=literal)
    assert not (last.export_modelica(tmp_path / "Last") / "Actuator.mo").exists()
    with pytest.raises(hy.InputError, match="zhao_tan with memory = last drifts"):
        last.export_modelica(tmp_path / "Again", sheet=stacks.SHEET)
