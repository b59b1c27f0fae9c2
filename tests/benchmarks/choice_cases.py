"""Cells of the choice benchmark: a family of plants and a form of the data; a seed draws both.

Families of `random_plants` are static and of the classes of the kit; those of `foreign` come from the literature, with
dynamics, covariates and solvers of their own.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "oracles"))
sys.path.insert(0, str(Path(__file__).parent.parent / "identify"))

import numpy as np
from foreign import records
from foreign.devices import DEVICES
from random_plants import FAMILIES, draw

from hystfmu import Dataset, signals
from hystfmu.identify import METHODS
from hystfmu.identify.catalogue import candidates

H = 1e-3  # s, time between rows of a static plant
EQUAL = 0.05  # %FS: smaller errors count as equal, and those below twice the noise
TRUTH = "truth"  # key of the fit of the true structure
DYNAMICS = ("bouc_wen_oscillator", "duhem_oscillator", "narx_network")  # of no use on a static plant


def _nested(rng):
    return signals.training(40, int(rng.integers(1 << 31)), 0.015)


def _decaying(rng):
    return signals.decaying_sine(10, rng.uniform(0.07, 0.15))


def _staircase(rng):
    """Minor loops at rising offsets."""
    return signals.minor_loops(int(rng.integers(7, 12)), rng.uniform(0.12, 0.25), 100)


def _few(rng):
    return signals.training(40, int(rng.integers(1 << 31)), 0.08)[:200]


# input, noise (share of the span of y), then scale and offset of u and y
DATA = {
    "nested reversals": (_nested, 0.0, (1.0, 0.0), (1.0, 0.0)),
    "decaying sine": (_decaying, 0.0, (1.0, 0.0), (1.0, 0.0)),
    "staircase": (_staircase, 0.0, (1.0, 0.0), (1.0, 0.0)),
    "200 rows": (_few, 0.0, (1.0, 0.0), (1.0, 0.0)),
    "0.5 % noise": (_nested, 0.005, (1.0, 0.0), (1.0, 0.0)),
    "volts and metres": (_nested, 0.0, (50.0, 50.0), (1e-6, 0.0)),
    "offset": (_nested, 0.0, (1.0, 3.0), (1.0, 10.0)),
}
STATIC = [(family, form) for family in FAMILIES for form in DATA]
FOREIGN = [(name, form) for name in DEVICES for form in records.FORMS]


class Case:
    """One static plant and one record of it."""

    def __init__(self, family, form, seed):
        self.plant = draw(family, seed)
        excite, noise, self.to_u, self.to_y = DATA[form]
        rng = np.random.default_rng([seed, list(FAMILIES).index(family), list(DATA).index(form)])
        x = excite(rng)
        y = self.out(x)
        y = y + noise * np.ptp(y) * rng.normal(size=len(y))
        self.data = Dataset.from_signal(self.into(x), y, H)
        self.held_out = [(self.into(x), self.out(x)) for x in signals.held_out(int(rng.integers(1 << 31))).values()]

    def into(self, x):
        return self.to_u[0] * x + self.to_u[1]

    def out(self, x):
        return self.to_y[0] * self.plant(x) + self.to_y[1]

    def error(self, model):
        """RMS error over all held-out signals in % of the span of the training rows."""
        e = np.concatenate([model.predict(u) - y for u, y in self.held_out])
        return 100 * float(np.sqrt(np.mean(e**2))) / self.data.span


def case(family, form, seed):
    """One device and one record of it."""
    return records.Case(family, form, seed) if family in DEVICES else Case(family, form, seed)


def equal(family, form):
    """Errors below this one (%FS) count as equal."""
    return max(EQUAL, 200 * (records.NOISE if family in DEVICES else DATA[form][1]))


def options(key, family):
    """Options with which a kind stands for itself: a NARX network as small as the choice takes it."""
    return dict(next(c.options for k, c in candidates().values() if k == key)) if key == "narx_network" else {}


def kinds(family):
    """Kinds that are compared on a plant, the choice first, then those that are often the best."""
    first = ["auto", "prandtl_ishlinskii", "bouc_wen", "actuator"]
    left = [k for k in METHODS if k not in first and (family in DEVICES or k not in DYNAMICS)]
    return [*first, *left]


def asked(family):
    """Kinds, and the true structure of devices whose solvers are not of the kit."""
    return [*kinds(family), *([TRUTH] if family in DEVICES else [])]
