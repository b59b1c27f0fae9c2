"""Computes the expected error of a loop on the real device, or the reason why this error is not known.

The simulated error includes the error of the model on the record and the sensor noise. The expected error also includes
the effect of uncertain modes and delay: the feed-forward then causes an error at every harmonic of the reference, and
the feedback reduces this error. A record says nothing about the device above its coherent band and its modes: there,
the error is as large as the reference itself, which matters for a reference with corners. A record with only one kind
of signal gives no information about other signals. A model that does not reproduce its record gives no information
about the device.

In the simulation, the model error is a sum of sines. It has the spectrum of the residual of the record, without the
white sensor noise. The frequencies of this spectrum are relative to the mean cycle frequency of the record, because
errors of the hysteresis are at fixed harmonics of the reference. The strokes of the record may be smaller than those of
the references. Therefore the residual is multiplied by the ratio of their RMS values.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from hystfmu.base import Array
from hystfmu.data import Dataset
from hystfmu.data.reversals import turning_points
from hystfmu.design.plants import Plant, PlantSet
from hystfmu.design.race import Aim, Tuned
from hystfmu.face.interval import free_run
from hystfmu.face.model import Model
from hystfmu.graph import blocks
from hystfmu.identify.auto import REFUSED
from hystfmu.model.guards import at_bounds
from hystfmu.scenario import Results
from hystfmu.start.device import LARGE, Device, moving
from hystfmu.start.references import STROKE, Tried

PASSED = 0.5  # response of the dynamics, below which the residual says nothing about what stands in front
EDGES = np.array([0.05, 0.7, 1.5, 2.5, 3.5, 5.5, 8.5, 13.5, 21.5, 34.5, 55.5, 89.5, 144.5, 233.5, 377.5])
HARMONICS = np.sqrt(EDGES[:-1] * EDGES[1:])  # of the tones
FASTEST = 0.45  # of the sampling frequency: a tone
LEAST_SHARE = 1e-4  # of the power of the residual: a tone


@dataclass(frozen=True)
class Misfit:
    """Power of the residual in bands of harmonics of the cycle frequency. `EDGES` contains the edges of the bands."""

    # power in front of the dynamics for a sine of the references, in the square of the unit of measure of y, shape
    # (len(EDGES) - 1,)
    power: Array
    plant: Plant  # dynamics
    h: float  # step (s)

    @property
    def rms(self) -> float:
        """RMS value of the residual, converted to the input of the dynamics."""
        return float(np.sqrt(self.power.sum()))

    def lines(self, frequency: float) -> tuple[Array, Array]:
        """Return frequencies (Hz) and powers of sines for a reference frequency (Hz). One sine represents each band.

        Behind the dynamics, each sine has the same power as all harmonics of its band. This matters if a harmonic
        excites a lightly damped mode that the sine does not excite.
        """
        f, power = [], []
        for (low, high), n, p in zip(pairwise(EDGES), HARMONICS, self.power, strict=True):
            middle = min(frequency * n, FASTEST / self.h)
            harmonics = frequency * np.arange(np.ceil(low), high)
            passed = self._passed(harmonics[(harmonics > 0) & (harmonics < 0.5 / self.h)])
            if p > LEAST_SHARE * self.power.sum() and frequency * low < FASTEST / self.h:
                f.append(middle)
                power.append(p * float(passed.mean() / self._passed(np.array([middle]))[0]) if len(passed) else p)
        return np.array(f), np.array(power)

    def tones(self, frequency: float, seed: int, strength: float = 1.0) -> blocks.Reference:
        """Return a source that outputs the sines of `lines` with random phases.

        The model error is proportional to the stroke. `strength` is the stroke relative to a sine of the references.
        """
        f, power = self.lines(frequency)
        a = strength * np.sqrt(2 * power)
        if not len(f):
            f, a = np.zeros(1), np.zeros(1)
        phases = np.random.default_rng(seed).uniform(-np.pi, np.pi, len(f))
        values: dict[str, Any] = {k: [float(f"{x:.6g}") for x in v] for k, v in (("f", f), ("a", a), ("ph", phases))}
        return blocks.Reference(m=len(f), shape="multisine", amplitude=1.0, **values)

    def _passed(self, f: Array) -> Array:
        """Return the squared gain of the dynamics at the frequencies f (Hz)."""
        return np.asarray(np.abs(self.plant.response(np.exp(2j * np.pi * f * self.h), self.h)) ** 2)


def misfit(model: Model, data: Dataset, cycle: float, noise: float, plant: Plant) -> Misfit:
    """Compute the power of the residual of a model in each band, converted to the input of the dynamics `plant`.

    The power is that for a sine with the stroke of the references. `data` is the record of the fit, `cycle` its mean
    cycle frequency (Hz), and `noise` the RMS of the white noise of the sensor.
    """
    e = data.y - free_run(model, data)
    ratio = float(model.fit.get("validation_percent", 0.0)) / max(float(model.fit.get("rms_percent", 1.0)), 1e-12)
    f, power, counted, moved = [], [], 0, 0.0
    for rows in data.records:
        strokes = moving(data.u[rows], LARGE * float(np.ptp(data.u)))  # not a chirp behind them: its errors are others
        part, u = e[rows][strokes], data.u[rows][strokes]
        part, u = part[np.isfinite(part)], u[np.isfinite(part)]
        n = len(part)
        if n < 8:
            continue
        window = np.hanning(n)
        spectrum = np.abs(np.fft.rfft(window * (part - part.mean()))) ** 2 / (n * np.sum(window**2)) * 2
        f.append(np.fft.rfftfreq(n, data.h))
        power.append((spectrum - 2 * noise**2 / n) * n)
        moved += n * float(np.average((u - np.average(u, weights=window**2)) ** 2, weights=window**2))
        counted += n
    frequencies, powers = np.concatenate(f or [np.zeros(0)]), np.concatenate(power or [np.zeros(0)])
    G = np.abs(plant.response(np.exp(2j * np.pi * frequencies * data.h), data.h)) if plant.f_n else 1.0
    powers = np.where(G > PASSED, powers / np.maximum(G, PASSED) ** 2, 0.0)
    found = []
    for low, high in pairwise(EDGES):
        inside = (frequencies >= low * cycle) & (frequencies < high * cycle)
        found.append(max(float(powers[inside].sum()) / max(counted, 1), 0.0))
    scale = max(ratio, 1.0) ** 2  # the residual of training rows is smaller than that of others
    if moved > 0:
        scale *= STROKE**2 / 8 * float(np.ptp(data.u)) ** 2 * counted / moved
    return Misfit(scale * np.array(found), plant, data.h)


LEAST_REVERSALS = 20  # of a record that shows the memory
SMALL = 0.05  # of the range of the input: a reversal that shows memory
BOUND = 2.0  # times the expected error: 19 of 20 errors of drawn devices lie below (tests/benchmarks/devices.py)
LEAST = 0.5  # of the noise of the record: a smaller bound is not what the record can show
IN_BAND = 5  # of a reference that must lie in the coherent band
FAR = 5.0  # times the noise of the record: an error that a fit at its bounds must not have
OTHER_KIND = "name another kind with --model, or omit --model"
SLIGHT = 0.2  # percent of the span: an error that is never far, such as on rows of few digits


@dataclass(frozen=True)
class Promise:
    """Expected error of the loop on the real device for one reference."""

    name: str
    shape: str
    frequency: float  # frequency (Hz), amplitude and offset of the reference (unit of measure of y)
    amplitude: float
    offset: float
    # simulated RMS error with the identified model as the device, in percent of the peak-to-peak value of the reference
    model_percent: float
    rms_percent: float | None  # expected RMS error on the device, and a bound of this error; None if not known
    bound_percent: float | None
    why: str = ""  # reason why the error is not known
    follows: bool = True  # False if the reason is that the model does not reproduce its record


def promises(
    found: Device,
    plants: PlantSet,
    aim: Aim,
    tuned: Tuned | None,
    tried: tuple[Tried, ...],
    results: Results,
    data: Dataset,
    model: Model,
) -> tuple[Promise, ...]:
    """Return the expected error on the real device for each reference."""
    made, fault = [], misfitted(model, 100 * found.noise / data.span)
    values = {r.case: r.value("tracking") for r in results}
    for t in tried:
        in_percent = 100 / (2 * t.amplitude)
        run = values[t.name] * tried[0].amplitude / t.amplitude
        why = unknown(found, t, data, model, fault)
        top = max(found.band, *found.plant.f_n, 0.0)  # up to a mode, the modes describe the response
        left = 0.0 if why else _left(found, plants, aim, tuned, t) + t.beyond(top, found.h)
        expected = None if why else float(np.hypot(run, np.sqrt(left) * in_percent))
        bound = None if expected is None else max(BOUND * expected, LEAST * found.noise * in_percent)
        made.append(
            Promise(
                t.name, t.shape, t.frequency, t.amplitude, t.offset, run, expected, bound, why, not why or why != fault
            )
        )
    return tuple(made)


def expected_percent(found: Device, plants: PlantSet, aim: Aim, missed: Misfit, tuned: Tuned, t: Tried) -> float:
    """Estimate the RMS error (%) of a tuned structure without a simulation, from model error, uncertainty and noise."""
    f, power = missed.lines(t.frequency)
    G = np.abs(plants.plants[0].response(np.exp(2j * np.pi * f * found.h), found.h))
    power = (t.strength * G * _sensitivity(found, plants, tuned, f)) ** 2 * power
    noise = (tuned.noise_gain * found.noise) ** 2
    return float(100 * np.sqrt(power.sum() + noise + _left(found, plants, aim, tuned, t)) / (2 * t.amplitude))


def unknown(found: Device, t: Tried, data: Dataset, model: Model, fault: str) -> str:
    """Return the reason why the error on the real device is not known, or "" if it is known."""
    size = SMALL * float(np.ptp(data.u))
    turns = sum(len(turning_points(data.u[rows], size)) for rows in data.records)
    if turns < LEAST_REVERSALS or any("informative" in w for w in model.fit.get("warnings", ())):
        return "the record does not show the memory of the hysteresis"
    if fault:
        return fault
    if not found.plant.f_n:
        return "the record does not show the dynamics of the device"
    if IN_BAND * t.frequency > found.band:
        return f"the reference is faster than the record shows ({found.band:.3g} Hz)"
    return ""


def misfitted(model: Model, noise: float) -> str:
    """Return the reason why a model does not reproduce its record, or "" if it does.

    `noise` is the RMS value of the noise of the record in percent of the span.
    """
    fit = model.fit
    error = max(float(fit.get(k, 0.0)) for k in ("rms_percent", "validation_percent", "held_out_rms_percent"))
    figures = f"an error of {error:.3g} % of the span, the noise is {noise:.2g} %"
    if error**2 - noise**2 > REFUSED**2:
        return f"{model.key} does not follow the record ({figures}): {OTHER_KIND}"
    bounds = at_bounds(fit.get("warnings", ()))
    if bounds and error > max(FAR * noise, SLIGHT):
        return f"the fit ended at a bound of {', '.join(bounds)} ({figures}): {OTHER_KIND}"
    return ""


def _left(found: Device, plants: PlantSet, aim: Aim, tuned: Tuned | None, t: Tried) -> float:
    """Return the power of the tracking error that the uncertainty of modes and delay causes."""
    z = np.exp(2j * np.pi * aim.f * found.h)
    S = _sensitivity(found, plants, tuned, aim.f)
    return float((t.powers(aim.f) * plants.missed(z) * S**2).sum())


def _sensitivity(found: Device, plants: PlantSet, tuned: Tuned | None, f: Array) -> Array:
    """Return the absolute value of the sensitivity at the frequencies f (Hz) for the identified plant."""
    if tuned is None:
        return np.ones(len(f))
    z = np.exp(2j * np.pi * f * found.h)
    C, _ = tuned.structure.response(tuned.design, tuned.values, z)(tuned.Ki)
    return np.asarray(np.abs(1 / (1 + C * plants.plants[0].response(z, found.h))))
