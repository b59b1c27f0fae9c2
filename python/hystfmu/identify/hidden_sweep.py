"""How many hidden neurons?  Train a network of every size on some rows, judge it on others, in two processes.

Each process is this module run as a program with one BLAS thread: small factorisations in two threads of one process
wait for each other, a hundred times longer than they compute.  As a program of its own, it needs nothing of the
caller's script.  A few small networks are trained at once, here.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from hystfmu.core import Array
from hystfmu.identify.network import decay_for, train
from hystfmu.identify.readout import centre_and_gain
from hystfmu.identify.trainers import TRAINERS

WORKERS = 2
FEW = 60  # cost of sizes that are trained sooner than a process has started
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


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

    Raises
    ------
    RuntimeError
        A process ended early; the text is its last message.
    """
    middle, gain = centre_and_gain(x[fitted])
    (y_middle,), (y_gain,) = centre_and_gain(y[fitted][:, None])
    scaled, target = (x - middle) * gain, (y - y_middle) * y_gain
    decay = decay_for(target[fitted]) if chosen["decay"] is None else chosen["decay"]
    task = {
        "fitted": (scaled[fitted], target[fitted]),
        "judged": (scaled[judged], target[judged]),
        "settings": (chosen["activation"], chosen["starts"], chosen["iterations"], decay, seed),
        "trainer": chosen["trainer"],
    }
    found: dict[int, float] = {}
    cost = {n: 10 + n**2 for n in counts}

    def note(n: int, error: float) -> None:
        found[n] = error / float(y_gain) ** 2
        progress(sum(cost[i] for i in tuple(found)) / sum(cost.values()))

    def follow(share: Sequence[int]) -> None:
        with _start() as process:
            assert process.stdin is not None
            assert process.stdout is not None
            assert process.stderr is not None
            pickle.dump({**task, "counts": share}, process.stdin)
            process.stdin.close()
            for line in process.stdout:
                n, error = line.split()
                note(int(n), float(error))
            message = process.stderr.read().decode(errors="replace").strip()
        if process.returncode:
            raise RuntimeError(f"training networks of {list(share)} neurons: {message.splitlines()[-1:]}")

    if sum(cost.values()) <= FEW:
        for n in cost:
            note(n, _judge(task, n))
        return found
    longest_first = sorted(set(counts), reverse=True)
    shares = [share for k in range(WORKERS) if (share := longest_first[k::WORKERS])]
    with ThreadPoolExecutor(WORKERS) as pool:
        list(pool.map(follow, shares))
    return {n: found[n] for n in counts}


def _start() -> subprocess.Popen[bytes]:
    root = str(Path(__file__).parents[2])
    paths = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    return subprocess.Popen(
        [sys.executable, "-m", "hystfmu.identify.hidden_sweep"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, **ONE_THREAD, "PYTHONPATH": paths},
    )


def _judge(task: Mapping[str, Any], hidden: int) -> float:
    """Train one network; its mean square error on the judged rows, in scaled units."""
    x, y = task["judged"]
    network, _ = train(*task["fitted"], hidden, *task["settings"], trainer=TRAINERS[task["trainer"]])
    return float(np.mean((network(x) - y) ** 2))


def _work(source: BinaryIO) -> None:
    """The process: one line "neurons error" for every size."""
    task = pickle.load(source)
    for n in task["counts"]:
        print(n, repr(_judge(task, n)), flush=True)


if __name__ == "__main__":
    _work(sys.stdin.buffer)
