"""The scenario of a device and its cases: reference, feed-forward, controller, inverse, limits, delay and plant.

The feedback acts in front of the inverse, u = H^-1(v + C(z) (r - y)), where v is the feed-forward of the dynamics. The
plant makes `FINE` steps in each step of the controller. A sum of sines represents the error of the model on the record,
and a noise source represents the sensor noise. Devices with changed parameters represent the uncertainty that the
record leaves.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hystfmu.design.feedforward import Preview
from hystfmu.design.plants import LEAST_SPREAD, LESS_DAMPED, SIGMAS, Plant
from hystfmu.design.race import Tuned
from hystfmu.face.scenario import Scenario
from hystfmu.face.table import What
from hystfmu.graph import Graph, Input, Node, Output, blocks
from hystfmu.start.device import FINE, Device, plant_model
from hystfmu.start.promise import Misfit
from hystfmu.start.references import Tried
from hystfmu.start.requirements import Requirements

GAIN = 0.2  # by which the gain of a drawn device differs
BEYOND = 0.05  # of the range: how far the command of the controller may leave the range of the output
SHAPING = 2.5  # times below the first natural frequency, or below the band: how fast a jump is followed
FASTEST = 20  # steps in the time constant of a shaped jump, at least
CONTROLLER = "controller"


@dataclass(frozen=True)
class Draw:
    """A device that agrees with the record. `late` is its delay in steps beyond the delay of the design."""

    name: str
    text: str
    plant: Plant
    gain: float = 1.0
    late: int = 0


def draws(found: Device) -> tuple[Draw, ...]:
    """Return the devices that are simulated in addition to the identified device.

    Each of these devices has worst-case values of gain and modes, an additional delay, or a resonance that the record
    did not excite.
    """
    p = found.plant
    made = [Draw("two_steps", "one step of delay more than in the design", p, 1.0, 1)]
    for k, side in ((1 + GAIN, "up"), (1 - GAIN, "down")):
        if not p.f_n:
            made.append(Draw(side, f"gain {100 * (k - 1):+.0f} %", p, k, 1))
            continue
        for sign, speed in ((-1, "slow"), (1, "fast")):
            f_n = tuple(
                f + sign * max(SIGMAS * e[0], LEAST_SPREAD * f) for f, e in zip(p.f_n, found.errors, strict=True)
            )
            other = replace(p, f_n=f_n, zeta=tuple(LESS_DAMPED * z for z in p.zeta))
            change = 100 * (f_n[0] / p.f_n[0] - 1)
            text = f"gain {100 * (k - 1):+.0f} %, modes {change:+.1f} % and less damped, one step of delay more"
            made.append(Draw(f"{side}_{speed}", text, other, k, 1))
    if found.unseen is not None:
        u = found.unseen
        for n, f in enumerate(u.frequencies(found.h)[:9:4], 1):
            other = u.added(p, float(f), p.delay, f"a resonance at {f:.3g} Hz")
            made.append(Draw(f"unseen_{n}", f"a resonance at {f:.4g} Hz that the record did not excite", other))
    return tuple(made)


@dataclass(frozen=True)
class LoopPlan:
    """Parts of the scenario of a loop: device, feed-forward of its dynamics, model error, references, requirements.

    The scenario has one case for each reference in `tried`. The cases with other devices use the first reference.
    """

    found: Device
    ahead: Preview
    missed: Misfit
    tried: tuple[Tried, ...]
    asked: Requirements
    name: str

    @property
    def command(self) -> str:
        """Name of the signal that is applied to the input of the device."""
        return "delay.y" if self.asked.delay else "limits.y"

    def scenario(self, tuned: Tuned | None, limits: Mapping[str, float], slower: float = 1.0) -> Scenario:
        """Build the scenario with a controller, or without feedback if `tuned` is None. The scenario is not simulated.

        `limits` contains the largest allowed RMS error of each case in percent of the stroke. The time constant of the
        filter for references with jumps is multiplied by `slower`.
        """
        found, first, missed = self.found, self.tried[0], self.missed
        title = f"{tuned.structure.text} in front of the inverse" if tuned else "feed-forward and inverse, no feedback"
        text = f"{self.name}: {title}"
        loop = Scenario(self.name, step=found.h, stop=float(f"{first.stop:.12g}"), text=text, ripple=FINE)
        loop.add("plant", plant_model(found), fine=True, text="the identified device; d: error of the model")
        loop.add("reference", self._leading(first), fine=True, text="reference, also some steps ahead")
        text = f"tones of the residual of the record, {missed.rms:.3g} RMS"
        loop.add("misfit", missed.tones(first.frequency, 1, first.strength), fine=True, text=text)
        loop.add("noise", blocks.Noise(sigma=float(f"{found.noise:.4g}")), text="noise of the sensor, as in the record")
        loop.add("sensor", blocks.Sum(k=[1.0, 1.0]))
        loop.add("feedforward", self._feedforward(), text="inverse of the dynamics, a few steps ahead")
        loop.add(CONTROLLER, controller(found, tuned), text=title)
        loop.add("inverse", found.inverse)
        low, high = found.commands
        loop.add("limits", blocks.Scaling(lo=low, hi=high), text="range of the input")
        if self.asked.delay:
            loop.add("delay", _late(found, self.asked.delay), text="time for computing")
            loop.connect("limits.y", "delay.u")
        y = f"plant.{found.output}"
        for source, target in (
            ("misfit.r", "plant.d"),
            (y, "sensor.u_1"),
            ("noise.w", "sensor.u_2"),
            ("reference.r_lead", "feedforward.u"),
            ("feedforward.y", "controller.u_ff"),
            ("reference.r", "controller.y_d"),
            ("sensor.y", "controller.y"),
            ("controller.u", f"inverse.{found.inverse.graph.inputs[0].name}"),
            (f"inverse.{found.inverse.graph.outputs[0].name}", "limits.u"),
            (self.command, f"plant.{found.input}"),
        ):
            loop.connect(source, target)
        stroke = float(f"{2 * first.amplitude:.6g}")
        counted: dict[str, Any] = {"signal": y, "against": "reference.r", "stroke": stroke, "after": first.after}
        loop.metric("tracking", "rms_percent", **counted, text="percent of the stroke")
        loop.metric("worst", "max_percent", **counted, text="percent of the stroke")
        loop.record("reference.r", y, self.command).loop("reference.r", y)
        self._add_cases(loop, limits, slower)
        if tuned is None:
            return loop
        corners, sector = [d.name for d in draws(found)], found.slopes
        return loop.margins(case=first.name, Ms_db=self.asked.ms, corners=corners, slopes=sector, stable_to_steps=0.0)

    def _add_cases(self, loop: Scenario, limits: Mapping[str, float], slower: float) -> None:
        """Add cases for references and other devices, and two comparisons: without feedback, and without inverse."""
        found = self.found
        bounds = {name: {"tracking": limit} for name, limit in limits.items()}
        for t in self.tried:
            text = f"{t.shape}, {1 / t.frequency:.3g} s a level" if t.jumps else f"{t.shape} of {t.frequency:.4g} Hz"
            misfit = self.missed.tones(t.frequency, 1, t.strength)
            units: dict[str, What] = {"reference": self._leading(t), "misfit": misfit}
            connections = {}
            if t.jumps:
                units |= {"shaping": shaping(found, slower), "shaping_lead": shaping(found, slower)}
                connections = {
                    "shaping.u": "reference.r",
                    "shaping_lead.u": "reference.r_lead",
                    "controller.y_d": "shaping.y",
                    "feedforward.u": "shaping_lead.y",
                }
            changed: dict[str, Any] = {"stop": t.stop, "after": t.after, "units": units, "connections": connections}
            loop.case(t.name, text, **changed, limits=bounds.get(t.name))
        delay = self.asked.delay
        inserted = {} if delay else {"delay.u": "limits.y", f"plant.{found.input}": "delay.y"}
        for d in draws(found):
            late = {"delay": _late(found, delay + d.late)} if d.late else {}
            units = {"plant": plant_model(found, d.plant, d.gain), **late}
            connections = inserted if late else {}
            loop.case(d.name, d.text, units=units, connections=connections, limits=bounds.get(d.name))
        lo, hi = found.commands
        gain = (hi - lo) / (found.high - found.low) * (-1 if found.falling else 1)
        straight = blocks.Scaling(gain=gain, offset=(lo + hi) / 2 - gain * (found.low + found.high) / 2)
        alone = controller(found, None)
        loop.case("inverse_only", "for comparison: without feedback", units={CONTROLLER: alone})
        loop.case("neither", "for comparison: a gain alone", units={CONTROLLER: alone, "inverse": straight})

    def _feedforward(self) -> Graph:
        """Return the feed-forward: a filter for the zeros of the plant, and a weighted sum of its last outputs.

        Before the first sample, the device is at rest.
        """
        ahead = self.ahead
        dims = {"n_u": len(ahead.taps), "n_f": 0, "n_y": 0, "q": 1, "n_k": 0}
        taps = Node("taps", "polynomial_narx", dims, {"theta": [*ahead.taps.tolist(), 0.0]})
        first = [ahead.zeros] if ahead.zeros is not None else []
        wires = [(f"{n.name}.y", "taps.u") for n in first]
        inputs = [Input("u", (f"{(first or [taps])[0].name}.u",), start=self.found.rest)]
        return Graph([*first, taps], wires, inputs, [Output("y", "taps.y")], sort=False)

    def _leading(self, tried: Tried) -> blocks.Reference:
        """Return a reference block whose output r_lead is ahead by the preview time of the feed-forward."""
        node, lead = tried.block.node, self.ahead.lead * self.found.h
        given: dict[str, Any] = {**node.dims, **node.values, "lead": float(f"{lead:.12g}")}
        return blocks.Reference(**given)


def controller(found: Device, tuned: Tuned | None) -> Graph:
    """Return the controller with inputs y_d, y, u_ff and output u. If `tuned` is None, the output is u_ff."""
    over = BEYOND * (found.high - found.low)
    limits = found.low - over, found.high + over
    if tuned is not None:
        return tuned.structure.graph(tuned.design, tuned.values, tuned.Ki, limits)
    pid = Node("pid", "pid", {}, {"Kp": 0.0, "u_min": limits[0], "u_max": limits[1]})
    ends = {"y_d": "wanted output", "y": "measured output", "u_ff": "feed-forward"}
    inputs = [Input(name, (f"pid.{name}",), text=text) for name, text in ends.items()]
    return Graph([pid], [], inputs, [Output("u", "pid.u", text="command")])


def shaping(found: Device, slower: float = 1.0) -> Node:
    """Return a critically damped filter for references with jumps, slower than the known dynamics of the device."""
    known = [f / SHAPING for f in found.plant.f_n] + [found.band / SHAPING] * (found.band > 0 and not found.plant.f_n)
    f = min([*known, 1 / (FASTEST * found.h)])
    f = max(f, 2 * found.frequency) / slower
    w = 2 * np.pi * f
    values: dict[str, Any] = {"b": [1.0], "a": [1 / w**2, 2 / w, 1.0], "hold": "foh", "start": "steady"}
    return Node("shaping", "transfer_function", {"na": 2, "nb": 0}, values)


def _late(found: Device, n: int) -> blocks.Delay:
    """Return a delay of the command by n steps. Its initial output is the initial input of the model."""
    return blocks.Delay(n=n, y0=float(found.model.graph.inputs[0].start))
