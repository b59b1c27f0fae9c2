"""Evidence in a record for linear dynamics after a hysteresis, as numbers with standard errors."""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.identify.evidence.found import Evidence, Mode
from hystfmu.identify.evidence.search import modes
from hystfmu.identify.evidence.spectra import Window, cells_of, response
from hystfmu.identify.evidence.told import Seen, density_of, left_over, static_gain, told

__all__ = ["Evidence", "Mode", "evidence"]


def evidence(data: Dataset, v: Array | None = None) -> Evidence:
    """Find band, frequency response, modes, delay and noise of records.

    Parameters
    ----------
    data : Dataset
        Data with a measured output; only its training rows are used.
    v : array, shape (n,), optional
        Output of the static hysteresis before the dynamics; default the input.
    """
    rows = [slice(max(r.start, data.train.start), min(r.stop, data.train.stop)) for r in data.records]
    windows = tuple(w for r in rows if r.stop > r.start and (w := Window.of(r)))
    x = np.asarray(data.u if v is None else v, dtype=np.float64)
    wide, high = float(np.ptp(x)), float(np.ptp(data.y[data.train]))
    if not windows or not wide > 0 or not high > 0:
        none = np.zeros(0)
        return Evidence(data.h, "foh", (0.0, 0.0), none, none, none, none, none, (), 0.0, np.inf, np.nan, np.nan)
    x, y = (x - x[0]) / wide, (data.y - data.y[0]) / high
    cells = cells_of(windows, data.h, x, y)
    seen = Seen(data.h, x, y, data.records, windows, cells, response(cells))
    found = modes(seen)
    hold, fitted = ("smooth", None) if found is None else found
    left = seen.y if fitted is None else left_over(seen, hold, fitted)
    density = density_of(seen, left)
    r, static = seen.response, static_gain(seen.response, fitted)
    known, delay, delay_se = told(fitted, seen, left, density)
    return Evidence(
        h=data.h,
        hold=hold,
        band=r.band(),
        f=r.f,
        gain=np.abs(r.g) / static,
        phase=np.unwrap(np.angle(r.g)) if len(r.g) else np.zeros(0),
        coherence=r.coherence,
        significant=r.level,
        modes=known,
        delay=delay,
        delay_se=delay_se,
        noise=high * density * float(np.sqrt(0.5 / data.h)),
        noise_density=high * density,
    )
