"""Devices and signals of the benchmark of intervals: a record of one kind of signal, new signals of every kind.

Static plants come from `random_plants`, the others from `foreign`.  Each class is fitted by name with a kind that costs
less than a second; some of them miss the structure of the device, because an interval must hold for them as well.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "oracles"))
sys.path.insert(0, str(Path(__file__).parents[1] / "identify"))

import numpy as np
from foreign.devices import Device
from foreign.devices import draw as draw_foreign
from foreign.records import chirp, cycles, multisine, nested
from random_plants import FAMILIES
from random_plants import draw as draw_static

import hystfmu as hy

ROWS = 2000
STATIC_STEP, STATIC_BAND = 1e-3, (0.5, 15.0)
NOISE = (2e-4, 5e-3)  # standard deviation, share of the span of y; drawn evenly over its logarithm
KINDS = {
    "plays": ("prandtl_ishlinskii", "krasnoselskii_pokrovskii"),
    "bent plays": ("prandtl_ishlinskii", "polynomial_narx"),
    "Bouc-Wen": ("bouc_wen", "prandtl_ishlinskii"),
    "stop-like": ("bouc_wen", "krasnoselskii_pokrovskii"),
    "butterfly": ("polynomial_narx",),
    "Coleman-Hodgdon piezo, mode, delay": ("g0_bouc_wen", "g0_prandtl_ishlinskii"),
    "battery, one state": ("bouc_wen_parallel", "prandtl_ishlinskii"),
    "Jiles-Atherton, eddy lag": ("bouc_wen", "polynomial_narx"),
    "slip stage": ("g0_bouc_wen", "g0_prandtl_ishlinskii"),
    "LuGre": ("bouc_wen",),
    "ferroelectric butterfly": ("polynomial_narx",),
    "IPMC, back-relaxation": ("prandtl_ishlinskii", "g0_prandtl_ishlinskii"),
    "Spencer's MR damper": ("polynomial_narx", "bouc_wen"),
    "shape-memory alloy": ("bouc_wen", "prandtl_ishlinskii"),
    "Bouc-Wen + G0": ("g0_bouc_wen",),
    "plays + two modes": ("g0_prandtl_ishlinskii",),
    "dielectric elastomer": ("polynomial_narx", "prandtl_ishlinskii"),
}


def decaying(rows, h, band, rng):
    """Decaying sine of random decay and number of cycles."""
    c = np.arange(rows) / rows * cycles(rows, h, band) * rng.uniform(0.7, 1.3)
    return np.exp(-rng.uniform(0.1, 0.2) * c) * np.sin(2 * np.pi * c)


def staircase(rows, h, band, rng):
    """Levels up and down again, at each of them two minor loops of random size, by half cosines of one duration."""
    count = int(rng.integers(4, 7))
    levels = [0.0, -1.0]
    for sign, stairs in ((-1, np.linspace(-1, 1, count)), (1, np.linspace(1, -1, count))):
        size = sign * rng.uniform(0.15, 0.35)
        for v in stairs:
            levels += [v, np.clip(v + size, -1, 1), v, np.clip(v + size / 2, -1, 1), v]
    at = np.linspace(0, len(levels) - 1, rows)
    k = np.minimum(at.astype(int), len(levels) - 2)
    levels = np.array(levels)
    return levels[k] + (levels[k + 1] - levels[k]) * (1 - np.cos(np.pi * (at - k))) / 2


SIGNALS = {
    "multisine": multisine, "chirp": chirp, "decaying sine": decaying, "staircase": staircase,
    "nested reversals": nested,
}  # fmt: skip
NAMES = {  # what a page calls them; a sweep of breathing amplitude swings about the middle
    "multisine": "sums of tones",
    "chirp": "decaying oscillations",
    "decaying sine": "decaying oscillations",
    "staircase": "minor loops at several levels",
    "nested reversals": "nested reversals",
}
RECORDS = ("multisine", "chirp", "decaying sine", "staircase")


def moved(plant, u):
    """Output of a static plant whose solver takes no row at which the input stands still."""
    kept = np.append(True, np.diff(u) != 0)
    return plant(u[kept])[np.cumsum(kept) - 1]


class Case:
    """A device, the kind of model that is fitted to it, a record, and new signals with their measured outputs.

    Signals of other kinds stay in the frequencies of the record (those of one speed: within a factor of two) and below
    its greatest speed.
    """

    def __init__(self, number: int, seed: int) -> None:
        self.name = list(KINDS)[number % len(KINDS)]
        self.form = RECORDS[(number // len(KINDS) + number) % len(RECORDS)]
        rng = np.random.default_rng([seed, number])
        drawn = int(rng.integers(1 << 31))
        if self.name in FAMILIES:
            plant = draw_static(self.name, drawn)
            self.device = Device(STATIC_STEP, STATIC_BAND, lambda u, beside: moved(plant, u))
        else:
            self.device = draw_foreign(self.name, drawn)
        self.kind = str(rng.choice(KINDS[self.name]))
        self.noise = float(np.exp(rng.uniform(*np.log(NOISE))))
        u = self.signal(self.form, self.device.band, rng)
        y = self.device.run(u, None)
        self.sigma = self.noise * float(np.ptp(y))
        self.data = self.measured(u, y, rng)
        most, band = float(np.abs(np.diff(u)).max()), self.device.band
        if self.form in ("decaying sine", "staircase"):
            f = cycles(ROWS, self.device.h, band) / (ROWS * self.device.h)
            band = (f / 2, 2 * f)
        self.others = {}
        for form in SIGNALS:
            v = self.signal(form, self.device.band if form == self.form else band, rng)
            if form != self.form:
                v = 0.95 * v * min(1.0, most / float(np.abs(np.diff(v)).max()))
            self.others[form] = self.measured(v, self.device.run(v, None), rng)

    def signal(self, form, band, rng):
        """One signal."""
        return np.asarray(SIGNALS[form](ROWS, self.device.h, band, rng))

    def measured(self, u, y, rng):
        """A record with noise."""
        return hy.Dataset.from_signal(u, y + self.sigma * rng.normal(size=len(y)), self.device.h)
