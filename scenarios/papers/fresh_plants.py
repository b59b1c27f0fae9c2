"""Errors of models and inverses on random plants that were not used to tune defaults.

The plants are generated from fixed and from random seeds. Every model is trained with the default options of its kind.
The training signal consists of random nested reversals, or is a multisine if the plant has dynamics. Each model is
tested on the same plant with other inputs. Each table row states its seeds. The targets must be met for every seed.
"""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.data import Dataset, signals
from hystfmu.identify import fit
from hystfmu.inverse import inverse
from hystfmu.model import Model, accuracy
from papers import drawn_plants
from papers.drawn_plants import Response
from papers.table import Report, Row, Stated, gathered, report

ROW = Stated(__name__)

FULL = {"drawn": 10}
FIXED = tuple(range(101, 107))
KINDS = ("actuator", "play_bank_mlp")
NESTED, OTHERS = (0.1, 0.5), (0.2, 0.8)  # limits of the RMS and of the largest error (% of span)
REVERSALS, STEP, NOISE = 150, 1e-3, 1e-3
FAST = 1e-4  # step of the record with dynamics (s)
HIGHEST = 300.0  # highest frequency of the multisine (Hz)


def table(data: object, progress: Callable[[float], None], drawn: int = 2) -> Report:
    """Return a table of the errors of models on random plants.

    Parameters
    ----------
    data : object
        Not used, because the plants are synthetic.
    progress : function
        Function that is called with the completed fraction of the work, 0 to 1.
    drawn : int
        Number of random seeds in addition to the fixed seeds.
    """
    first = int(np.random.SeedSequence().generate_state(1)[0])
    seeds = {f"seeds {FIXED[0]} to {FIXED[-1]}": FIXED, f"{drawn} drawn, first {first}": range(first, first + drawn)}
    parts: list[Callable[[], list[Row]]] = []
    for name, some in seeds.items():
        parts += [partial(_bent_rows, kind, name, some) for kind in KINDS]
        parts += [partial(_odd_rows, plant, name, some) for plant in ("stop_like", "butterfly")]
        parts += [partial(_actuator_rows, some[0]), partial(_inverse_rows, some[0])]
    return report(ROW, gathered(parts, progress))


def _recorded(plant: Response, seed: int, noise: float, h: float = STEP) -> Dataset:
    u = signals.training(REVERSALS, seed)
    y = plant(u)
    y = y + noise * np.ptp(y) * np.random.default_rng(seed).normal(size=len(y))
    return Dataset.from_signal(u, y, h)


def _bent_rows(kind: str, name: str, seeds: Sequence[int]) -> list[Row]:
    """Return a table row with the number of plants on which the errors of a kind of model are within the limits.

    Each seed gives two plants: a sum of plays without and with a static nonlinearity. `name` describes the seeds.
    """
    inside, worst = [], 0.0
    for seed in seeds:
        for draw in (drawn_plants.play_sum, drawn_plants.bent):
            plant = draw(np.random.default_rng(seed))
            data = _recorded(plant, seed, 0.0)
            found = accuracy.held_out_table(fit(data, kind, seed), plant, data.span, signals.held_out(5000 + seed))
            limits = {k: NESTED if k == "nested reversals" else OTHERS for k in found}
            inside.append(
                all(e["rms_percent"] <= limits[k][0] and e["max_percent"] <= limits[k][1] for k, e in found.items())
            )
            worst = max(worst, *(e["rms_percent"] for e in found.values()))
    n = len(inside)
    return [ROW("inside", ours=sum(inside), target=n, n=n, kind=kind, name=name, worst=worst)]


def _odd_rows(kind_of_plant: str, name: str, seeds: Sequence[int]) -> list[Row]:
    """Return a table row with the largest held-out RMS error of the kind `actuator` over the plants of all seeds.

    `kind_of_plant` is ``stop_like`` or ``butterfly``. The records have 0.1 % noise. `name` describes the seeds.
    """
    errors = []
    for seed in seeds:
        plant = getattr(drawn_plants, kind_of_plant)(np.random.default_rng(seed))
        data = _recorded(plant, seed, NOISE)
        found = accuracy.held_out_table(fit(data, "actuator", seed), plant, data.span, signals.held_out(5000 + seed))
        errors.append(max(e["rms_percent"] for e in found.values()))
    kind, median = kind_of_plant.replace("_", "-"), float(np.median(errors))
    return [ROW("odd", ours=max(errors), kind=kind, name=name, n=len(errors), median=median)]


