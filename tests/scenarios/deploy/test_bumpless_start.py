"""A controller that is given the command so far takes over without a jump, and then is the loop's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from called import Called

import hystfmu as hy

ROOT = Path(__file__).parents[3]
SCENARIOS = ["pid", "internal_model", "repetitive", "h_infinity", "sliding_mode_2005", "stage/irc_repetitive"]
# nothing in these reads the command; where its limits are read, the hand-over is a part of the history
UNTOLD = ("pid", "sliding_mode_2005", "stage/irc_repetitive")


def controller(scenario: str, folder: Path, fmi: int = 2) -> Called:
    fmu = hy.Scenario.load(ROOT / "scenarios" / scenario).export_controller(folder / "c.fmu", fmi)  # type: ignore[arg-type]
    return Called(fmu, folder / "called")


def measured(called: Called, n: int) -> list[dict[str, float]]:
    """Smooth inputs; none of them stands still."""
    t = called.h * np.arange(n)
    columns = {"r": np.sin(60 * t), "y": 0.9 * np.sin(60 * t - 0.1), "r_ahead": np.sin(60 * t + 0.01)}
    columns |= {"r_dot": 60 * np.cos(60 * t), "feedforward_r": np.sin(60 * t + 0.01)}
    known = {name: column for name, column in columns.items() if name in called.inputs}
    return [dict(zip(known, row, strict=True)) for row in np.column_stack(list(known.values())).tolist()]


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("scenario", SCENARIOS)
def test_first_command_is_the_one_that_acts(scenario: str, fmi: int, tmp_path: Path) -> None:
    called = controller(scenario, tmp_path, fmi)
    n = 1200  # the hand-over takes 1000 steps
    rows = measured(called, n)
    own = np.array([called.start(rows[0]), *map(called.sample, rows[1:])])
    for present in np.random.default_rng().uniform(-0.9, 0.9, 2).tolist():
        called.slave.reset()
        got = np.array([called.start(rows[0] | {"u_present": present}), *map(called.sample, rows[1:])])
        assert got[:2] == pytest.approx([present, present], abs=1e-12)  # the initialisation and the first step
        assert np.abs(np.diff(got)).max() <= 1.05 * np.abs(np.diff(own)).max() + abs(present - own[1]) / 1000 + 1e-9
        if scenario in UNTOLD:
            assert got[1010:].tobytes() == own[1010:].tobytes()
    called.close()


def test_a_command_may_be_given_at_any_step(tmp_path: Path) -> None:
    called = controller("pid", tmp_path)
    rows = measured(called, 1500)
    own = np.array([called.start(rows[0]), *map(called.sample, rows[1:])])
    called.slave.reset()
    called.start(rows[0])
    got = np.array(
        [
            called.read(),
            *(called.sample(row | ({"u_present": -0.4} if k >= 300 else {})) for k, row in enumerate(rows[1:], 1)),
        ]
    )
    assert got[:300].tobytes() == own[:300].tobytes()
    assert got[300] == pytest.approx(-0.4, abs=1e-12)
    # on a straight line to the own command
    left = (got - own)[300:1301] / (got - own)[300]
    assert left == pytest.approx(1 - np.arange(1001) / 1000, abs=1e-9)
    assert got[1300:].tobytes() == own[1300:].tobytes()
    called.close()


def test_time_of_the_hand_over_is_tunable(tmp_path: Path) -> None:
    called = controller("pid", tmp_path)
    assert float(called.variables["handover_T"].start) == pytest.approx(1000 * called.h)
    rows = measured(called, 60)
    own = np.array([called.start(rows[0]), *map(called.sample, rows[1:])])
    called.slave.reset()
    called.write({"handover_T": 20 * called.h})
    got = np.array([called.start(rows[0] | {"u_present": 0.5}), *map(called.sample, rows[1:])])
    assert np.flatnonzero(got != own)[-1] == pytest.approx(20, abs=1)
    called.close()


@pytest.mark.parametrize("given", [True, False])
def test_a_device_at_rest_stays_there(given: bool, tmp_path: Path) -> None:
    """A lag held at 0.6 by a command that its controller does not know of; its feed-forward would start at 0."""
    h, gain = 1e-3, 0.8
    loop = hy.Scenario("lag", step=h, stop=0.1)
    loop.add("plant", hy.blocks.Scaling(gain=gain)).add("reference", hy.blocks.Reference(frequency=10.0))
    loop.add("pid", hy.blocks.Pid(Kp=0.0, Ki=40.0), inputs={"u_ff": 0.0}).add("delay", hy.blocks.Delay(n=1))
    loop.connect("reference.r", "pid.y_d").connect("plant.y", "pid.y").connect("pid.u", "delay.u")
    loop.connect("delay.y", "plant.u").metric("tracking", "rms_percent", "plant.y", against="reference.r")
    called = Called(loop.export_controller(tmp_path / "c.fmu"), tmp_path / "called")
    y, u = 0.6, 0.6 / gain
    rows = {"r": 0.6} | ({"u_present": u} if given else {})
    called.start(rows | {"y": y})
    error = []
    for _ in range(3000):
        command = called.sample(rows | {"y": y})
        y += h / 0.01 * (gain * u - y)  # with the step of computing time
        u = command
        error.append(abs(y - 0.6))
    called.close()
    assert error[-1] < 1e-6
    # a straight line of 0.75 per second disturbs an integral of 40 1/s by 0.75 / 40; without it the device falls to 0
    assert max(error) < 1.1 * 0.75 / 40 if given else max(error) > 0.3


def test_a_stage_in_the_middle_of_its_stroke(tmp_path: Path) -> None:
    """A new controller takes over a stage with hysteresis, creep and modes, which another one holds at 10 um."""
    fmu = hy.Scenario.load(ROOT / "scenarios/stage/integral_notch").export_controller(tmp_path / "c.fmu")

    def moved(given: bool) -> float:
        """Largest error after the change (um)."""
        stage = hy.Model.load(ROOT / "scenarios/stage/models/plant.model.toml").unit()
        stage.initialize(0.0, u=0.0)
        old, new = (Called(fmu, tmp_path / f"{word}{given}") for word in ("old", "new"))
        y, u, fine, errors = 0.0, old.start({"r": 0.0, "y": 0.0}), 0, []
        for k in range(6000):
            wanted = min(10.0, 10.0 * k / 2000)
            if k == 4000:
                new.start({"r": wanted, "y": y} | ({"u_present": u} if given else {}))
            command = (old if k < 4000 else new).sample({"r": wanted, "y": y})
            stage.set("u", u)  # for the step of computing time
            for _ in range(10):
                stage.do_step(fine * 1e-5, 1e-5)
                fine += 1
            y, u = stage.get("y"), command
            if k >= 4000:
                errors.append(abs(y - wanted))
        old.close()
        new.close()
        return max(errors)

    assert moved(given=True) < 0.5  # 5 % of the way to 0, which its first own command takes
    assert moved(given=False) > 5.0
