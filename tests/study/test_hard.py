"""Ranges of damping, second mode and gain that the records state: devices inside, drawn now, and devices beyond."""

import math
import secrets
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import hard_table
import numpy as np
import pytest
from scripts import loaded

from hystfmu.base.errors import InputError
from hystfmu.scenario import Cases, build
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.studies.spec import Study
from hystfmu.studies.task import sampler

SCENARIOS = Path(__file__).parents[2] / "scenarios"
LOOPS = sorted(f.parent.relative_to(SCENARIOS).as_posix() for f in SCENARIOS.glob("**/hard.study.toml"))
QUICK = ("internal_model", "pid", "stage/irc", "stage/ppf")
DRAWS = 10  # of 30 rows
STABLE = sorted(f.parent.relative_to(SCENARIOS).as_posix() for f in SCENARIOS.glob("**/stable.study.toml"))


def some(names: list[str]) -> list[Any]:
    """The others are stress tests."""
    return [pytest.param(n, marks=() if n in QUICK else pytest.mark.stress) for n in names]


def recorded(name: str) -> dict[str, Any]:
    return hard_table.recorded("stage" if name.startswith("stage/") else "loops")[name.removeprefix("stage/")]


def script(name: str) -> ModuleType:
    """A script of scenarios/models."""
    folder = str(SCENARIOS / "models")
    if folder not in sys.path:
        sys.path.insert(0, folder)
    return loaded(SCENARIOS / "models" / f"{name}.py", name)


def system(name: str, case: str, settings: dict[str, Any], stop: float | None = None) -> Any:
    found = next(c for c in Cases(SCENARIOS / name / "hard.toml", settings).cases if c.name == case)
    return build(found if stop is None else replace(found, stop=stop))


def error(name: str, case: str, settings: dict[str, Any], stop: float | None = None) -> float:
    """RMS error in the last half of a run, % of the stroke."""
    made = system(name, case, settings, stop)
    try:
        run = Native(made, ["plant.y", "reference.r"]).run()
    except Stopped:
        return np.inf
    e = (run["plant.y"] - run["reference.r"])[len(run.t) // 2 :]
    stroke = 20.0 if name.startswith("stage/") else 2.0
    with np.errstate(over="ignore"):
        return float(100 * np.sqrt(np.mean(e**2)) / stroke)


def stable(name: str, case: str, settings: dict[str, Any]) -> bool:
    """The poles of the loop of a device, for small signals: the gain of its modes over the one that is known."""
    late, whole = math.modf(settings.get("delay.n", 1))
    opened = open_loop(system(name, case, {**settings, "delay.n": int(whole)}), (1.0, 1.0))
    (static,) = [settings[k] for k in ("plant.static_gain", "plant.bend_theta") if k in settings] or [1.0]
    gain = float(str(static).removeprefix("*"))
    first = 0.9 if name.startswith("stage/") else 1.0
    return opened.stable(gain * (first + settings.get("plant.g0_k_2", 1 - first)), late)


@pytest.mark.turn("designs of a study")
@pytest.mark.some(1)
@pytest.mark.parametrize("name", some(STABLE))
def test_draws_of_today_inside_the_stated_ranges_are_stable(name: str) -> None:
    study = Study(SCENARIOS / name / "stable.study.toml")
    study.seed = secrets.randbelow(2**31)
    (rows,) = sampler(study).batches()
    for row in rows[:DRAWS]:
        settings = study.settings(row)
        for case in study.cases:
            assert error(name, case.name, settings) < 25.0, (study.seed, row)
        assert stable(name, study.cases[0].name, settings), (study.seed, row)


@pytest.mark.parametrize("name", some(LOOPS))
def test_devices_beyond_are_unstable(name: str) -> None:
    """One quantity two to four times beyond the value at which the loop breaks, drawn now, by poles and simulated."""
    breaks = recorded(name)["breaks"]
    assert breaks
    case = "small" if name.startswith("stage/") else "nominal"
    rng = np.random.default_rng()
    for what, value in breaks.items():
        beyond = float(value * rng.uniform(2.0, 4.0) ** (1 if what.endswith("above") else -1))
        settings: dict[str, Any] = {}
        match what.rpartition("_")[0], name.startswith("stage/"):
            case "damping", _:
                settings["plant.g0_zeta_1"] = beyond
            case "second_mode", _:
                settings["plant.g0_k_2"] = beyond
            case "gain", True:
                settings["plant.bend_theta"] = f"*{beyond!r}"
            case _:
                settings["plant.static_gain"] = beyond
        assert not stable(name, case, settings), (what, beyond)


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["pid", "internal_model", "repetitive", "h_infinity"])
def test_a_light_or_a_second_mode_is_lost_in_the_simulation(name: str) -> None:
    """The devices that the issue names: damping 0.02, and 5 % of the gain at 1500 Hz with damping 0.01."""
    for case in ("damping_2", "second_mode"):
        assert recorded(name)["cases"][case] == np.inf
        assert error(name, case, {}) > 50.0


