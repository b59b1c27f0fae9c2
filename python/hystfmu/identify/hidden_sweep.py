"""How many hidden neurons?  Train a network of every size on some rows, judge it on others, two at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import Any

import numpy as np

from hystfmu.core import Array
from hystfmu.identify.network import decay_for, train
from hystfmu.identify.readout import centre_and_gain
from hystfmu.identify.trainers import TRAINERS

WORKERS = 2


def hidden_sweep(
    x: Array,
    y: Array,
    fitted: slice,
    judged: slice,
    counts: Sequence[int],
    chosen: Mapping[str, Any],
    seed: int = 0,
    progress: Callable[[float], None] = lambda fraction: None,
) -> dict[int, float]:
    """Mean square error on the judged rows for every number of hidden neurons (Shen & Ma 2017, table 2).

    Parameters
    ----------
    x : array, shape (n, n_in)
        Inputs of the network.
    y : array, shape (n,)
        Wanted output.
    fitted, judged : slice
        Rows to train on, and rows to judge by.
    counts : sequence of int
        Numbers of hidden neurons.
    chosen : mapping
        activation, starts, trainer, iterations and decay, as in the options of a network readout.
    seed : int
        Of the random starts; each size has its own starts, so that the order of the work does not matter.
    progress : function
        Called with the fraction done; a size counts by the cost of its iterations.

    Returns
    -------
    dict
        Number of neurons to mean square error, in the unit of y squared, in the order of `counts`.
    """
    middle, gain = centre_and_gain(x[fitted])
    (y_middle,), (y_gain,) = centre_and_gain(y[fitted][:, None])
    scaled, target = (x - middle) * gain, (y - y_middle) * y_gain
    decay = decay_for(target[fitted]) if chosen["decay"] is None else chosen["decay"]

    def judge(hidden: int) -> float:
        network, _ = train(
            scaled[fitted],
            target[fitted],
            hidden,
            chosen["activation"],
            chosen["starts"],
            chosen["iterations"],
            decay,
            seed,
            trainer=TRAINERS[chosen["trainer"]],
        )
        return float(np.mean((network(scaled[judged]) - target[judged]) ** 2)) / float(y_gain) ** 2

    found: dict[int, float] = {}
    cost = {n: 10 + n**2 for n in counts}
    done, total = 0, sum(cost.values())
    with ThreadPoolExecutor(WORKERS) as pool:
        jobs = {pool.submit(judge, n): n for n in sorted(counts, reverse=True)}  # the longest first
        for job in as_completed(jobs):
            found[jobs[job]] = job.result()
            done += cost[jobs[job]]
            progress(done / total)
    return {n: found[n] for n in counts}
