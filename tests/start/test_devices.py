"""The devices that judge `start`: closed forms of their parts, the controller of a scenario, loops that oscillate."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from start.devices import loop as loops
from start.devices.device import Device, Simulated, draw
from start.devices.judge import on_device

import hystfmu as hy

LINEAR: dict[str, Any] = {"w0": 1.0, "r": (), "w": (), "q2": 0.0, "q3": 0.0, "share": (), "tau": (), "delay": 0.0}


def _device(**changes: Any) -> Device:
    plain = {"low": 0.0, "high": 2.0, "gain": 1.0, "offset": 0.0, "noise": 0.0, "modes": ((100.0, 0.05, 1.0),)}
    return replace(draw(0, 0), **{**LINEAR, **plain, **changes})


def test_a_mode_has_its_step_response() -> None:
    f, zeta, h = 100.0, 0.05, 1e-3
    y = Simulated(_device(), h, 1.0).run(np.full(200, 1.5))
    w, damped = 2 * np.pi * f, 2 * np.pi * f * np.sqrt(1 - zeta**2)
    t = h * np.arange(200)
    wanted = np.exp(-zeta * w * t) * (np.cos(damped * t) + zeta * w / damped * np.sin(damped * t))
    assert np.allclose(y, 0.5 * (1 - wanted), atol=1e-12)


def test_a_delay_is_stated_in_steps_of_the_loop() -> None:
    u = np.random.default_rng(0).uniform(0.2, 1.8, 300)
    prompt, late = (Simulated(_device(delay=d), 1e-3, float(u[0])).run(u) for d in (0.0, 2.0))
    assert np.allclose(late[2:], prompt[:-2], atol=1e-12)
    assert np.all(late[:2] == prompt[0])


def test_plays_and_creep_come_to_their_closed_forms() -> None:
    """Far up and back by less than twice the threshold: the play stays; creep adds its share in the end."""
    device = _device(w0=0.5, r=(0.3,), w=(0.5,), share=(0.04,), tau=(0.05,))
    plant = Simulated(device, 1e-3, 1.0)
    y = plant.run(np.repeat([1.8, 1.4], 2000))
    assert y[1999] == pytest.approx(1.04 * (0.5 * 0.8 + 0.5 * 0.5), abs=1e-9)
    assert y[-1] == pytest.approx(1.04 * (0.5 * 0.4 + 0.5 * 0.5), abs=1e-9)


@pytest.fixture(scope="module")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Integral control of a resonance of 100 Hz, damping .05, at 1 kHz: Ki up to 2 zeta w = 62.8 1/s is stable."""
    folder = tmp_path_factory.mktemp("loop")
    made = hy.Scenario("loop", step=1e-3, stop=3.0)
    w = 2 * np.pi * 100
    made.add("plant", hy.blocks.TransferFunction(b=[1.0], a=[1 / w**2, 0.1 / w, 1.0], hold="zoh"))
    made.add("reference", hy.blocks.Reference(amplitude=0.4, offset=1.0, frequency=5.0))
    made.add("noise", hy.blocks.Noise(sigma=0.3)).add("sensor", hy.blocks.Sum(k=[1.0, 1.0]))
    made.add("pid", hy.blocks.Pid(Ki=10.0))
    for source, target in (
        ("plant.y", "sensor.u_1"),
        ("noise.w", "sensor.u_2"),
        ("sensor.y", "pid.y"),
        ("reference.r", "pid.y_d"),
        ("reference.r", "pid.u_ff"),
        ("pid.u", "plant.u"),
    ):
        made.connect(source, target)
    made.metric("tracking", "rms_percent", "plant.y", "reference.r", after=0.4).loop("reference.r", "plant.y")
    made.case("sine")
    made.case("inverse_only", set={"pid.Ki": 0.0})
    for name, Ki in (("soft", 1.0), ("hard", 200.0)):
        made.case(name, set={"pid.Ki": Ki})
    return made.save(folder)


def test_the_controller_gives_the_rows_of_its_scenario(loop: Path) -> None:
    """Around a device that is the plant, without the noise of the scenario."""
    run = loops.Controller(loops.cases_of(loop)["sine"]).drive(_device(offset=1.0), 1.0, np.random.default_rng(0))
    made = hy.Scenario.load(loop).run("sine", engine="native", set={"noise.sigma": 0.0}).trace
    assert made is not None
    assert (made["reference.r"] == run.r).all()
    late = slice(2600, None)  # the scenario's plant begins at 0, the device at rest under 1 V
    assert np.abs(made["plant.y"] - run.y)[late].max() < 1e-6


@pytest.mark.parametrize(("name", "stable"), [("soft", True), ("sine", True), ("hard", False)])
def test_a_loop_that_oscillates_is_seen(loop: Path, name: str, stable: bool) -> None:
    wanted = [{"name": name, "shape": "sine", "amplitude": 0.4, "rms_percent": None, "bound_percent": None}]
    found = on_device(loop, wanted, _device(offset=1.0, noise=1e-4), 1.0, np.random.default_rng(1))
    assert bool(found["unstable"]) != stable, json.dumps(found)
