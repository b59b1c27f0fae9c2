"""The loop of the demonstration: an identified actuator behind its inverse, with integral feedback and corners."""

from __future__ import annotations

from typing import Any

from hystfmu.face.scenario import Scenario
from hystfmu.graph.blocks import Delay, Noise, Pid, Sum
from hystfmu.model import Model

SHARE = 0.1  # of an error that one step of the integral takes away: far below what the delay of the loop allows
CORNERS: dict[
    str, tuple[str, dict[str, Any], float]
] = {  # text, what differs from the identified device, limit of the RMS error in % of the stroke
    "nominal": ("the identified device", {}, 0.02),
    "wider": ("hysteresis wider by 20 %", {"plant.hysteresis_w": "*1.2"}, 0.5),
    "narrower": ("hysteresis narrower by 20 %", {"plant.hysteresis_w": "*0.8"}, 0.5),
    "stronger": ("stroke larger by 10 %", {"plant.readout_gain": "*1.1"}, 0.5),
    "weaker": ("stroke smaller by 10 %", {"plant.readout_gain": "*0.9"}, 0.5),
    "creeping": ("twice the creep", {"plant.creep_w": "*2"}, 0.1),
    "noisy": ("sensor noise of 20 nm RMS", {"noise.sigma": 0.02}, 0.05),
}


def loop(model: Model, inverse: Model) -> Scenario:
    """Return the scenario. Its reference is a sine over 80 % of the stroke; it has seven cases.

    Parameters
    ----------
    model : Model
        Model of the kind `actuator`. Its step is the step of the loop.
    inverse : Model
        Inverse of `model`. It needs the reference some steps ahead. Therefore the loop compares the output with the
        reference delayed by these steps.
    """
    h = float(model.step or 1e-3)
    late = 1 + int(inverse.fit.get("lag_steps", 0))  # the command acts in the next step
    made = Scenario("loop", step=h, text="inverse and integral feedback")
    made.add("plant", model, fine=True).add("noise", Noise(sigma=0.0)).add("sensor", Sum(n=2))
    made.add("wanted", Delay(n=late)).add("pid", Pid(Kp=0.0, Ki=SHARE / h)).add("inverse", inverse)
    made.connect("plant.y", "sensor.u_1").connect("noise.w", "sensor.u_2").connect("sensor.y", "pid.y")
    made.connect("reference.r", "wanted.u").connect("wanted.y", "pid.y_d").connect("reference.r", "pid.u_ff")
    made.connect("pid.u", "inverse.u").connect("inverse.y", "plant.u")
    made.metric(
        "tracking", "rms_percent", "plant.y", against="wanted.y", text="RMS error of the displacement, % of the stroke"
    )
    made.loop("wanted.y", "plant.y").loop("inverse.y", "plant.y")
    for name, (text, different, limit) in CORNERS.items():
        made.case(name, text, set=different, limits={"tracking": limit})
    return made.margins(case="nominal", Ms_db=6.0)
