"""Measured piezo stack (Aye & Ang 2018, PICMA P-885.91, 200 Hz): errors of every model, and published errors.

Protocol P1: u[k] is column 1 (V) of row k of the test file, y[k] column 5 (um) of row k + 1, because the sensor lags
one sample. The model is simulated from row 0. The fit minimises the residuals of rows 2000:4200 (one decaying sine),
and rows 3000:13800 are the test (stroke 41.4 um). The test rows contain other amplitudes than the training rows, and an
input from a feed-forward inverse. The device repeats its cycles with an error of 0.071 um.

Data: github.com/yan9a/DiscreteBacklashOperator (MIT licence).
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.identify import METHODS, fit
from hystfmu.model.accuracy import rms
from papers.row import Row
from papers.table import Report

FILE = "Test_Vi_Do_Di.dat"
RATE = 200.0  # sampling rate (Hz)
TRAIN, RESULT = slice(2000, 4200), slice(3000, 13800)
WITHOUT, WITH = slice(2000, 7000), slice(7800, 13800)  # rows of the experiment without and with feed-forward

LIMITS = {  # largest allowed RMS errors (um)
    "prandtl_ishlinskii": 0.471,
    "zhao_tan_mlp": 0.30,
    "actuator": 0.203,
    "preisach": 0.14,
}
# kinds that are no separate methods, or that need resonances, which the data do not contain
LEFT_OUT = ("auto", "bouc_wen_oscillator", "duhem_oscillator")
PUBLISHED = (
    ("sysidentpy, polynomial NARX (best of several)", 0.316),
    ("jax-sysid, neural state space", 0.285),
)


def measured(data: Path) -> tuple[Dataset, Array]:
    """Return the data set of protocol P1 and the wanted displacement (um) of the same rows, shape (n,).

    Raises
    ------
    InputError
        The file is missing, or is not a table of at least nine columns.
    """
    places = (data / "dbo_piezo" / FILE, data / FILE)
    path = next((p for p in places if p.is_file()), None)
    if path is None:
        raise InputError(f"{data}: The folder must hold dbo_piezo/{FILE} or {FILE}. Got neither.")
    try:
        rows = np.loadtxt(path, ndmin=2)
    except ValueError as e:
        raise InputError(f"{path}: The file must be a table of numbers. Got {e} instead.") from None
    if rows.shape[1] < 9 or len(rows) <= RESULT.stop:
        raise InputError(
            f"{path}: The table must have at least 9 columns and more than {RESULT.stop} rows. "
            f"Got {rows.shape[1]} and {len(rows)} instead."
        )
    t = np.arange(len(rows) - 1) / RATE
    run = Dataset(t, rows[:-1, 0], rows[1:, 4], "dbo_piezo", str(path), TRAIN, "V", "um")
    return run, rows[1:, 8]


def score(run: Dataset, key: str, **options: Any) -> tuple[float, str]:
    """Return the test error of a model (um), and a note with the size and the training error of the model."""
    model = fit(run, key, **options)
    note = f"{model.fit['parameters']} parameters, training {model.fit['rms']:.3f}"
    return rms((model.predict(run.u, run.h) - run.y)[RESULT]), note


def line(run: Dataset) -> float:
    """Return the test error (um) of a straight line y = a + b u, fitted and tested as every model."""
    columns = np.column_stack([np.ones(len(run.u)), run.u])
    c = np.linalg.lstsq(columns[TRAIN], run.y[TRAIN], rcond=None)[0]
    return rms((columns @ c - run.y)[RESULT])


def check(data: Path | None) -> None:
    """Raise an InputError if the folder `data` has no test file or a damaged one."""
    if data is not None:
        measured(data)


def table(data: Path | None, progress: Callable[[float], None]) -> Report:
    """Return a table of the RMS errors (um) of every model on the test rows.

    Parameters
    ----------
    data : path, optional
        Folder with ``dbo_piezo/Test_Vi_Do_Di.dat``, or the folder of this file. By default, the table has only
        published numbers.
    progress : function
        Function that is called with the completed fraction of the work.
    """
    source = "Aye & Ang 2018, PICMA P-885.91, 200 Hz; protocol P1, RMS in um of a stroke of 41.4 um"
    published = [Row(f"model: {name}", reported=value, group="reported") for name, value in PUBLISHED]
    if data is None:
        note = f"no models: the measured data are not part of this package; give --data DIR with dbo_piezo/{FILE}"
        return Report("dbo_piezo", source, (*_experiment(None), *published), (note,))
    run, wanted = measured(data)
    rows = [*_experiment((run.y, wanted)), *published]
    rows.append(Row("model: straight line", ours=line(run), note="2 parameters"))
    keys = [key for key in METHODS if key not in LEFT_OUT]
    for i, key in enumerate(keys):
        progress(i / len(keys))
        error, note = score(run, key)
        # as in the text of Zhao & Tan, a branch starts from the last extremum
        literal = score(run, key, memory="last")[0] if key == "zhao_tan_mlp" else None
        rows.append(Row(f"model: {key}", literal=literal, ours=error, target=LIMITS.get(key), note=note))
    return Report(
        "dbo_piezo",
        source,
        tuple(rows),
        (
            "fitted to rows 2000:4200 (one decaying sine), tested on rows 3000:13800; repeatability 0.071 um",
            "all options are defaults; ridge and range, where selected, are selected on the training rows only",
            "the rate-dependent terms of preisach were developed on this record",
        ),
    )


def _experiment(data: tuple[Array, Array] | None) -> list[Row]:
    """Return rows of the printed tracking errors, and of those computed from the measured displacement."""
    rows = []
    for name, printed, part in (("no feed-forward", 1.68, WITHOUT), ("its inverse as feed-forward", 0.58, WITH)):
        ours, note = None, "needs the measured data"
        if data is not None:
            e = data[0][part] - data[1][part]
            ours, note = rms(e - e.mean()), "row by row about the mean; rows and lag of the sensor are not printed"
        rows.append(
            Row(
                f"tracking error of the experiment, {name}",
                printed,
                ours=ours,
                note=note,
                place="experiment",
                sense="equal",
            )
        )
    return rows
