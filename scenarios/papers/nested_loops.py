"""Errors of models and inverses on nested loops, which the single decaying sine of the papers does not excite.

The two plants are simulated in numpy: ten backlash operators with a linear term, without and with a static nonlinearity
at the output. Models are trained on random nested reversals and tested on held-out signals. Inverses are tested in
series with the plant.
"""

from collections.abc import Callable

import numpy as np

from hystfmu.base import Array
from hystfmu.data import Dataset, signals
from hystfmu.identify import errors, fit
from hystfmu.inverse import inverse
from hystfmu.model import Model, accuracy
from papers.table import Row, Stated

ROW = Stated(__name__)

STEP = 1e-3
NOISE = 1e-3  # RMS noise over the span in the data for the inverse
SHARE = 0.9  # range of the wanted outputs of an inverse over the range of the plant

Response = Callable[[Array], Array]


def bent(plant: Response) -> Response:
    """Return a plant whose output is an asymmetric polynomial of the output of `plant`.

    The polynomial increases over [-1, 1].
    """

    def response(u: Array) -> Array:
        y = plant(u)
        return np.asarray(y + 0.15 * y**2 - 0.1 * y**3)

    return response


def recorded(plant: Response, reversals: int, noise: float = 0.0) -> Dataset:
    """Return the data set of a plant for an input with `reversals` random nested reversals.

    White noise is added to the output. `noise` is its standard deviation relative to the span of the output.
    """
    u = signals.training(reversals, 1)
    y = plant(u)
    y = y + noise * np.ptp(y) * np.random.default_rng(0).normal(size=len(y))
    return Dataset.from_signal(u, y, STEP, "random nested reversals")


def bank_rows(name: str, plant: Response, data: Dataset) -> list[Row]:
    """Fit the kind `play_bank_mlp` to `data`, and return table rows with its errors on held-out signals.

    `plant` computes the true outputs. `name` describes the plant. The limits for nested reversals differ from those for
    the other signals.
    """
    found = accuracy.held_out_table(fit(data, "play_bank_mlp"), plant, data.span)
    nested = found.pop("nested reversals")
    rows = []
    for where, e, limits in (
        ("nested reversals", nested, (0.1, 0.5)),
        ("worst of the other signals", _worst(found), (0.2, 0.8)),
    ):
        rows += [
            ROW("bank", ours=e[f"{k.lower()}_percent"], target=limit, name=name, where=where, k=k)
            for k, limit in zip(("RMS", "max"), limits, strict=True)
        ]
    return rows


def inverse_rows(plant: Response, reversals: int) -> list[Row]:
    """Return table rows with the errors of the exact inverse of a fitted sum of plays.

    The inverse is tested in series with its model and with the plant. The training input has `reversals` nested
    reversals.
    """
    clean, noisy = (
        fit(recorded(plant, reversals, noise), "prandtl_ishlinskii", N=200, w0_min=0.01) for noise in (0, NOISE)
    )
    return [
        ROW("exact", ours=inverse(clean).fit["cascade_max_percent"] / 100),
        ROW("noisy", ours=cascade(inverse(noisy), plant)["max_percent"], percent=100 * NOISE),
    ]


def implicit_rows(name: str, plant: Response, reversals: int) -> list[Row]:
    """Return a table row with the error of the implicit inverse of the kind `play_bank_mlp`, in series with the plant.

    `name` describes the plant. The training input has `reversals` nested reversals.
    """
    data = recorded(plant, reversals)
    few, made = (inverse(fit(data, "play_bank_mlp", N=n), "implicit") for n in (16, 32))
    worst = [cascade(m, plant)["max_percent"] for m in (few, made)]
    return [ROW("implicit", ours=worst[1], name=name, few=worst[0])]


def cascade(made: Model, plant: Response) -> dict[str, float]:
    """Return the largest errors of the inverse `made` in series with the plant, over all held-out signals.

    The keys are the names of the error measures. Each error is relative to the span of its signal.
    """
    found = {}
    for name, u in signals.held_out().items():
        wanted = plant(SHARE * u)
        found[name] = errors(plant(made.predict(wanted, STEP)), wanted, float(np.ptp(wanted)))
    return _worst(found)


def _worst(found: dict[str, dict[str, float]]) -> dict[str, float]:
    return {k: max(e[k] for e in found.values()) for k in next(iter(found.values()))}
