"""Computes the errors of a model on the parts of a record, and the 95 % interval of the errors on new rows.

A model contains the interval as ``fit["interval"]``.

The interval is computed from errors on rows that the fit did not use (`hystfmu.model.accuracy`), that is, from errors
on the rows outside the training rows. If all rows are training rows, the interval is computed by cross-validation over
validation blocks between reversals: for each fold of blocks, the same kind of model is fitted without these blocks, and
its errors on these blocks are used (Barber, Candes, Ramdas & Tibshirani, Annals of Statistics 49 (2021) 486-507). If
only one block reaches an end of the input range, a fit without this block must extrapolate, but a new signal of the
same kind needs no extrapolation. For such a block, the errors of the fit to all rows are used. They are multiplied by
the ratio of held-out errors to fit errors on the other blocks.

The interval holds for signals like the signal of the record. For other signals within the range and the speeds of the
record, it holds in two cases: the held-out errors are not larger than the noise of the output, or the record contains
almost all states (input and memory) that these signals reach. The text of the interval names the signals for which it
is not known to hold.
"""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise
from hystfmu.model import M, Model, run_along
from hystfmu.model.accuracy import Interval, errors, interval, rms
from hystfmu.report.page import Table, figure_of

LEAST = 4  # rows with a varying output that an error needs


@dataclass(frozen=True)
class Part:
    """Name of a part of the rows, and the errors on this part (see `hystfmu.model.accuracy.errors`)."""

    name: str
    rows: slice
    errors: dict[str, float]


def free_run(model: Model, data: Dataset) -> Array:
    """Return the simulated output of a model, shape (n,). Each record starts from the initial state."""
    return run_along(model.graph, data)


def parts(y: Array, data: Dataset, fitted: bool) -> list[Part]:
    """Return the errors of a simulated output y (n,) on training rows, held-out rows and records.

    Parameters
    ----------
    y : array, shape (n,)
        Output of the model.
    data : Dataset
        Data with a measured output.
    fitted : bool
        Whether the model was fitted to the training rows. If True, percent errors refer to the span of y in the
        training rows. If False, training rows are not a separate part, and percent errors refer to the span of y in all
        rows.
    """
    n, train = len(data.t), data.train
    named: list[tuple[str, slice]] = []
    whole = (train.start, train.stop) == (0, n)
    if fitted:
        named.append(("training rows", train))
        named += [("held-out rows", slice(*ends)) for ends in ((0, train.start), (train.stop, n))]
    if not fitted:
        named.append(("all rows", slice(0, n)))
    if len(data.starts) > 1:
        named += [(f"record {k}", rows) for k, rows in enumerate(data.records, 1)]
    span = data.span if fitted and not whole else float(np.ptp(data.y))
    if not span > 0:
        return []
    return [
        Part(name, rows, errors(y[rows], data.y[rows], span)) for name, rows in named if rows.stop - rows.start >= LEAST
    ]


def table_of(found: list[Part], unit: str) -> Table:
    """Return a table of the errors `found` on parts of the rows. `unit` is the unit of measure of y."""
    of = f" ({unit})" if unit else ""
    head = ("errors", "rows", "RMS %FS", "max %FS", f"RMS{of}", f"max{of}")
    keys = ("rms_percent", "max_percent", "rms", "max")
    rows = [(p.name, f"{p.rows.start}:{p.rows.stop}", *(figure_of(p.errors[k], k) for k in keys)) for p in found]
    return Table(head, rows)


def held_out_errors(y: Array, data: Dataset) -> Array:
    """Return the measured minus the simulated output on the rows outside the training rows, shape (m,)."""
    e = data.y - y
    return np.concatenate([e[: data.train.start], e[data.train.stop :]])


FOLDS = (1, 2)  # of every four blocks; never the first, which alone starts from rest, nor those that kinds hold out
FAILED = 2.0  # times the error on the rows that both fitted: a search that ended elsewhere
AS_NOISE = 1.3  # times the noise: held-out errors that leave nothing to explain


@dataclass(frozen=True)
class Known:
    """An interval of errors, and the signals for which it is valid.

    Parameters
    ----------
    interval : Interval
    rows_of : str
        Text that describes the rows from which the interval was computed.
    noise_only : bool
        Whether the held-out errors are as small as the noise.
    not_for : tuple of str
        Kinds of signals for which the interval may be invalid, although they lie in the range of the record.
    """

    interval: Interval
    rows_of: str
    noise_only: bool
    not_for: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the interval as plain values that a file can contain."""
        return {**asdict(self.interval), "of": self.rows_of, "noise_only": self.noise_only, "not_for": [*self.not_for]}

    @classmethod
    def from_dict(cls, table: dict[str, Any]) -> "Known":
        """Build the object from the result of `to_dict`."""
        own = {"of", "noise_only", "not_for"}
        found = Interval(**{k: v for k, v in table.items() if k not in own})
        return cls(found, table["of"], table["noise_only"], tuple(table["not_for"]))


def with_interval(model: M, data: Dataset) -> M:
    """Return the model with the interval of its errors, or the same model if `data` contains too few rows."""
    found = known(model, data)
    return model if found is None else replace(model, fit={**model.fit, "interval": found.to_dict()})


def known(model: Model, data: Dataset) -> Known | None:
    """Return the interval of the errors of a model that was fitted to `data`, or None if there are too few rows.

    If `with_interval` has already stored the interval in the model, this interval is returned.
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
    """Return the errors on held-out blocks by cross-validation, shape (m,). The result is empty if no fit succeeds.

    Parameters
    ----------
    model : Model
        Model with the kind and the options of the fits.
    data : Dataset
        Data of the fit; all rows are training rows.
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
    """Fit a model of the same kind, with the same options and seed, to the training rows of `data`."""
    from hystfmu.identify import GRAPH, fit_graph
    from hystfmu.identify.one import fit_one

    options, seed = model.provenance.get("options", {}), model.provenance.get("seed", 0)
    if model.key == GRAPH:
        return fit_graph(data, model.graph, model.provenance["free"], seed, **{**options, "starts": 1})
    return fit_one(data, model.key, seed, lambda done: None, options)


def _elsewhere(e: Array, data: Dataset) -> tuple[bool, tuple[str, ...]]:
    """Return whether the errors `e` are as small as noise, and the kinds of signals that `e` does not represent."""
    from hystfmu.identify.excitation.not_shown import SPEEDS, kinds_not_shown, one_speed

    noise_only = rms(e) <= AS_NOISE * noise(data.y[data.train])
    speeds = (SPEEDS,) if one_speed(data) else ()
    return noise_only, (*(() if noise_only else kinds_not_shown(data)), *speeds)


def interval_text(found: Known | None, unit: str) -> str:
    """Return a text that states the interval of errors on new rows, and the signals for which it is valid."""
    if found is None:
        return "No interval for new rows: an interval needs 80 rows that no fit has used."
    of, i = f" {unit}" if unit else "", found.interval
    why = "the held-out errors are not larger than noise" if found.noise_only else "the record shows their states"
    others = f"It holds for other signals within the range and the speeds of the record as well: {why}."
    if found.not_for:
        others = f"It holds for signals like those of the record. It is not known to hold for {_listed(found.not_for)}."
    return (
        f"The error of a row of a new record is within +-{i.half_width:.4g}{of} with a probability of 95 % (conformal "
        f"over {i.blocks} blocks of the errors {found.rows_of}). {others} Test with each block omitted in turn: "
        f"{i.coverage:.1f} % of {i.rows} rows are inside, {i.lowest:.0f} % in the worst block."
    )


def _listed(names: tuple[str, ...]) -> str:
    return " or ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
