"""The 95 % interval of a fit, kept with the model as ``fit["interval"]``: one verdict for terminal, page and JSON.

Errors on rows that were held out of a fit give the interval (`hystfmu.model.conformal`): those outside the training
rows, or, where all rows were fitted, those of validation blocks between reversals.  The same kind is fitted without the
blocks of a fold, and its errors there count (cross-validation; Barber, Candes, Ramdas & Tibshirani, Annals of
Statistics 49 (2021) 486-507).  Where a block alone reaches an end of the range, a fit without it extrapolates, as no
new signal of the kind asks of the model; there the errors of the fit to all rows count, as much larger as held-out rows
err more elsewhere.

The interval counts for signals like the record's.  Within the range and the speeds of the record it counts for others
too if the held-out errors are no more than the noise of the output, or if the record shows their states; what it does
not show is named.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any, TypeVar

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise
from hystfmu.face.rows import free_run, held_out_errors
from hystfmu.model import Model
from hystfmu.model.accuracy import rms
from hystfmu.model.conformal import Interval, interval

M = TypeVar("M", bound=Model)
FOLDS = (1, 2)  # of every four blocks; never the first, which alone starts from rest, nor those that kinds hold out
FAILED = 2.0  # times the error on the rows that both fitted: a search that ended elsewhere
AS_NOISE = 1.3  # times the noise: held-out errors that leave nothing to explain


@dataclass(frozen=True)
class Known:
    """An interval and the signals that it counts for.

    Parameters
    ----------
    interval : Interval
    rows_of : str
        Rows that it was computed from.
    noise_only : bool
        Whether the held-out errors are no more than noise.
    not_for : tuple of str
        Kinds of signals within the range of the record for which it is not known to hold.
    """

    interval: Interval
    rows_of: str
    noise_only: bool
    not_for: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, for a file."""
        return {**asdict(self.interval), "of": self.rows_of, "noise_only": self.noise_only, "not_for": [*self.not_for]}

    @classmethod
    def from_dict(cls, table: dict[str, Any]) -> Known:
        """Return what `to_dict` wrote."""
        own = {"of", "noise_only", "not_for"}
        found = Interval(**{k: v for k, v in table.items() if k not in own})
        return cls(found, table["of"], table["noise_only"], tuple(table["not_for"]))


def with_interval(model: M, data: Dataset) -> M:
    """Return the model with the interval of its fit to `data`; without one where the rows are too few."""
    found = known(model, data)
    return model if found is None else replace(model, fit={**model.fit, "interval": found.to_dict()})


def known(model: Model, data: Dataset) -> Known | None:
    """Find the interval of a model fitted to the training rows of `data`; None for too few rows.

    What `with_interval` kept is not computed again.
    """
    made_of = {"sha256": data.sha256, "train": f"{data.train.start}:{data.train.stop}"}
    if "interval" in model.fit and made_of.items() <= model.provenance.items():
        return Known.from_dict(model.fit["interval"])
    y = free_run(model, data)
    if (data.train.start, data.train.stop) != (0, len(data.t)):
        e, which = held_out_errors(y, data), "on held-out rows"
    else:
        e = cross_errors(model, data, data.y - y)
        which = f"on blocks between reversals, each held out of one of {len(FOLDS)} fits of the same kind"
    found = interval(e)
    return None if found is None else Known(found, which, *_elsewhere(e, data))


def cross_errors(model: Model, data: Dataset, e: Array) -> Array:
    """Return the errors on held-out blocks, in order, shape (m,); empty if no fit without blocks succeeds.

    Parameters
    ----------
    model : Model
        Its kind and options are those of the fits.
    data : Dataset
        Data that were fitted as a whole.
    e : array, shape (n,)
        Errors of `model`.
    """
    from hystfmu.identify.cuts import validation_rows, without_outermost

    tested, alone = np.full(len(e), np.nan), np.zeros(len(e), dtype=bool)
    for fold in FOLDS:
        held = validation_rows(data.u, fold)
        part = data.with_held(held)
        try:
            again = free_run(_again(model, part), data)
        except InputError:
            continue
        kept = data.u[~held]
        if rms((data.y - again)[~held]) > FAILED * rms(e[~held]) + 1e-12 * data.span:
            continue
        inside = without_outermost(data.u, held) & (data.u >= kept.min()) & (data.u <= kept.max())
        tested[inside] = (data.y - again)[inside]
        alone |= held & ~inside
    some = np.isfinite(tested)
    if not some.any():
        return np.zeros(0)
    more = rms(tested[some]) / max(rms(e[some]), 1e-300)
    tested[alone] = max(more, 1.0) * e[alone]
    return np.asarray(tested[np.isfinite(tested)])


def _again(model: Model, data: Dataset) -> Model:
    """Fit the same kind with the same options to other rows."""
    from hystfmu.identify import GRAPH, fit_graph
    from hystfmu.identify.one import fit_one

    options, seed = model.provenance.get("options", {}), model.provenance.get("seed", 0)
    if model.key == GRAPH:
        return fit_graph(data, model.graph, model.provenance["free"], seed, **{**options, "starts": 1})
    return fit_one(data, model.key, seed, lambda done: None, options)


def _elsewhere(e: Array, data: Dataset) -> tuple[bool, tuple[str, ...]]:
    """Return whether errors are no more than noise, and the kinds of signals that they say nothing about."""
    from hystfmu.identify.excitation.not_shown import SPEEDS, kinds_not_shown, one_speed

    noise_only = rms(e) <= AS_NOISE * noise(data.y[data.train])
    speeds = (SPEEDS,) if one_speed(data) else ()
    return noise_only, (*(() if noise_only else kinds_not_shown(data)), *speeds)


def interval_text(found: Known | None, unit: str) -> str:
    """State the interval of errors on new rows, and the signals for which it holds, in a few sentences."""
    if found is None:
        return "No interval for new rows: it needs 80 rows that no fit has seen."
    of, i = f" {unit}" if unit else "", found.interval
    why = "the held-out errors are no more than noise" if found.noise_only else "the record shows their states"
    others = f"It holds for other signals within the range and the speeds of the record as well: {why}."
    if found.not_for:
        others = f"It is for signals like the record's; it is not known to hold for {_listed(found.not_for)}."
    return (
        f"The error of a row of a new record is within +-{i.half_width:.4g}{of} with a probability of 95 % (conformal "
        f"over {i.blocks} blocks of the errors {found.rows_of}). {others} Measured with each block left out: "
        f"{i.coverage:.1f} % of {i.rows} rows are inside, {i.lowest:.0f} % in the worst block."
    )


def _listed(names: tuple[str, ...]) -> str:
    return " or ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
