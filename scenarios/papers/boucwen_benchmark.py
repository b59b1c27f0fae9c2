"""Bouc-Wen benchmark of nonlinearbenchmark.org: errors of grey-box, structured Duhem and black-box models.

The three models are trained on one period of a multisine, 8192 rows with 8e-6 m of white noise. A simulation of the
benchmark system generates this record. Its phases differ from those of the test signals. The models are simulated
without measured outputs on the two official test records. Without these files, generated test records are used instead:
another multisine, and the sine sweep of the benchmark, whose force is given by a formula.

The table also contains published test errors on the multisine: best linear model, dynoNet (Forgione & Piga 2021),
polynomial nonlinear state-space model (PNLSS), and state-space neural networks (SS-NN, gr-SS-NN).

Noel & Schoukens, Hysteretic benchmark with a dynamic nonlinearity, 2016.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from hystfmu.base import Array, InputError, extras
from hystfmu.data import Dataset, signals, synthetic
from hystfmu.data.synthetic import DECIMATE_MULTISINE, DECIMATE_SWEEP, RATE, UPSAMPLING, benchmark_multisine, decimate
from hystfmu.identify import fit
from hystfmu.model import accuracy, rms
from papers.table import Report, Row, Stated, report

ROW = Stated(__name__)

NOISE = 8e-6  # RMS of the noise on the training displacement (m)
ROWS, SEED = 8192, 7  # number of rows and seed of the training multisine
COARSER = 2  # the Duhem model is sampled at 7.5 kHz, half the rate of the benchmark
PUBLISHED = (
    ("linear", 1.67e-4),
    ("dynoNet", 4.5e-5),
    ("PNLSS", 1.2e-5),
    ("SS-NN", 8.9e-6),
    ("gr-SS-NN", 7.5e-6),
)


@dataclass(frozen=True)
class Records:
    """Test records of the benchmark.

    `multisine` and `sweep` are pairs of force (N) and displacement (m), sampled at 750 Hz. `official` is False for
    generated records.
    """

    multisine: tuple[Array, Array]
    sweep: tuple[Array, Array]
    official: bool


def records(data: Path | None) -> Records:
    """Return the test records of the benchmark.

    The records are read from ``boucwen_benchmark/test.h5`` or ``test.h5`` in the folder `data`. If `data` is None, they
    are generated.

    Raises
    ------
    InputError
        The file is missing, has another content, or cannot be read because h5py is not installed.
    """
    if data is None:
        u = synthetic.multisine(8192, seed=SEED + 1)
        force = synthetic.sweep()
        sweep = (force[::UPSAMPLING], synthetic.benchmark_sweep(force))
        return Records((u, benchmark_multisine(u)), sweep, False)
    places = (data / "boucwen_benchmark" / "test.h5", data / "test.h5")
    path = next((p for p in places if p.is_file()), None)
    if path is None:
        raise InputError(f"{data}: The folder must hold boucwen_benchmark/test.h5 or test.h5. Got neither.")
    with extras(f"{path}: reading it"):
        import h5py
    try:
        with h5py.File(path) as f:
            pairs = [(np.ravel(f[k]["u"]), np.ravel(f[k]["y"])) for k in ("multisine", "sinesweep")]
    except (OSError, KeyError) as e:
        raise InputError(
            f"{path}: The file must hold the groups multisine and sinesweep with u and y. Got {e} instead."
        ) from None
    return Records(pairs[0], pairs[1], True)


def finer(v: Array, factor: int) -> Array:
    """Return one period v (n,) of a band-limited signal, interpolated to n * factor samples."""
    return np.asarray(np.fft.irfft(np.fft.rfft(v), len(v) * factor) * factor)


def sampled(y: Array, factors: tuple[int, ...]) -> Array:
    """Return a displacement y, decimated from 15 kHz to 750 Hz in several steps with the given factors."""
    for factor in factors:
        y = decimate(y, factor)
    return y


def training() -> tuple[Array, Array]:
    """Return force (N) and noisy displacement (m) of the training record, one period (ROWS,) in the steady state."""
    u = synthetic.multisine(ROWS, seed=SEED)
    return u, benchmark_multisine(u) + NOISE * np.random.default_rng(SEED).normal(size=ROWS)


def grey_box(u: Array, y: Array, test: Records) -> tuple[float, float]:
    """Fit ``bouc_wen_oscillator`` to the force u and the displacement y; return its RMS errors (m) on both tests."""
    rows = len(u) * UPSAMPLING
    force, displacement = (np.tile(finer(v, UPSAMPLING), 2) for v in (u, y))
    step, steady = 1 / (RATE * UPSAMPLING), slice(rows, 2 * rows)
    data = Dataset.from_signal(force, displacement, step, "Bouc-Wen benchmark", steady)
    return tested(fit(data, "bouc_wen_oscillator", stride=UPSAMPLING).predict, UPSAMPLING, test)


def tested(response: Callable[[Array], Array], k: int, test: Records) -> tuple[float, float]:
    """Return the RMS errors (m) of a model on both tests.

    `response` maps a force to a displacement at 15 kHz. The force has k samples for each sample of a record.
    """
    n = len(test.multisine[0])
    # with one additional period, the end of the record, where the filters extrapolate, is not in the result
    y1 = sampled(response(np.tile(finer(test.multisine[0], k), 3)), DECIMATE_MULTISINE)[n : 2 * n]
    y2 = sampled(response(synthetic.sweep(len(test.sweep[0]) / RATE)[:: UPSAMPLING // k]), DECIMATE_SWEEP)
    return rms(y1 - test.multisine[1]), rms(y2 - test.sweep[1])


def duhem(u: Array, y: Array, test: Records, progress: Callable[[float], None]) -> tuple[float, float]:
    """Fit ``duhem_oscillator`` to the force u and the displacement y, and return its RMS errors (m) on both tests."""
    k = UPSAMPLING // COARSER
    way_in = len(u) * k // 8  # lead-in of 1.4 s, because the oscillator decays within 0.4 s
    force, displacement = (np.concatenate([v[-way_in:], v]) for v in (finer(u, k), finer(y, k)))
    data = Dataset.from_signal(force, displacement, 1 / (RATE * k), "Bouc-Wen benchmark", slice(way_in, len(force)))
    model = fit(data, "duhem_oscillator", progress=progress, stride=k)

    def full_rate(u: Array) -> Array:  # the filters of the benchmark work at 15 kHz
        y = model.predict(u)
        return np.interp(np.arange(len(y) * COARSER) / COARSER, np.arange(len(y)), y)

    return tested(full_rate, k, test)


def black_box(u: Array, y: Array, test: Records, progress: Callable[[float], None]) -> tuple[float, float]:
    """Fit a NARX network to the force u and the displacement y, and return its RMS errors (m) on both tests."""
    data = Dataset.from_signal(u, y, 1 / RATE, "Bouc-Wen benchmark")
    model = fit(data, "narx_network", progress=progress, y0=0.0)  # the tests start from rest
    n = len(test.multisine[0])
    y1 = model.predict(np.tile(test.multisine[0], 2))[n:]
    return rms(y1 - test.multisine[1]), rms(model.predict(test.sweep[0]) - test.sweep[1])


def check(data: Path | None) -> None:
    """Raise an InputError if the folder `data` contains no valid test file. Without a folder, do nothing."""
    if data is not None:
        records(data)


def table(data: Path | None, progress: Callable[[float], None]) -> Report:
    """Return a table of our test errors and the published ones (RMS, m).

    Parameters
    ----------
    data : path, optional
        Folder with ``boucwen_benchmark/test.h5``, or the folder of this file. By default, generated records are used.
    progress : function
        Function that is called with the completed fraction of the work, 0 to 1.
    """
    test = records(data)
    n = len(test.multisine[0])
    rows = []
    if test.official:
        force = synthetic.sweep(len(test.sweep[0]) / RATE)
        for name, made, given in (
            ("multisine", benchmark_multisine(test.multisine[0]), test.multisine[1]),
            ("sine sweep", synthetic.benchmark_sweep(force), test.sweep[1]),
        ):
            rows.append(Row(f"generator against the official {name}", ours=rms(made - given), target=1e-14))
    rows += [Row(f"{name}, multisine", reported=value, group="reported") for name, value in PUBLISHED]
    u, y = training()
    results = [("grey box", 5e-7, grey_box(u, y, test), "six parameters; Newmark at 15 kHz, as the data")]
    progress(0.1)
    part = duhem(u, y, test, lambda f: progress(0.1 + 0.1 * f))
    results.append(("structured Duhem", 1e-6, part, "f of free shape, other integrator, 7.5 kHz"))
    part = black_box(u, y, test, lambda f: progress(0.2 + 0.7 * f))
    results.append(("black box (NARX network, 10 lags, trained in simulation)", 7.5e-6, part, "15 neurons, at 750 Hz"))
    for name, target, errors, note in results:
        for signal, e in zip(("multisine", "sine sweep"), errors, strict=True):
            rows.append(Row(f"{name}, {signal}", ours=e, target=target, note=note))
    rows += _static_rows()
    source = "official test records" if test.official else "records of our own generator (no --data)"
    return report(ROW, tuple(rows), records=source, multisine=rms(test.multisine[1]), sweep=rms(test.sweep[1]), n=n)


A, BETA, GAMMA, N = 1.3, 1.1, 0.6, 1.4
OFFSET, LINEAR, WEIGHT = 0.2, 0.35, 0.9
REVERSALS = 60


def response(u: Array) -> Array:
    """Return the output (n,) of a static Bouc-Wen operator for an input u (n,), from z = 0.

    The operator, which is not a sum of plays, is y = c + a u + b z with dz/du = A - (beta sgn(du z) + gamma) |z|^n (Wen
    1976). It is integrated along every ramp of the input by scipy's RK45. The core uses another integration method.
    """
    from scipy.integrate import solve_ivp

    turns = [0, *(np.flatnonzero(np.diff(np.sign(np.diff(u))) != 0) + 1).tolist(), len(u) - 1]
    z = np.zeros(len(u))
    for i, j in pairwise(turns):
        s = np.sign(u[j] - u[i])

        def slope(x: float, z: Array, s: float = s) -> Array:
            return np.asarray(s * (A - (BETA * np.sign(s * z) + GAMMA) * np.abs(z) ** N))

        path = np.abs(u[i : j + 1] - u[i])
        z[i : j + 1] = solve_ivp(slope, (0, path[-1]), [z[i]], t_eval=path, rtol=1e-9, atol=1e-11).y[0]
    return OFFSET + LINEAR * u + WEIGHT * z


def _static_rows() -> list[Row]:
    """Return a table row with the largest held-out RMS errors of a sum of plays and of the kind that `auto` chooses."""
    u = signals.training(REVERSALS, 1)
    data = Dataset.from_signal(u, response(u))
    plays, chosen = fit(data, "prandtl_ishlinskii"), fit(data, "auto")
    of = [
        max(e["rms_percent"] for e in accuracy.held_out_table(m, response, data.span).values()) for m in (plays, chosen)
    ]
    note = f"literal: plays of any number; ours: --model auto chose {chosen.key}, memory {chosen.fit['memory']}"
    return [Row("static Bouc-Wen operator, worst held-out RMS, % of span", None, of[0], of[1], 0.03, note=note)]
