"""Splits a fitted model into the parts that a loop needs: hysteresis with inverse, and linear dynamics.

The dynamics are estimated from the record (`hystfmu.identify.evidence`) and not taken from the fitted model. The record
does not determine a natural frequency outside the band in which input and output are coherent. In this case the plant
is static, with a possible resonance at any frequency above the band.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.data import Dataset
from hystfmu.data.reversals import reversals, turning_points
from hystfmu.design.feedforward import transfer_function
from hystfmu.design.plants import SIGMAS, UNSEEN_SHARE, UNSEEN_ZETA, Plant, Unseen
from hystfmu.design.sector import static_gain
from hystfmu.face.fit import evidence_of
from hystfmu.face.model import Model
from hystfmu.graph import Graph, Input, Node
from hystfmu.graph.recursion import discretised
from hystfmu.identify.evidence import Evidence, Mode
from hystfmu.inverse.dynamic import Parts, split
from hystfmu.inverse.ports import at_start, input_range, over_range
from hystfmu.model import beside, run_along

PERIODS = 4  # of the reference in a run
SAMPLES = 100  # steps of the loop in a period of the references, at least
LONGEST = 20_000  # and at most
DYNAMICS = "transfer_function"
DYNAMICS_NAME = "dynamics"  # of the block behind the hysteresis; a fit has names of its own
SHARE_KNOWN, FREQUENCY_KNOWN = 0.1, 0.05  # standard errors of a mode that a loop relies on, of 1 and of f_n
SHARES = (0.6, 1.2)  # static gain of all modes over that of the device
CLEAR = 0.8  # coherence of a point of the response that is looked at
FLAT, DESCRIBED = 0.22, 0.7  # abs(ln) of the response over that of a plant without and with modes: a quarter, twice
RATE = 1e-3  # of a step: the response of the plant without its hold
SLOPES = (0.68, 1.64)  # of plant over inverse, of a model that follows its record: gain 20 % off and thresholds 10 %
PARTS, LEAST_PART = 40, 50  # of a record in which the gain is compared: number, rows
FOLLOWED = 1.1  # ratio of output and model in a part, and its inverse, up to which a model follows
HEARD = 10.0  # times the noise: the RMS of a part that shows a gain
BELOW = 0.7  # of the natural frequency: highest mean frequency of such a part
SHOWN = 0.1  # quantile of the swings between reversals that counts as the smallest swing of a record
LEVELS, SMALL = (-0.6, -0.2, 0.2, 0.6), 1e-3  # middle of swings, and amplitude of small ones, in half ranges
SWING = 400  # steps of the way to a level, and of half a swing
LARGE = 0.2  # of the range of the input: a reversal of a stroke
FINE = 5  # steps of the plant in one of the controller
UNKNOWN_DELAY = 2.0  # steps by which a device may be later if the record does not show its delay
KNOWN_RESONANCE = 0.1  # a resonance that the user states is known to this
Errors = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Device:
    """Parts of a fitted model that the design of a loop needs."""

    model: Model  # model of hysteresis and creep, without dynamics
    inverse: Model  # inverse of `model`
    plant: Plant  # dynamics after the hysteresis, as the record shows them. Computing time is not included.
    errors: Errors  # for each mode, standard errors of natural frequency (Hz), damping ratio and share of static gain
    delay_error: float  # standard error of the delay (s)
    unseen: Unseen | None  # resonance that the record did not excite
    h: float  # step (s)
    frequency: float  # frequency of the references (Hz): mean cycle frequency of the record, limited by the step
    band: float  # highest frequency at which input and output are coherent (Hz); 0 if there is no such frequency
    noise: float  # RMS value of the sensor noise
    # smallest and largest output that the device can hold during a run, and output before the first step, in the
    # unit of measure of y. Because of creep, a fast sweep may have another range.
    low: float
    high: float
    rest: float
    commands: tuple[float, float]  # range of the input in the record
    falling: bool  # whether the output decreases with the input, as for a contracting stack
    slopes: tuple[float, float]  # sector of the incremental gain of the device over the inverse
    notes: tuple[str, ...] = ()  # properties that the record does not show

    @property
    def input(self) -> str:
        """Name of the input of the model."""
        return self.model.graph.inputs[0].name

    @property
    def output(self) -> str:
        """Name of the output of the model."""
        return self.model.graph.outputs[0].name


def device(
    model: Model,
    data: Dataset,
    resonance: tuple[float, float] | None = None,
    commands: tuple[float, float] = (-math.inf, math.inf),
) -> Device:
    """Split a model that was fitted to `data` into the parts that a loop needs.

    `resonance` contains the natural frequency (Hz) and the damping ratio of a mode that the user states. `commands`
    contains the limits of the amplifier; a finite limit replaces the limit of the input in the record. An InputError is
    raised if the model has several inputs, dynamics within the hysteresis, or no inverse. It is also raised if no
    constant input can hold an output.
    """
    if fault := unsuited(model):
        raise InputError(f"{data.path or data.name}: {fault}")
    static = _within(at_rest(model), commands)
    kept = model.fit.get("evidence")
    evidence = evidence_of(model, data) if kept is None else Evidence.from_dict(kept)
    plant, errors, notes = _dynamics(model, evidence)
    late = evidence.delay_se if np.isfinite(evidence.delay_se) else max(UNKNOWN_DELAY * data.h, plant.delay) / SIGMAS
    unseen = _unseen(plant, evidence, data, resonance)
    frequency = reference_frequency(data)
    low, high, falling = reach(static, math.ceil(PERIODS / (frequency * data.h)))
    if not high > low:
        raise InputError(
            f"{data.path or data.name}: The output of {model.key} must not decay while the input is constant."
        )
    return Device(
        static,
        static.inverse(),
        plant,
        errors,
        late,
        unseen,
        data.h,
        frequency,
        described_to(evidence, plant),
        evidence.noise if np.isfinite(evidence.noise) else 0.0,
        low,
        high,
        at_start(static),
        input_range(static, "A loop must have the input range of its model"),
        falling,
        slopes(static, plant, data, evidence),
        tuple(notes),
    )


def slopes(static: Model, plant: Plant, data: Dataset, evidence: Evidence) -> tuple[float, float]:
    """Return the sector of the incremental gain of the device over the inverse of the model `static`.

    It is that of a model that follows its record (`SLOPES`), or wider in two cases. First, the RMS of the output in a
    part of the record differs clearly from that of model and dynamics. Second, the slope of the model after a reversal
    is much smaller for small changes of the input, which the record does not contain, than for its smallest reversals.
    The slope of a device that softens after a reversal may then be as large as for these: a fit without the dynamics,
    for example, can have almost no slope there, and its inverse too large a gain.
    """
    run = run_along(static.graph, data)
    filter_ = discretised(transfer_function(plant, DYNAMICS_NAME), data.h) if plant.f_n else None
    top = min((BELOW * f for f in plant.f_n), default=math.inf)
    least = HEARD * (evidence.noise if np.isfinite(evidence.noise) else 0.0)
    ratios, sizes = [1.0], []
    for rows in data.records:
        y = run[rows] if filter_ is None else filter_.run(run[rows, None])[:, 0]
        measured, u = data.y[rows], data.u[rows]
        sizes.append(np.abs(np.diff(u[reversals(u)])))
        for part in np.array_split(np.arange(len(u)), min(PARTS, max(len(u) // LEAST_PART, 1))):
            a, b = np.std(y[part]), np.std(measured[part])
            fast = len(reversals(u[part])) > 2 * top * len(part) * data.h
            if min(a, b) > least and not fast:
                ratios.append(float(b / a))
    low, high = min(ratios), max(ratios)
    swings = np.concatenate(sizes)
    steeper = _steeper(static, float(np.quantile(swings, SHOWN))) if len(swings) else 1.0
    return (
        SLOPES[0] * (low if low < 1 / FOLLOWED else 1.0),
        max(SLOPES[1], steeper) * (high if high > FOLLOWED else 1.0),
    )


def _steeper(static: Model, size: float) -> float:
    """Return the largest ratio of the slopes of a model after a reversal, for swings of `size` and for small swings."""
    found, range_ = [1.0], float(np.ptp(over_range(static, np.array([-1.0, 1.0]))))
    swing = np.sin(np.linspace(0, 4 * np.pi, 4 * SWING))
    for level in LEVELS:
        way = np.linspace(-1.0, level, SWING)
        gains = []
        for part in (min(size / range_, 1 - abs(level)), SMALL):
            y = static.predict(over_range(static, np.append(way, level + part * swing)))
            gains.append(float(np.ptp(y[-2 * SWING :])) / part)
        found.append(gains[0] / max(gains[1], 1e-12))
    return max(found)


def _determined(evidence: Evidence) -> tuple[Mode, ...]:
    """Return the modes that the record determines, or () if their static gains do not add up to about 1.

    Aliasing: a mode above half the sampling rate of the record appears as a broad mode below this frequency. The static
    gain of such a mode is meaningless.
    """
    modes = tuple(m for m in evidence.modes if m.share_se < SHARE_KNOWN and m.f_n_se < FREQUENCY_KNOWN * m.f_n)
    return modes if SHARES[0] < sum(m.share for m in modes) < SHARES[1] else ()


def described_to(evidence: Evidence, plant: Plant) -> float:
    """Return the highest frequency (Hz) in the coherent band up to which a plant agrees with the measured response.

    If the record shows a resonance but does not determine it, this frequency is below the resonance.
    """
    lowest, highest = evidence.band
    ratio = evidence.gain / np.abs(
        plant.response(np.exp(2j * np.pi * evidence.f * RATE * evidence.h), RATE * evidence.h)
    )
    clear = (evidence.coherence > np.maximum(evidence.significant, CLEAR)) & (evidence.f >= lowest)
    f, off = evidence.f[clear], np.abs(np.log(np.maximum(ratio[clear], 1e-12)))
    if len(f) < 3:
        return highest
    smooth = np.median(np.stack([off[:-2], off[1:-1], off[2:]]), axis=0)  # one point may be off by chance
    far = np.flatnonzero(smooth > (DESCRIBED if plant.f_n else FLAT))
    return highest if not len(far) else min(highest, float(f[far[0]]))


def _dynamics(model: Model, evidence: Evidence) -> tuple[Plant, Errors, list[str]]:
    """Return the dynamics that the record shows, their standard errors, and a line for each unknown property."""
    modes = _determined(evidence)
    plant = Plant(
        tuple(m.f_n for m in modes),
        tuple(m.zeta for m in modes),
        tuple(m.share for m in modes),
        max(_behind_hold(model, evidence), 0.0),
    )
    errors = tuple((m.f_n_se, m.zeta_se, m.share_se) for m in modes)
    top = described_to(evidence, plant)
    bent = top < evidence.band[1]
    if modes:
        beyond = ", ".join(f"{f:.4g}" for f in plant.f_n if f > top)
        note = f"the record gives no information about the device above {top:.4g} Hz"
        note += f", except for its modes at {beyond} Hz" if beyond else ""
        above = f"above {top:.4g} Hz the modes that the record determines do not describe its response"
        return plant, errors, [above if bent else note]
    seen = "the record does not show the dynamics of the device at any frequency"
    if top:
        above = "determines no mode above, where its response is not flat" if bent else "gives no information above"
        seen = f"the record shows no resonance up to {top:.4g} Hz, and {above}"
    fitted = [n for n in (split(model) or Parts(model, ())).tail if n.type == DYNAMICS]
    return plant, errors, [seen, *(["the record does not confirm the dynamics of the fit"] * bool(fitted))]


def _behind_hold(model: Model, evidence: Evidence) -> float:
    """Return the delay of the device (s). The average delay of a hold, half a step, is not included.

    If the record does not show the delay, the delay of the fit is used.
    """
    if not np.isfinite(evidence.delay_se):
        return float(model.fit.get("delay", 0.0))
    return evidence.delay - (0.0 if evidence.hold == "zoh" else evidence.h / 2)


def _within(model: Model, commands: tuple[float, float]) -> Model:
    """Return the model with the input range limited by the amplifier; infinite limits do not change the range."""
    lo, hi = input_range(model, "A loop must have the input range of its model")
    low, high = (b if math.isfinite(b) else a for a, b in zip((lo, hi), commands, strict=True))
    if not low < high:
        raise InputError(f"The range of the amplifier must overlap {lo:g} to {hi:g}, the range of the record.")
    return replace(model, provenance={**model.provenance, "span_u": [low, high]})


def _unseen(plant: Plant, evidence: Evidence, data: Dataset, resonance: tuple[float, float] | None) -> Unseen | None:
    """Return the resonance stated by the user, or else the possible resonance above the band of the record."""
    share = max(UNSEEN_SHARE, plant.rest) if plant.f_n else 1.0  # a rest is a mode above the band
    if resonance is not None:
        f, zeta = resonance
        return Unseen((1 - KNOWN_RESONANCE) * f, share, zeta, (1 + KNOWN_RESONANCE) * f)
    above = described_to(evidence, plant) or 1 / (len(data.u) * data.h)
    above = max(above, 1.2 * max(plant.f_n, default=0.0))  # a known mode is no other one
    return Unseen(above, share, UNSEEN_ZETA)


def plant_model(found: Device, plant: Plant | None = None, gain: float = 1.0) -> Model:
    """Return the model of a device. The model makes `FINE` steps in each step of the controller.

    The model consists of a delay, the hysteresis, an additive input ``d`` and the dynamics `plant`, by default
    `found.plant`. The input ``d`` is the model error. It acts in front of the dynamics, because a lightly damped mode
    amplifies harmonics of the model error. The deviation of the output from its rest value is multiplied by `gain`.
    """
    plant = found.plant if plant is None else plant
    g, fine = found.model.graph, found.h / FINE
    (source,), (sink,) = g.inputs, g.outputs
    nodes, wires = list(g.nodes), list(g.wires)
    into, end = source.to, sink.source
    late = round(plant.delay / fine)
    if late:
        nodes.insert(0, Node("late", "delay", {"n": late}, {"y0": float(source.start)}))
        wires += [("late.y", target) for target in into]
        into = ("late.u",)
    nodes.append(Node("missed", "sum", {"n": 2}, {"k": [1.0, 1.0]}))
    wires.append((end, "missed.u[1]"))
    end = "missed.y"
    if plant.f_n:
        nodes.append(transfer_function(plant, DYNAMICS_NAME))
        wires.append((end, f"{DYNAMICS_NAME}.u"))
        end = f"{DYNAMICS_NAME}.y"
    if gain != 1:
        nodes.append(Node("corner", "scaling", {"n": 1}, {"gain": gain, "offset": (1 - gain) * found.rest}))
        wires.append((end, "corner.u"))
        end = "corner.y"
    inputs = [replace(source, to=into), Input("d", ("missed.u[2]",), sink.unit, 0.0, "what the model misses")]
    graph = Graph(nodes, wires, inputs, [replace(sink, source=end)], sort=False, step=fine if late else 0.0)
    text = f"{found.model.key} as a device: {plant.name}" + (f", {gain:g} times the gain" if gain != 1 else "")
    return replace(found.model, graph=graph, step=fine if late else None, text=text, fit={})


def at_rest(model: Model) -> Model:
    """Return the model with static gains instead of linear dynamics and delays."""
    g = model.graph
    for n in (split(model) or Parts(model, ())).tail:
        if n.type in (DYNAMICS, "delay"):
            gain = static_gain(n) if n.type == DYNAMICS else 1.0
            g = g.replace(Node(n.name, "scaling", {"n": 1}, {"gain": gain}))
    return replace(model, graph=g, fit={})


def reach(model: Model, rows: int) -> tuple[float, float, bool]:
    """Return the smallest and the largest lasting output, and whether the output decreases with the input.

    An output is lasting if a constant input at an end of the input range holds it for `rows` steps.
    """
    sweep = np.concatenate([np.linspace(a, b, 2000) for a, b in ((1, -1), (-1, 1))])
    y = model.predict(over_range(model, sweep))
    first, last = (float(model.predict(over_range(model, np.full(rows, v)))[-1]) for v in (-1.0, 1.0))
    return max(float(y.min()), min(first, last)), min(float(y.max()), max(first, last)), last < first


def unsuited(model: Model) -> str:
    """Return the reason why `start` cannot build a loop with a model, or "" if it can."""
    if names := beside(model.graph):
        return f"A loop is made for a model of one input. Got {', '.join(names)} beside it: use hystfmu fit."
    front = (split(model) or Parts(model, ())).front
    inner = [n.type for n in front.graph.nodes if n.block.rate in ("sampled", "continuous") and n.type != "creep"]
    if inner:
        return f"A loop is made for dynamics behind the hysteresis. Got {model.key}, whose {inner[0]} has them within."
    return ""


def reference_frequency(data: Dataset) -> float:
    """Return the mean cycle frequency of the input (Hz): half the number of large reversals per second.

    The frequency is limited such that a period has at least `SAMPLES` steps. Small reversals are ignored, because a
    superposed chirp does not show the frequency of full strokes.
    """
    size = LARGE * float(np.ptp(data.u))
    turns = [len(turning_points(data.u[rows], size)) for rows in data.records]
    long = sum(len(data.u[rows][moving(data.u[rows], size)]) for rows in data.records)
    found = max(sum(turns), 1) / (2 * max(long, 1) * data.h)
    return float(f"{min(max(found, 1 / (LONGEST * data.h)), 1 / (SAMPLES * data.h)):.3g}")


def moving(u: Array, size: float) -> slice:
    """Return the rows between the first and the last change of the input by at least `size`."""
    far = np.flatnonzero(np.abs(u - u[0]) > size)
    back = np.flatnonzero(np.abs(u - u[-1]) > size)
    return slice(far[0], back[-1] + 1) if len(far) and len(back) and back[-1] >= far[0] else slice(0, len(u))
