"""Check of a device by a new record: whether the device has changed since the fit of its model, and in what way.

The model is simulated with the input of the record. Its RMS error is computed on the rows whose input lies in the
trained range. This error is compared with the error in the model file: the error on held-out rows if the file contains
it, otherwise the error on the training rows. Then four corrections of the model output y are fitted separately to the
measured output by least squares. Each correction represents one change of the device:

- offset: y + a. The mean changed, for example by a sensor offset or the temperature.
- gain: a + b y. The stroke changed, for example by depolarisation, another spring, or a sensor gain.
- lag: a + b y, where y is shifted by some rows. The timing changed, for example by the sampling of the sensor.
- loop: a + b y + c u + a sum of plays of u. The shape of the hysteresis loop changed.

The reported change is the first one in this list whose correction leaves an error of at most `AS_GOOD` times the
smallest remaining error or `AS_GOOD` times the stated error of the model. The correction "loop" has more weights than
the others, so it also reduces the error that the model already had on its own record.
"""

from dataclasses import dataclass

import numpy as np

from hystfmu.base import Array, InputError, Mask
from hystfmu.data import Dataset
from hystfmu.identify.features.plays import thresholds, with_plays
from hystfmu.model import Model, rms, run_along
from hystfmu.model.coverage import KEY, span_of

FACTOR = 2.0  # ratio of the new error to the error of the fit above which the device counts as drifted
AS_GOOD = 1.25
MOST_LAG = 8  # largest lag (rows)
PLAYS = 10
MOST_ROWS = 4000  # maximum number of rows of a regression; more rows are thinned evenly
LEAST_ROWS = 4 * (PLAYS + 3)


@dataclass(frozen=True)
class Part:
    """A tested correction: its name, its value as a text, and the RMS error `left` after this correction."""

    name: str
    value: str
    left: float


@dataclass(frozen=True)
class DeviceCheck:
    """Result of the check of a device.

    Parameters
    ----------
    drifted : bool
        Whether the RMS error on the new record is more than `factor` times the error `stated`.
    rms, max : float
        RMS error and largest absolute error of the model on the new record, in the unit of measure of y.
    stated : float
        RMS error in the model file.
    of : str
        Rows for which `stated` was computed: ``held-out`` or ``training``.
    factor : float
        Ratio of the errors above which the device counts as drifted.
    inside : float
        Percentage of the rows whose input lies in the trained range. Only these rows are used.
    reached : float
        Percentage of the trained range that the input of the new record covers.
    parts : tuple of Part
        The four corrections.
    moved : str
        Name of the correction for the reported change. Empty if the device has not drifted.
    hidden_gain : float
        Change of the gain in percent up to which the error stays below `factor` times `stated`: a smaller change does
        not show on the new record. 0 if the device has drifted.
    """

    drifted: bool
    rms: float
    max: float
    stated: float
    of: str
    factor: float
    inside: float
    reached: float
    parts: tuple[Part, ...]
    moved: str
    hidden_gain: float

    def __str__(self) -> str:
        """Return the result in one line: whether the device has drifted, the RMS error, and its ratio to `stated`."""
        ratio = f"{self.rms / self.stated:.3g} times the {self.of} error of the fit"
        if not self.drifted:
            return f"no drift: RMS {self.rms:.4g}, {ratio}; a gain change below {self.hidden_gain:.2g} % does not show"
        return f"drifted: RMS {self.rms:.4g}, {ratio}; the {self.moved} moved most"


def check_device(model: Model, data: Dataset, factor: float = FACTOR) -> DeviceCheck:
    """Compare a model with a new record of its device; see `hystfmu.Model.check`.

    The file of the model must contain its RMS error and the range of its input. The factor must be greater than 1. If
    the device has not drifted, the record must be large enough to show a change of the gain by 100 %.
    """
    where = data.path or data.name
    if not data.has_output:
        raise InputError(f"{where}: The data must have a measured output to compare with. Got none.")
    if not factor > 1:
        raise InputError(f"The factor of a check must be greater than 1. Got {factor:g} instead.")
    of = "held-out" if "held_out_rms" in model.fit else "training"
    stated = model.fit.get("held_out_rms" if of == "held-out" else "rms")
    if not (isinstance(stated, float) and stated > 0):
        raise InputError(
            f"The model to check with must state its RMS error, fit.rms > 0. Got {stated!r} of {model.key}."
        )
    span = span_of(model)
    if span is None:
        got = model.provenance.get(KEY)
        raise InputError(f"The model to check with must state provenance.{KEY} = [least, largest]. Got {got!r}.")
    counted = (data.u >= span[0]) & (data.u <= span[1])
    if counted.sum() < LEAST_ROWS:
        unit = f" {data.unit_u}" if data.unit_u else ""
        raise InputError(
            f"{where}: At least {LEAST_ROWS} rows must have an input within the trained range, {span[0]:g} to "
            f"{span[1]:g}{unit}. Got {counted.sum()} rows."
        )
    y = run_along(model.graph, data)
    e = (data.y - y)[counted]
    error = rms(e)
    parts = _parts(data, y, counted)
    drifted = error > factor * stated
    seen = np.clip(data.u[counted], *span)
    size, room = float(np.std(y[counted])), float(np.sqrt(max((factor * stated) ** 2 - error**2, 0.0)))
    if room > size:
        raise InputError(
            f"{where}: The output of the model must move enough to show a change of its gain. "
            f"Got {size:.3g} RMS; errors up to {factor * stated:.3g} RMS are no drift."
        )
    return DeviceCheck(
        drifted,
        error,
        float(np.abs(e).max()),
        stated,
        of,
        factor,
        100 * float(counted.mean()),
        100 * float(np.ptp(seen)) / (span[1] - span[0]),
        parts,
        _moved(parts, stated) if drifted else "",
        100 * room / size if room else 0.0,
    )


def _moved(parts: tuple[Part, ...], stated: float) -> str:
    """Return the simplest correction that restores the stated error of the model, or almost the least error."""
    least = max(min(p.left for p in parts), stated)
    return next(p.name for p in parts if p.left <= AS_GOOD * least)


def _parts(data: Dataset, y: Array, counted: Mask) -> tuple[Part, ...]:
    """Fit each correction separately by least squares on the rows `counted`, whose input is in the trained range."""
    rows = np.flatnonzero(counted)
    rows = rows[(rows >= MOST_LAG) & (rows < len(y) - MOST_LAG)]
    rows = rows[:: -(-len(rows) // MOST_ROWS)]
    measured, ones = data.y[rows], np.ones(len(rows))

    def solved(*columns: Array) -> tuple[Array, float]:
        a = np.column_stack(columns)
        x = np.asarray(np.linalg.lstsq(a, measured, rcond=None)[0], dtype=np.float64)
        return x, rms(measured - a @ x)

    offset = float(np.mean(measured - y[rows]))
    found = [Part("offset", f"{offset:+.4g}", rms(measured - y[rows] - offset))]
    (_, gain), left = solved(ones, y[rows])
    found.append(Part("gain", f"{gain:.4g}", left))
    late = {k: solved(ones, y[rows - k])[1] for k in range(-MOST_LAG, MOST_LAG + 1)}
    lag = min(late, key=lambda k: (late[k], abs(k)))
    found.append(Part("lag", f"{lag:+d} rows ({lag * data.h:+.3g} s)", late[lag]))
    r = thresholds(data.u, PLAYS)
    columns = data.along(lambda u: with_plays(u, r, float(u[0])))[rows].T
    found.append(Part("loop", f"{len(columns)} further weights", solved(ones, y[rows], *columns)[1]))
    return tuple(found)
