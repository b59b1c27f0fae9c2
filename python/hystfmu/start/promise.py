"""The expected error of a loop on the device itself, or the statement that it is not known.

A run of the scenario contains the model error of the record and the noise of the sensor. The expected error also
includes the uncertainty of modes and delay. Because of this uncertainty, the feed-forward causes an error for every
tone of the reference; the feedback reduces this error. A record with only one kind of signal gives no information about
other signals. A model that does not follow its record gives no information about the device.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.data.reversals import turning_points
from hystfmu.design.plants import PlantSet
from hystfmu.design.race import Aim, Tuned
from hystfmu.face.model import Model
from hystfmu.identify.auto import REFUSED
from hystfmu.model.guards import at_bounds
from hystfmu.scenario import Results
from hystfmu.start.device import Device
from hystfmu.start.misfit import Misfit
from hystfmu.start.references import Tried

LEAST_REVERSALS = 20  # of a record that shows the memory
SMALL = 0.05  # of the range of the input: a reversal that shows memory
BOUND = 2.0  # times the expected error: 19 of 20 errors of drawn devices lie below (tests/benchmarks/devices.py)
LEAST = 0.5  # of the noise of the record: a smaller bound is not what the record can show
HARMONICS = 5  # of a reference that must lie in the coherent band
FAR = 5.0  # times the noise of the record: an error that a fit at its bounds must not have
OTHER_KIND = "name another kind of model or none"
SLIGHT = 0.2  # percent of the span: an error that is never far, such as on rows of few digits


@dataclass(frozen=True)
class Promise:
    """Expected error for one reference.

    Attributes
    ----------
    name, shape : str
    frequency, amplitude, offset : float
        Frequency (Hz), amplitude and offset of the reference (unit of measure of y).
    model_percent : float
        RMS error of the identified device with its model error in the run, in percent of peak to peak of the reference.
    rms_percent, bound_percent : float or None
        Expected RMS error on the device, and a bound of this error; None if not known.
    why : str
        Reason why the error is not known.
    follows : bool
        False if this reason is that the model does not follow its record.
    """

    name: str
    shape: str
    frequency: float
    amplitude: float
    offset: float
    model_percent: float
    rms_percent: float | None
    bound_percent: float | None
    why: str = ""
    follows: bool = True


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
    """Return the expected errors for all references."""
    made, fault = [], misfitted(model, 100 * found.noise / data.span)
    values = {r.case: v.value for r in results for v in r.verdicts if v.metric == "tracking"}
    for t in tried:
        in_percent = 100 / (2 * t.amplitude)
        run = values.get(t.name, float("inf")) * tried[0].amplitude / t.amplitude
        why = unknown(found, t, data, model, fault)
        expected = None if why else float(np.hypot(run, np.sqrt(_left(found, plants, aim, tuned, t)) * in_percent))
        bound = None if expected is None else max(BOUND * expected, LEAST * found.noise * in_percent)
        made.append(
            Promise(
                t.name, t.shape, t.frequency, t.amplitude, t.offset, run, expected, bound, why, not why or why != fault
            )
        )
    return tuple(made)


def expected_percent(found: Device, plants: PlantSet, aim: Aim, missed: Misfit, tuned: Tuned, t: Tried) -> float:
    """Estimate the error of a structure without a run, from remaining misfit, uncertainty and noise."""
    f, power = missed.lines(t.frequency)
    G = np.abs(plants.plants[0].response(np.exp(2j * np.pi * f * found.h), found.h))
    power = (t.strength * G * _sensitivity(found, plants, tuned, f)) ** 2 * power
    noise = (tuned.noise_gain * found.noise) ** 2
    return float(100 * np.sqrt(power.sum() + noise + _left(found, plants, aim, tuned, t)) / (2 * t.amplitude))


def unknown(found: Device, t: Tried, data: Dataset, model: Model, fault: str) -> str:
    """Return the reason why the error on the device is not known; empty if it is known."""
    size = SMALL * float(np.ptp(data.u))
    turns = sum(len(turning_points(data.u[rows], size)) for rows in data.records)
    if turns < LEAST_REVERSALS or any("informative" in w for w in model.fit.get("warnings", ())):
        return "the record does not show the memory of the hysteresis"
    if fault:
        return fault
    if not found.plant.f_n:
        return "the record does not show the dynamics of the device"
    if HARMONICS * t.frequency > found.band:
        return f"the reference is faster than the record shows ({found.band:.3g} Hz)"
    return ""


def misfitted(model: Model, noise: float) -> str:
    """Return the reason why a model does not follow its record; empty if it follows the record.

    Parameters
    ----------
    model : Model
    noise : float
        RMS of the noise of the record in percent of the span.
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
    """Return the power of the error due to the uncertainty of modes and delay."""
    z = np.exp(2j * np.pi * aim.f * found.h)
    S = _sensitivity(found, plants, tuned, aim.f)
    return float((t.powers(aim.f) * plants.missed(z) * S**2).sum())


def _sensitivity(found: Device, plants: PlantSet, tuned: Tuned | None, f: Array) -> Array:
    """Return abs(S) of the identified plant at frequencies (Hz)."""
    if tuned is None:
        return np.ones(len(f))
    z = np.exp(2j * np.pi * f * found.h)
    C, _ = tuned.structure.response(tuned.design, tuned.values, z)(tuned.Ki)
    return np.asarray(np.abs(1 / (1 + C * plants.plants[0].response(z, found.h))))
