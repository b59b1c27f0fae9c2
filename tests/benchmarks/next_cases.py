"""Devices that began with one sine: the record, what to measure next, and the error of the fit to both."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "oracles"))
sys.path.insert(0, str(Path(__file__).parents[1] / "identify"))

import numpy as np
from foreign.devices import draw
from foreign.records import NOISE, ROWS, decaying, multisine, nested
from foreign.truth import by_solver, played

import hystfmu as hy

DEVICES = ("Coleman-Hodgdon piezo, mode, delay", "Spencer's MR damper", "slip stage")
CYCLES = 10


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
        return self._percent([model.predict(other) - other.y for other in self.held_out])

    def truth(self, data: hy.Dataset) -> float:
        """Error of the device's own structure, whose parameters are fitted to the data from the true ones on."""
        run = by_solver(self.name, self.seed, data)
        return self._percent([played(run, other) - other.y for other in self.held_out])

    def _percent(self, errors) -> float:
        return 100 * float(np.sqrt(np.mean(np.concatenate(errors) ** 2))) / self.sine.span
