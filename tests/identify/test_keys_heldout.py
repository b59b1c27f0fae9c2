"""Every key of METHODS on a plant that shares no code with the package, tested on the held-out signals.

The plants are in numpy (`plants.py`); Bouc-Wen is integrated by scipy's RK45, while the core integrates in u.  Limits
are the worst RMS error in percent of the span of the training data after short training, with a margin.  The target
errors follow below.
"""

from pathlib import Path

import numpy as np
import plants
import pytest

from hystfmu import Dataset, signals
from hystfmu.identify import METHODS, fit
from hystfmu.model import accuracy

SHORT = {"starts": 1, "iterations": 40}
ON = {  # key: plant, limit, options
    "prandtl_ishlinskii": (plants.prandtl_ishlinskii, 0.1, {}),
    "zhao_tan_mlp": (plants.asymmetric, 1.2, SHORT),
    "constraint_factor_mlp": (plants.asymmetric, 0.6, SHORT),
    "fitted_operator_mlp": (plants.asymmetric, 0.3, SHORT),
    "play_bank_mlp": (plants.asymmetric, 0.5, SHORT),
    "krasnoselskii_pokrovskii": (plants.asymmetric, 0.8, {}),
    "preisach": (plants.asymmetric, 0.5, {"widths": 20, "means": 6}),
    "polynomial_narx": (plants.prandtl_ishlinskii, 2.0, {}),
    "bouc_wen": (plants.bouc_wen, 0.03, {}),
    "bouc_wen_parallel": (plants.bouc_wen, 0.03, {"degree": 1, "rate": "no"}),
    "duhem": (plants.bouc_wen, 0.05, {}),
}
TESTS = Path(__file__).parents[1]
ELSEWHERE = {  # dynamics, by another rule or step than the core's in that test
    "rate_mlp": ("test_rate", "test_a_rate_is_no_memory"),
    "actuator": ("test_actuator", "test_plants_of_its_class"),
    "g0_prandtl_ishlinskii": ("test_rate", "test_the_dynamics_are_recovered_and_hold_on_other_signals"),
    "g0_bouc_wen": ("test_g0_bouc_wen", "test_hysteresis_and_dynamics_are_recovered_and_hold_on_other_signals"),
    "g0_jiles_atherton": ("test_foreign_devices", "test_a_magnetic_device_about_a_bias"),
    "narx_network": ("test_benchmarks", "test_narx_network_on_an_oscillator_with_a_bouc_wen_force"),
    "bouc_wen_oscillator": ("test_oscillator_searches", "test_a_plant_of_another_integrator"),
    "duhem_oscillator": ("test_duhem_oscillator", "test_a_plant_of_another_integrator_on_other_signals"),
    "lugre": ("test_friction", "test_a_foreign_device_to_the_noise_of_its_record"),
    "maxwell_slip_oscillator": ("test_friction", "test_a_foreign_device_to_the_noise_of_its_record"),
    "modified_bouc_wen": ("test_damper", "test_the_numbers_of_a_damper_are_found_in_units_of_measure"),
    "auto": ("test_auto", "test_each_class_of_memory"),
}


def test_no_key_is_left_out():
    assert {*ON, *ELSEWHERE} == set(METHODS)
    for module, name in ELSEWHERE.values():
        (file,) = TESTS.rglob(f"{module}.py")
        text = file.read_text()
        assert f"def {name}(" in text, f"{module}.{name}"


LONG = ("bouc_wen", "duhem")


@pytest.mark.turn("held-out records")
@pytest.mark.some(2)
@pytest.mark.parametrize("key", [pytest.param(k, marks=pytest.mark.stress) if k in LONG else k for k in ON])
def test_a_key_on_an_independent_plant(key):
    plant, limit, options = ON[key]
    u = signals.training(40, 1)
    data = Dataset.from_signal(u, plant(u))
    found = accuracy.held_out_table(fit(data, key, **options), plant, data.span)
    worst = max(e["rms_percent"] for e in found.values())
    print(f"{key}: {worst:.3g} %")
    assert worst <= limit


# ---- target errors ---------------------------------------------------------------------------------------------------
# The defaults of the methods were tuned on these signals, plants and measured rows: the tests guard against regression
# and prove nothing for other plants.  `bench_identify.py` counts how many fresh plants meet S2.
def table(key, plant, **options):
    u = signals.training(150, 1)
    data = Dataset.from_signal(u, plant(u))
    return accuracy.held_out_table(fit(data, key, **options), plant, data.span)


@pytest.mark.stress
def test_s1_replica_of_zhao_and_tan():
    """2-12-1 on (x, h), ten backlash operators, decaying sine in [-1, 1], virgin branch excluded: paper 0.026735."""
    u = signals.decaying_sine(10, 0.1)
    y = plants.plays(u, np.linspace(0.1, 1, 10) / 2).sum(axis=1)
    data = Dataset.from_signal(u, y / np.abs(y).max(), train=slice(50, None))
    fits = [fit(data, "zhao_tan_mlp", seed=seed).fit for seed in range(3)]
    assert {f["parameters"] for f in fits} == {49}
    assert np.median([f["max"] for f in fits]) <= 0.0267
    assert np.median([f["rms"] for f in fits]) <= 0.006


@pytest.mark.stress
@pytest.mark.parametrize("plant", [plants.prandtl_ishlinskii, plants.asymmetric])
def test_s2_bank_of_plays_and_network(plant):
    errors = table("play_bank_mlp", plant)
    nested = errors.pop("nested reversals")
    assert nested["rms_percent"] <= 0.1
    assert nested["max_percent"] <= 0.5
    for name, e in errors.items():
        assert e["rms_percent"] <= 0.2, name
        assert e["max_percent"] <= 0.8, name


@pytest.mark.stress
@pytest.mark.parametrize("plant", [plants.prandtl_ishlinskii, plants.asymmetric])
def test_s2_operator_and_network(plant):
    dominant, last = (table("zhao_tan_mlp", plant, memory=m)["nested reversals"] for m in ("dominant", "last"))
    assert dominant["rms_percent"] <= 1.0
    assert last["rms_percent"] >= 10 * dominant["rms_percent"]


@pytest.mark.stress
def test_s3_bouc_wen_grey_box():
    """A Bouc-Wen plant integrated by scipy's RK45: at most 0.03 %FS; a sum of plays cannot represent it."""
    for name, e in table("bouc_wen", plants.bouc_wen).items():
        assert e["rms_percent"] <= 0.03, name
    assert table("prandtl_ishlinskii", plants.bouc_wen)["nested reversals"]["rms_percent"] > 2


@pytest.mark.turn("held-out records")
def test_sums_of_plays():
    """The model class of the plant, with thresholds off the grid: the error is that of the grid."""
    for name, e in table("prandtl_ishlinskii", plants.prandtl_ishlinskii).items():
        assert e["rms_percent"] <= 0.06, name
    for name, e in table("prandtl_ishlinskii", plants.prandtl_ishlinskii, N=400).items():
        assert e["rms_percent"] <= 0.002, name
