"""Effect of the switching terms: the record of run_switching.py, computed anew and compared with what pages say."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest
import switching_table

ROOT = Path(__file__).parents[3]
LAWS = ("sliding_mode_2005", "sliding_mode", "super_twisting")


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("run_switching", ROOT / "scenarios" / "models" / "run_switching.py")
    assert spec is not None
    assert spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("plant", ["backlash", "bouc_wen"])
def test_the_record_is_what_its_script_computes(script: ModuleType, law: str, plant: str) -> None:
    where, unit, block, gains = script.linear()[law]
    error = script.worst(where, plant, "100", unit, block, gains)
    assert error == pytest.approx(switching_table.recorded()[law][plant]["100"], rel=1e-5)


@pytest.mark.parametrize("law", LAWS)
def test_no_law_is_30_percent_better_than_its_linear_law_or_the_pid(law: str) -> None:
    """Else the pages must not call it a PD or PID."""
    for plant in switching_table.PLANTS:
        for signal in switching_table.SIGNALS:
            error = switching_table.worst(law, plant, signal)
            assert error > 0.7 * switching_table.recorded()[law][plant][signal]
            assert error > 0.7 * switching_table.worst("pid", plant, signal)
    assert switching_table.LOOPS[law].endswith(("(PD)", "(PID)"))


def test_the_readme_states_the_figures() -> None:
    law, linear, pid = (
        f"{v:.2f}"
        for v in (
            switching_table.worst("sliding_mode", "backlash", "100"),
            switching_table.recorded()["sliding_mode"]["backlash"]["100"],
            switching_table.worst("pid", "backlash", "100"),
        )
    )
    said = " ".join((ROOT / "README.md").read_text().split())
    assert (
        f"the error of the sliding mode with integral action is {law} %. With a linear term instead of the switching "
        f"term it is {linear} %, and for the best PID {pid} %." in said
    )


@pytest.mark.parametrize("scenario", ["pid", "pid_observer"])
def test_no_drawn_law_is_30_percent_better_than_both(script: ModuleType, scenario: str) -> None:
    """Than its linear law and than the tuned loop; drawn anew, too."""
    assert switching_table.recorded()[f"drawn_{scenario}"]["smallest_to_both"] > 0.7
    assert script.draws(scenario, 2, seed=7)["smallest_to_both"] > 0.7
