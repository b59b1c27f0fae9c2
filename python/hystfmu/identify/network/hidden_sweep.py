"""Sweep over the number of hidden neurons: trains a network of each size, scores it on a validation split."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from threadpoolctl import threadpool_limits

from hystfmu.base.arrays import Array, Progress, silent
from hystfmu.identify.catalogue import Options
from hystfmu.identify.network.readout import centre_and_gain
from hystfmu.identify.network.training import decay_for, train
from hystfmu.identify.solvers.trainers import TRAINERS

WORKERS = 2


def hidden_sweep(
    x: Array,
    y: Array,
    fitted: slice,
    validation: slice,
    counts: Sequence[int],
    chosen: Options,
    seed: int = 0,
    progress: Progress = silent,
) -> dict[int, float]:
    """Compute the mean square validation error for every number of hidden neurons (Shen & Ma 2017, table 2).

    Networks from x (n, n_in) to y (n,) are trained on the rows `fitted`. Activation, starts, trainer, iterations and
    decay are options of a network readout. Each size has its own random starts, so the order of the work does not
    matter. Threads share the sizes, the largest first; BLAS has one thread in each, because threads of small
    factorisations wait for each other longer than they compute. The progress weights each size by the cost of its
    iterations. Errors are in the square of the unit of measure of y, in the order of `counts`.
    """
    middle, gain = centre_and_gain(x[fitted])
    (y_middle,), (y_gain,) = centre_and_gain(y[fitted][:, None])
    scaled, target = (x - middle) * gain, (y - y_middle) * y_gain
    decay = decay_for(target[fitted]) if chosen["decay"] is None else chosen["decay"]
    options = {k: chosen[k] for k in ("activation", "starts", "iterations")} | {"decay": decay, "seed": seed}
    found: dict[int, float] = {}
    cost = {n: 10 + n**2 for n in counts}

    def score(n: int) -> None:
        network, _ = train(scaled[fitted], target[fitted], n, trainer=TRAINERS[chosen["trainer"]], **options)
        found[n] = float(np.mean((network(scaled[validation]) - target[validation]) ** 2)) / float(y_gain) ** 2
        progress(sum(cost[i] for i in tuple(found)) / sum(cost.values()))

    with threadpool_limits(1), ThreadPoolExecutor(WORKERS) as pool:
        list(pool.map(score, sorted(cost, reverse=True)))
    return {n: found[n] for n in counts}
