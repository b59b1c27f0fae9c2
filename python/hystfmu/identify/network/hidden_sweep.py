"""Sweep over the number of hidden neurons: trains a network of each size, scores it on a validation split.

Two processes share the sizes. Each process runs this module as a program with one BLAS thread. In one process with two
threads, small factorisations would wait for each other a hundred times longer than they compute. A separate program
does not import the script of the caller. If the networks are few and small, they are trained in the calling process.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import IO

import numpy as np

from hystfmu.base import PACKAGE
from hystfmu.base.arrays import Array, Progress, silent
from hystfmu.identify.catalogue import Options
from hystfmu.identify.network.readout import centre_and_gain
from hystfmu.identify.network.training import decay_for, train
from hystfmu.identify.solvers.trainers import TRAINERS

WORKERS = 2
FEW = 60  # total cost below which training is faster than starting a process
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


@dataclass(frozen=True)
class _Task:
    """Task of a process: rows (inputs, wanted) to fit, validation split, options of `train`, sizes."""

    fitted: tuple[Array, Array]
    validation: tuple[Array, Array]
    trainer: str
    options: Options
    counts: tuple[int, ...]

    def score(self, hidden: int) -> float:
        """Train one network; return its mean square error on the validation split, for the scaled output."""
        x, y = self.validation
        network, _ = train(*self.fitted, hidden, trainer=TRAINERS[self.trainer], **self.options)
        return float(np.mean((network(x) - y) ** 2))

    def write(self, counts: Sequence[int], to: IO[bytes]) -> None:
        """Write the task for some sizes as JSON, so that reading executes no code; a number keeps its bits."""
        arrays = [a.tolist() for a in (*self.fitted, *self.validation)]
        to.write(json.dumps([arrays, self.trainer, dict(self.options), list(counts)]).encode())

    @classmethod
    def read(cls, source: IO[bytes]) -> _Task:
        """Read a task that `write` wrote."""
        arrays, trainer, options, counts = json.loads(source.read())
        a, b, c, d = (np.array(values, dtype=np.float64) for values in arrays)
        return cls((a, b), (c, d), trainer, options, tuple(counts))


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
    matter. The progress weights each size by the cost of its iterations. Errors are in the square of the unit of
    measure of y, in the order of `counts`.

    A process that ends early raises RuntimeError with its last message.
    """
    middle, gain = centre_and_gain(x[fitted])
    (y_middle,), (y_gain,) = centre_and_gain(y[fitted][:, None])
    scaled, target = (x - middle) * gain, (y - y_middle) * y_gain
    decay = decay_for(target[fitted]) if chosen["decay"] is None else chosen["decay"]
    options = {k: chosen[k] for k in ("activation", "starts", "iterations")} | {"decay": decay, "seed": seed}
    task = _Task(
        (scaled[fitted], target[fitted]),
        (scaled[validation], target[validation]),
        chosen["trainer"],
        options,
        tuple(counts),
    )
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
            task.write(share, process.stdin)
            process.stdin.close()
            for line in process.stdout:
                n, error = line.split()
                note(int(n), float(error))
            message = process.stderr.read().decode(errors="replace").strip()
        if process.returncode:
            raise RuntimeError(f"training networks of {list(share)} neurons: {message.splitlines()[-1:]}")

    if sum(cost.values()) <= FEW:
        for n in cost:
            note(n, task.score(n))
        return found
    longest_first = sorted(set(counts), reverse=True)
    shares = [share for k in range(WORKERS) if (share := longest_first[k::WORKERS])]
    with ThreadPoolExecutor(WORKERS) as pool:
        list(pool.map(follow, shares))
    return {n: found[n] for n in counts}


def _start() -> subprocess.Popen[bytes]:
    root = str(PACKAGE.parent)
    paths = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    return subprocess.Popen(
        [sys.executable, "-m", "hystfmu.identify.network.hidden_sweep"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, **ONE_THREAD, "PYTHONPATH": paths},
    )


def _work(source: IO[bytes]) -> None:
    """Run as the process: print one line "neurons error" for every size."""
    task = _Task.read(source)
    for n in task.counts:
        print(n, repr(task.score(n)), flush=True)


if __name__ == "__main__":
    _work(sys.stdin.buffer)