def test_a_slow_sensor_and_jitter_do_what_they_say() -> None:
    """A lag of 1 kHz in an otherwise perfect loop: the sensor reads what a first-order lag gives; delays of 8 to 12."""
    made = system("pid", "sensor_lag", {})
    run = Native(made, ["plant.y", "sensor.y"]).run()
    h, y, tau = 1e-4, run["plant.y"][::10], 1 / (2 * np.pi * 1000)
    a, x = np.exp(-h / tau), np.zeros(len(y))
    for k in range(1, len(y)):  # exact for an input on straight lines
        slope = (y[k] - y[k - 1]) / h
        x[k] = y[k] - slope * tau + (x[k - 1] - y[k - 1] + slope * tau) * a
    assert np.abs(run["sensor.y"][::10] - x).max() <= 1e-9
    run = Native(system("pid", "jitter", {}), ["inverse.y", "delay.y"]).run()
    u, late = run["inverse.y"][::10], run["delay.y"]
    changes = np.flatnonzero(np.diff(late)) + 1
    found = set()
    for k in range(20, len(u) - 20):
        (place,) = [c for c in changes if 10 * k + 5 <= c < 10 * k + 15] or [None]
        if place is not None:
            found.add(int(place) - 10 * k)
    assert found == {8, 9, 10, 11, 12}
    with pytest.raises(InputError, match=r"The delays of delay must be in series to have margins\."):
        open_loop(system("pid", "jitter", {}))


@pytest.mark.some(1)
@pytest.mark.parametrize("name", some(LOOPS))
def test_recorded_errors_are_those_of_the_scenarios(name: str) -> None:
    assert script("run_hard").cases(name) == pytest.approx(recorded(name)["cases"], rel=1e-6)


@pytest.mark.parametrize("name", STABLE)
def test_the_study_of_a_range_states_what_is_recorded(name: str) -> None:
    found, study = recorded(name)["range"], Study(SCENARIOS / name / "stable.study.toml")
    gain = "plant.bend_theta" if name.startswith("stage/") else "plant.static_gain"
    for key, what in (("plant.g0_zeta_1", "damping"), ("plant.g0_k_2", "second_mode"), (gain, "gain")):
        assert study.parameters[key].bounds == pytest.approx(found[what], rel=1e-3, abs=1e-6)
        (lo, hi), (a, b) = found[what], found[f"drawn_{what}"]
        assert a <= lo <= hi <= b
    assert (found["draws"], found["unstable"]) == (1000, 0)


def test_every_loop_has_its_record_and_a_range_or_an_unstable_draw() -> None:
    for name in LOOPS:
        assert (name in STABLE) == (recorded(name)["range"]["unstable"] == 0), name
    of = {family: set(hard_table.recorded(family)) for family in hard_table.RECORDS}
    assert of["loops"] | {f"stage/{n}" for n in of["stage"]} == set(LOOPS)
