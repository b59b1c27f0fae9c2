"""Error of a model as tones for the simulation of a loop. The expected error of a loop includes these tones.

The residual of a record has a spectrum. Its frequencies are stated relative to the cycle rate of the record, because
errors of the hysteresis are at fixed harmonics of a slower or faster reference. The white noise of the sensor is
subtracted.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.design.plants import Plant
from hystfmu.face.interval import free_run
from hystfmu.face.model import Model
from hystfmu.graph import blocks
from hystfmu.start.device import LARGE, moving

PASSED = 0.5  # response of the dynamics, below which the residual says nothing about what stands in front
EDGES = np.array([0.05, 0.7, 1.5, 2.5, 3.5, 5.5, 8.5, 13.5, 21.5, 34.5, 55.5, 89.5, 144.5, 233.5, 377.5])
HARMONICS = np.sqrt(EDGES[:-1] * EDGES[1:])  # of the tones
FASTEST = 0.45  # of the sampling frequency: a tone
LEAST_SHARE = 1e-4  # of the power of the residual: a tone


@dataclass(frozen=True)
class Misfit:
    """Power of the residual in bands of harmonics of a cycle. `EDGES` are the edges of the bands.

    Attributes
    ----------
    power : array, shape (len(EDGES) - 1,)
        Power in front of the dynamics, in the square of the unit of measure of y.
    plant : Plant
        Dynamics.
    h : float
        Step (s).
    """

    power: Array
    plant: Plant
    h: float

    @property
    def rms(self) -> float:
        """RMS of the residual in front of the dynamics."""
        return float(np.sqrt(self.power.sum()))

    def lines(self, frequency: float) -> tuple[Array, Array]:
        """Return frequency (Hz) and power of a tone for each band, for a reference of the given frequency (Hz).

        The power of each tone after the dynamics equals the power of all harmonics of its band. A harmonic may excite a
        lightly damped mode that the tone does not excite.
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
        """Return a source with the tones of `lines`, for references of a frequency (Hz). Phases are random.

        The model error is proportional to the stroke. `strength` is the size of the strokes relative to the strokes of
        the record.
        """
        f, power = self.lines(frequency)
        a = strength * np.sqrt(2 * power)
        if not len(f):
            f, a = np.zeros(1), np.zeros(1)
        phases = np.random.default_rng(seed).uniform(-np.pi, np.pi, len(f))
        values: dict[str, Any] = {k: [float(f"{x:.6g}") for x in v] for k, v in (("f", f), ("a", a), ("ph", phases))}
        return blocks.Reference(m=len(f), shape="multisine", amplitude=1.0, **values)

    def _passed(self, f: Array) -> Array:
        """Return the square of the gain of the dynamics at frequencies (Hz)."""
        return np.asarray(np.abs(self.plant.response(np.exp(2j * np.pi * f * self.h), self.h)) ** 2)


def misfit(model: Model, data: Dataset, cycle: float, noise: float, plant: Plant) -> Misfit:
    """Compute the power of the residual in each band.

    Parameters
    ----------
    model : Model
        The fitted model with all its parts.
    data : Dataset
        Record of the fit.
    cycle : float
        Rate of the cycles of the record (Hz).
    noise : float
        RMS of the white noise of the sensor.
    plant : Plant
        Dynamics. The misfit is computed in front of the dynamics.
    """
    e = data.y - free_run(model, data)
    ratio = float(model.fit.get("validation_percent", 0.0)) / max(float(model.fit.get("rms_percent", 1.0)), 1e-12)
    f, power, counted = [], [], 0
    for rows in data.records:
        strokes = moving(data.u[rows], LARGE * float(np.ptp(data.u)))  # not a chirp behind them: its errors are others
        part = e[rows][strokes]
        part = part[np.isfinite(part)]
        n = len(part)
        if n < 8:
            continue
        window = np.hanning(n)
        spectrum = np.abs(np.fft.rfft(window * (part - part.mean()))) ** 2 / (n * np.sum(window**2)) * 2
        f.append(np.fft.rfftfreq(n, data.h))
        power.append((spectrum - 2 * noise**2 / n) * n)
        counted += n
    frequencies, powers = np.concatenate(f or [np.zeros(0)]), np.concatenate(power or [np.zeros(0)])
    G = np.abs(plant.response(np.exp(2j * np.pi * frequencies * data.h), data.h)) if plant.f_n else 1.0
    powers = np.where(G > PASSED, powers / np.maximum(G, PASSED) ** 2, 0.0)
    found = []
    for low, high in pairwise(EDGES):
        inside = (frequencies >= low * cycle) & (frequencies < high * cycle)
        found.append(max(float(powers[inside].sum()) / max(counted, 1), 0.0))
    scale = max(ratio, 1.0) ** 2  # the residual of training rows is smaller than that of others
    return Misfit(scale * np.array(found), plant, data.h)
