"""Every key of METHODS on a plant that shares no code with the package, tested on the held-out signals.

The plants are in numpy (`plants.py`); Bouc-Wen is integrated by scipy's RK45, while the core integrates in u.  Limits
are the worst RMS error in percent of the span of the training data after short training, with a margin.  The target
errors are in test_heldout.py.
"""

from pathlib import Path

import plants
import pytest

from hystfmu import Dataset
from hystfmu.data import signals
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
    "bouc_wen_oscillator": ("test_benchmarks", "test_grey_box_oscillator_recovers_a_plant_of_another_integrator"),
    "duhem_oscillator": ("test_duhem_oscillator", "test_a_plant_of_another_integrator_on_other_signals"),
    "auto": ("test_benchmarks", "test_s3_bouc_wen_is_picked_and_holds_on_other_signals"),
}


def test_no_key_is_left_out():
    assert {*ON, *ELSEWHERE} == set(METHODS)
    for module, name in ELSEWHERE.values():
        (file,) = TESTS.rglob(f"{module}.py")
        text = file.read_text()
        assert f"def {name}(" in text, f"{module}.{name}"


LONG = ("bouc_wen", "duhem")


@pytest.mark.parametrize("key", [pytest.param(k, marks=pytest.mark.stress) if k in LONG else k for k in ON])
def test_a_key_on_an_independent_plant(key):
    plant, limit, options = ON[key]
    u = signals.training(40, 1)
    data = Dataset.from_signal(u, plant(u))
    found = accuracy.held_out_table(fit(data, key, **options), plant, data.span)
    worst = max(e["rms_percent"] for e in found.values())
    print(f"{key}: {worst:.3g} %")
    assert worst <= limit