def _actuator_rows(seed: int) -> list[Row]:
    """Fit the kind `actuator` to 3 s of a multisine, and return table rows with its errors.

    The rows contain the error on five other signals, the errors of natural frequency f_n and damping ratio zeta, and
    the error of the inverse.
    """
    model, plant, span = _whole(seed)
    found = {
        name: accuracy.errors(model.predict(u, FAST), plant(u), span)["rms_percent"]
        for name, u in _others(seed).items()
    }
    worst = max(found, key=lambda name: found[name])
    f_n, zeta = (float(model.fit.get(k, np.nan)) for k in ("f_n", "zeta"))
    about = f"bend, creep and G0(s) from one 3 s record, seed {seed}"
    return [
        Row(f"{about}: worst of five signals, % of span", ours=found[worst], target=0.1, note=worst),
        Row(f"{about}: f_n, error in %", ours=100 * abs(f_n / drawn_plants.F_N - 1), target=0.1),
        Row(f"{about}: zeta, error in %", ours=100 * abs(zeta / drawn_plants.ZETA - 1), target=2.0),
        _dynamic_row(model, about),
    ]


def _dynamic_row(model: Model, about: str) -> Row:
    """Return a table row with the error of the inverse with preview, in series with its model, up to a tenth of f_n."""
    what = f"{about}: inverse with preview before its model up to f_n / 10, max, % of span"
    try:
        found = inverse(model).fit
    except InputError as e:
        return Row(what, note=str(e))
    note = f"up to {found['band']:.3g} Hz, {found['lag_steps']} step late"
    return Row(what, ours=found["cascade_max_percent"], target=0.1, note=note)


def _inverse_rows(seed: int) -> list[Row]:
    """Return a table row with the error of the exact inverse in series with its model.

    The model has a static nonlinearity and creep.
    """
    plant = drawn_plants.creeping(np.random.default_rng(seed), STEP)
    model = fit(_recorded(plant, seed, NOISE), "actuator", seed, dynamics="no")
    what = f"exact inverse through creep and bend before its model, worst held-out max, of span, seed {seed}"
    try:
        found = inverse(model)
    except InputError as e:
        return [Row(what, note=str(e))]
    return [Row(what, ours=found.fit["cascade_max_percent"] / 100, target=1e-12, note=str(model.fit["parts"]))]


def _whole(seed: int) -> tuple[Model, Response, float]:
    plant = drawn_plants.actuator(np.random.default_rng(seed), FAST)
    u = _multisine(3.0, seed)
    y = plant(u)
    noisy = y + NOISE * np.ptp(y) * np.random.default_rng(seed).normal(size=len(y))
    return fit(Dataset.from_signal(u, noisy, FAST), "actuator", seed), plant, float(np.ptp(y))


def _others(seed: int) -> dict[str, Array]:
    """Return five test signals of 0.6 to 2 s by name. They are independent of the training multisine."""
    from scipy.signal import lfilter, sawtooth

    t = np.arange(6000) * FAST
    rise = np.minimum(1, t / 0.02)
    levels = np.random.default_rng(seed + 2).uniform(-0.8, 0.8, 8)
    return {
        "another multisine": _multisine(2.0, seed + 1),
        "10 Hz sine": 0.8 * np.sin(20 * np.pi * t) * rise,
        "100 Hz triangle": 0.7 * sawtooth(200 * np.pi * t + np.pi / 2, 0.5) * rise,
        "stairs": np.asarray(lfilter(np.ones(40) / 40, [1], np.repeat(np.append(0, levels), 2000))),
        "1 Hz sine": 0.9 * np.sin(2 * np.pi * np.arange(20_000) * FAST),
    }


def _multisine(seconds: float, seed: int) -> Array:
    """Return a random multisine in [-1, 1] that starts from 0.

    Every octave up to `HIGHEST` has the same power. `seconds` is the duration, and `seed` determines the phases.
    """
    n, rng = round(seconds / FAST), np.random.default_rng(seed)
    f = np.arange(n // 2 + 1) / seconds
    lines = (f > 0) & (f <= HIGHEST)
    spectrum = np.zeros(len(f), complex)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(int(lines.sum()))) / np.sqrt(f[lines])
    u = np.fft.irfft(spectrum, n)
    return np.asarray(u / np.abs(u).max() * np.minimum(1, np.arange(n) / 200))
