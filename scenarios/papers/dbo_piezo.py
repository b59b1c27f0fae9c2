"""Errors of every kind of model, and published errors, on the record of a piezo stack (Aye & Ang 2018).

The stack is a PICMA P-885.91, sampled at 200 Hz. In our protocol P1, u[k] is column 1 (V) in row k of the test file,
and y[k] is column 5 (um) in row k + 1, because the sensor lags by one sample. The model is simulated from row 0. It is
fitted to rows 2000:4200 (one decaying sine) and tested on rows 3000:13800 (stroke 41.4 um). The test rows contain other
amplitudes than the training rows, and an input that is the output of an inverse. The repeatability of the stack is
0.071 um.

Data: github.com/yan9a/DiscreteBacklashOperator (MIT licence).
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.data import Dataset
from hystfmu.identify import METHODS, fit
from hystfmu.model import rms
from papers.table import Report, Row, Stated, report

ROW = Stated(__name__)

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
LEFT_OUT = ("auto", "bouc_wen_oscillator", "duhem_oscillator", "lugre", "maxwell_slip_oscillator", "modified_bouc_wen")
PUBLISHED = (
    ("sysidentpy, polynomial NARX (best of several)", 0.316),
    ("jax-sysid, neural state space", 0.285),
)


def measured(data: Path) -> tuple[Dataset, Array]:
    """Read the test file in the folder `data`, and return the data set of protocol P1 and the wanted displacement (um).

    The wanted displacement has shape (n,) and belongs to the same rows as the data set.

    Raises
    ------
    InputError
        The file is missing, or is not a table of at least nine columns with enough rows.
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
    """Fit a kind of model to the training rows, and return its RMS error (um) on the test rows, and a note.

    `key` is the kind of model, and `options` are its options. `run` is the data set of protocol P1. The note contains
    the number of parameters and the RMS error on the training rows.
    """
    model = fit(run, key, **options)
    note = f"{model.fit['parameters']} parameters, training {model.fit['rms']:.3f}"
    return rms((model.predict(run.u, run.h) - run.y)[RESULT]), note


def line(run: Dataset) -> float:
    """Fit a straight line y = a + b u to the training rows of `run`; return its RMS error (um) on the test rows."""
    columns = np.column_stack([np.ones(len(run.u)), run.u])
    c = np.linalg.lstsq(columns[TRAIN], run.y[TRAIN], rcond=None)[0]
    return rms((columns @ c - run.y)[RESULT])


def check(data: Path | None) -> None:
    """Raise an InputError if the folder `data` contains no valid test file. Without a folder, do nothing."""
    if data is not None:
        measured(data)


def table(data: Path | None, progress: Callable[[float], None]) -> Report:
    """Return a table of the RMS errors (um) of every kind of model on the test rows.

    Parameters
    ----------
    data : path, optional
        Folder with ``dbo_piezo/Test_Vi_Do_Di.dat``, or the folder of this file. By default, the table contains only
        published numbers.
    progress : function
        Function that is called with the completed fraction of the work, 0 to 1.
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
    return report(ROW, tuple(rows), source=source)


def _experiment(data: tuple[Array, Array] | None) -> list[Row]:
    """Return table rows of the RMS tracking error of the published experiment, without and with feed-forward.

    `data` contains the measured and the wanted displacement (um). From these, the printed errors are computed again.
    """
    rows = []
    for name, printed, part in (("no feed-forward", 1.68, WITHOUT), ("its inverse as feed-forward", 0.58, WITH)):
        ours, note = None, "needs the measured data"
        if data is not None:
            e = data[0][part] - data[1][part]
            ours, note = rms(e - e.mean()), "row by row about the mean; rows and lag of the sensor are not printed"
        rows.append(ROW("experiment", ours=ours, printed=printed, note=note, name=name))
    return rows
