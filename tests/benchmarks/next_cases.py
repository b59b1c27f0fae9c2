"""Devices that began with one sine: the record, what to measure next, and the error of the fit to both."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "oracles"))
sys.path.insert(0, str(Path(__file__).parents[1] / "identify"))

import numpy as np
from foreign.devices import DEVICES as FOREIGN
from foreign.devices import draw
from foreign.records import NOISE, ROWS, decaying, multisine, nested
from scipy.optimize import least_squares

import hystfmu as hy

DEVICES = ("Coleman-Hodgdon piezo, mode, delay", "Spencer's MR damper", "slip stage")
CYCLES = 10


class Parameters:
    """A generator that keeps the ranges of what a device draws, or gives parameters in their place."""

    def __init__(self, drawn, given=None) -> None:
        self.drawn, self.given = drawn, None if given is None else list(given)
        self.ranges: list[tuple[float, float]] = []
        self.values: list[float] = []

    def uniform(self, lo: float, hi: float, size=None):
        """Draw, or take the next of the given parameters."""
        n = 1 if size is None else size
        v = self.drawn.uniform(lo, hi, n) if self.given is None else np.array([self.given.pop(0) for _ in range(n)])
        self.ranges += [(lo, hi)] * n
        self.values += v.tolist()
        return float(v[0]) if size is None else v


class Case:
    """A device at rest, and one sine of it in the middle of its band (by logarithm)."""

    def __init__(self, name: str, seed: int) -> None:
        self.name, self.seed = name, seed
        self.device, self.rng = draw(name, seed), np.random.default_rng([seed, len(name)])
        h, band = self.device.h, self.device.band
        f = np.sqrt(band[0] * band[1])
        rows = round(CYCLES / f / h)
        self.sine = self.measured(np.sin(2 * np.pi * f * h * np.arange(rows)), h)
        most = float(np.abs(np.diff(self.sine.u)).max())
        self.held_out = []
        for kind in (multisine, nested, decaying):
            v = 0.95 * kind(ROWS, h, band, self.rng)
            self.held_out.append(self.measured(v * min(1.0, most / float(np.abs(np.diff(v)).max())), h, 0.0))

    def measured(self, u, h: float, noise: float = NOISE) -> hy.Dataset:
        """Measure the device, from rest, at its own step."""
        assert h == self.device.h
        y = self.device.run(np.asarray(u), None)
        return hy.Dataset.from_signal(u, y + noise * np.ptp(y) * self.rng.normal(size=len(y)), h)

    def error(self, model) -> float:
        """RMS error over the held-out signals in % of the span of the sine's output."""
        e = np.concatenate([model.predict(other) - other.y for other in self.held_out])
        return 100 * float(np.sqrt(np.mean(e**2))) / self.sine.span

    def truth(self, data: hy.Dataset) -> float:
        """Error of the device's own structure, whose parameters are fitted to the data from the true ones on."""
        drawn = Parameters(np.random.default_rng([self.seed, list(FOREIGN).index(self.name)]))
        FOREIGN[self.name](drawn)
        lo, hi = np.array(drawn.ranges).T

        def device(x):
            return FOREIGN[self.name](Parameters(None, lo + (x - 1) * (hi - lo)))

        def residuals(x):
            run = device(x).run
            return data.along(lambda u: run(u, None)) - data.y

        start = 1 + (np.array(drawn.values) - lo) / (hi - lo)  # from 1 to 2: differences are steps of a range
        found = least_squares(residuals, start, diff_step=1e-5, max_nfev=20)
        run = device(found.x).run
        e = np.concatenate([run(other.u, None) - other.y for other in self.held_out])
        return 100 * float(np.sqrt(np.mean(e**2))) / self.sine.span
