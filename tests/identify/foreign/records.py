"""Records of foreign devices, and the signals that judge a model: all start from rest at 0 and stay in the band."""

import numpy as np

from foreign import truth
from foreign.devices import Device, draw
from hystfmu import Dataset

ROWS = 2000
NOISE = 5e-4  # standard deviation, share of the span of y


def multisine(rows, h, band, rng):
    """Tones from end to end of the band, rising from 0; of some random phases those with the most even ends."""
    t, f = np.arange(rows) * h, np.geomspace(*band, 24)
    tries = []
    for _ in range(30):
        tones = np.sin(2 * np.pi * f[:, None] * t + rng.uniform(0, 2 * np.pi, (24, 1)))
        u = (f**-0.4) @ tones * np.minimum(1.0, np.arange(rows) / (rows / 20))
        tries.append(u / np.abs(u).max())
    return min(tries, key=lambda u: float(np.abs(u.max() + u.min())))


def chirp(rows, h, band, rng):
    """Sweep over the band whose amplitude breathes."""
    t, f, g = np.arange(rows) / rows, band[0], band[1] / band[0]
    phase = 2 * np.pi * f * rows * h / np.log(g) * (g**t - 1)
    u = (0.65 + 0.35 * np.cos(2 * np.pi * (rng.uniform(2.5, 4.5) * t))) * np.sin(phase)
    return u / np.abs(u).max()


def decaying(rows, h, band, rng):
    """Decaying sine, eight to twelve cycles, in the middle of the band."""
    c = np.arange(rows) / rows * cycles(rows, h, band)
    return np.exp(-rng.uniform(0.1, 0.2) * c) * np.sin(2 * np.pi * c)


def cycles(rows, h, band):
    """Cycles of a decaying sine on these rows."""
    return float(np.clip(rows * h * np.sqrt(band[0] * band[1]), 8, 16))


def nested(rows, h, band, rng):
    """Half cosines between random levels, of random durations."""
    at, level, knots, levels = 0.0, 0.0, [0.0], [0.0]
    up = True
    while at < rows * h:
        at += float(np.exp(rng.uniform(*np.log(0.5 / np.array(band[::-1])))))
        at = max(at, knots[-1] + 20 * h)
        level = float(rng.uniform(level, 1.0) if up else rng.uniform(-1.0, level))
        up = not up
        knots.append(at)
        levels.append(level)
    t = np.arange(rows) * h
    k = np.searchsorted(knots, t, side="right").clip(1, len(knots) - 1)
    knots, levels = np.array(knots), np.array(levels)
    part = (t - knots[k - 1]) / (knots[k] - knots[k - 1])
    return levels[k - 1] + (levels[k] - levels[k - 1]) * (1 - np.cos(np.pi * part)) / 2


FORMS = {"multisine": multisine, "chirp": chirp, "decaying sine": decaying}


class Case:
    """A device, a record of it, and other signals with their outputs.

    The signals of a decaying sine stay within a factor of two of its frequency, and all below the greatest speed of
    the record: what it does not show cannot be known.
    """

    def __init__(self, name: str, form: str, seed: int) -> None:
        self.name, self.seed = name, seed
        self.device: Device = draw(name, seed)
        rng = np.random.default_rng([seed, len(name), list(FORMS).index(form)])
        d, band = self.device, self.device.band
        u = FORMS[form](ROWS, d.h, band, rng)
        if form == "decaying sine":
            f = cycles(ROWS, d.h, band) / (ROWS * d.h)
            band = (f / 2, 2 * f)
        self.data = self.record(u, rng, NOISE)
        most = float(np.abs(np.diff(u)).max())
        self.held_out = []
        for kind in (multisine, nested, decaying):
            v = 0.95 * kind(ROWS // 2, d.h, band, rng)
            self.held_out.append(self.record(v * min(1.0, most / float(np.abs(np.diff(v)).max())), rng, 0.0))

    def record(self, u, rng, noise):
        d, m = self.device, len(self.device.covariates)
        beside = np.cumsum(rng.normal(size=(len(u), m)), axis=0)
        low, high = beside.min(axis=0, initial=0.0), beside.max(axis=0, initial=0.0)
        beside = (1.0 if noise else 0.95) * (2 * (beside - low) / np.maximum(high - low, 1e-9) - 1)
        y = d.run(u, beside)
        y = y + noise * np.ptp(y) * rng.normal(size=len(y))
        given = {name: beside[:, k] for k, name in enumerate(d.covariates)}
        return Dataset(np.arange(len(u)) * d.h, u, y, covariates=given)

    def error(self, model) -> float:
        """RMS error over all held-out signals in % of the span of the record."""
        e = []
        for other in self.held_out:
            given = {name: values for name, _, values in other.covariates}
            used = {i.name for i in model.graph.inputs}
            given = {name: values for name, values in given.items() if name in used}
            e.append(model.predict(other.u, covariates=given) - other.y if given else model.predict(other.u) - other.y)
        return self.percent(e)

    def percent(self, errors) -> float:
        """RMS of the errors on the held-out signals in % of the span of the record."""
        return 100 * float(np.sqrt(np.mean(np.concatenate(errors) ** 2))) / self.data.span

    def truth(self) -> float:
        """Error (%FS) of the true structure, fitted to the record: as a graph where the blocks of the kit have it."""
        if self.name in truth.GRAPHS:
            return self.error(truth.by_graph(self.name, self.seed, self.data))
        run = truth.by_solver(self.name, self.seed, self.data)
        return self.percent([truth.played(run, other) - other.y for other in self.held_out])
