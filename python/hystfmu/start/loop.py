"""The scenario of a device: reference, feed-forward, PI controller, inverse, one step of delay, plant; its cases.

The feedback acts inside the inverse, u = H^-1(v + C(z) (r - y)), where v is the feed-forward of the dynamics.  The
limits are what is asked for, not what a run reaches.
"""

from __future__ import annotations

import math

import numpy as np

from hystfmu.face.model import Model
from hystfmu.face.scenario import Scenario
from hystfmu.graph import blocks
from hystfmu.inverse.input_range import input_range
from hystfmu.start.device import COMPUTING, PERIODS, Device, behind_hold, corners
from hystfmu.start.tuning import MS_DB, SLOPES, Gains

STROKE = 0.8  # share of the range of the output that references use
SETTLED = 2  # periods of a reference before metrics count
CORNER = 5.0  # times the error that is asked for, where the device differs from the model
REVERSALS = 12


def loop_scenario(found: Device, gains: Gains, percent: float, name: str, other: Model | None = None) -> Scenario:
    """Build the scenario.

    Parameters
    ----------
    found : Device
    gains : Gains
        Of the PI controller.
    percent : float
        Largest RMS error that is asked for, in percent of the stroke.
    name : str
        Of the scenario.
    other : Model, optional
        A model of another kind of the same data, which stands for the device in one case.

    Returns
    -------
    Scenario
        Not run yet.
    """
    stroke = STROKE * (found.high - found.low)
    offset = (found.high + found.low) / 2
    period = 1 / found.frequency
    stop, after = (math.ceil(n * period / found.h) * found.h for n in (PERIODS, SETTLED))
    ahead = found.lag_steps + COMPUTING + 1
    phase = math.asin(float(np.clip((found.rest - offset) / (stroke / 2), -1, 1)))
    loop = Scenario(
        name, step=found.h, stop=float(f"{stop:.12g}"), text=f"PI controller in front of the inverse of {name}"
    )
    loop.add("plant", found.model, text="the fitted model stands for the device, behind a held command")
    loop.add(
        "reference",
        blocks.Reference(
            m=REVERSALS,
            amplitude=stroke / 2,
            offset=offset,
            frequency=found.frequency,
            phase=phase,
            lead=ahead * found.h,
        ),
        text=f"{100 * STROKE:g} % of the range of the output",
    )
    wanted = "reference.r_lead"
    if found.ahead is not None:
        loop.add("feedforward", found.ahead, text="inverse of the dynamics, a few samples ahead")
        loop.connect(wanted, "feedforward.u")
        wanted = "feedforward.y"
    loop.add("pid", blocks.Pid(Kp=gains.Kp, Ki=gains.Ki), text="acts inside the inverse")
    loop.add("inverse", found.inverse)
    loop.add("delay", _late(found, COMPUTING), text="one step for computing")
    y = f"plant.{found.model.graph.outputs[0].name}"
    for source, target in (
        (wanted, "pid.u_ff"),
        ("reference.r", "pid.y_d"),
        (y, "pid.y"),
        ("pid.u", f"inverse.{found.inverse.graph.inputs[0].name}"),
        (f"inverse.{found.inverse.graph.outputs[0].name}", "delay.u"),
        ("delay.y", f"plant.{found.model.graph.inputs[0].name}"),
    ):
        loop.connect(source, target)
    size = float(f"{stroke:.6g}")
    loop.metric("tracking", "rms_percent", y, "reference.r", stroke=size, after=after, text="percent of the stroke")
    loop.metric("worst", "max_percent", y, "reference.r", stroke=size, after=after, text="percent of the stroke")
    loop.record("reference.r", y, "delay.y")
    loop.loop("reference.r", y)
    _cases(loop, found, percent, other)
    return loop.margins(
        case="sine", Ms_db=MS_DB, corners=[name for name, *_ in corners(found)], slopes=SLOPES, stable_to_steps=1.0
    )


def _cases(loop: Scenario, found: Device, percent: float, other: Model | None) -> None:
    """Add what the loop has to stand, and for comparison what it does without its parts."""
    asked, wider = {"tracking": percent}, {"tracking": CORNER * percent}
    f = f"{found.frequency:g} Hz"
    nested = {"reference.shape": "random_reversals", "reference.seed": 1}
    loop.case("sine", f"{f}, the rate of the references", limits=asked)
    loop.case("nested", f"random nested reversals at {f}", set=nested, limits=asked)
    triangle = {"reference.shape": "triangle", "reference.turn": 0.2}
    loop.case("triangle", f"triangle of {f}, a fifth of it turn-arounds", set=triangle, limits=asked)
    late = {"delay": _late(found, COMPUTING + 1)}
    loop.case("two_steps", "one step of delay that the design does not know of", units=late, limits=wider)
    for name, text, plant in corners(found):
        loop.case(name, text, units={"plant": plant}, limits=wider)
        loop.case(f"{name}_two_steps", f"{text}, one step of delay more", units={"plant": plant, **late}, limits=wider)
    if other is not None:
        loop.case(
            "other_kind", f"{other.key} of the same data as plant", units={"plant": behind_hold(other)}, limits=wider
        )
    off = {"pid.Kp": 0.0, "pid.Ki": 0.0}
    loop.case("inverse_only", "for comparison: without feedback", set=off)
    lo, hi = input_range(found.model, "A loop must have the input range of its model")
    gain = (hi - lo) / (found.high - found.low) * (-1 if found.falling else 1)
    straight = blocks.Scaling(gain=gain, offset=(lo + hi) / 2 - gain * (found.low + found.high) / 2)
    loop.case("no_inverse", "for comparison: feedback and a gain instead of the inverse", units={"inverse": straight})
    loop.case("neither", "for comparison: a gain alone", set=off, units={"inverse": straight})


def _late(found: Device, n: int) -> blocks.Delay:
    """Delay the command by n steps; until the first one comes the device rests."""
    return blocks.Delay(n=n, y0=float(found.model.graph.inputs[0].start))
