"""S21: derivatives of a run by all parameters and start states of 40 plays, beside differences, numpy and torch.

All run in the same process.  Times are minima over repeats, of one core.  The derivatives of numpy are written from the
definition of the play; torch gives the gradient of one number only, where the others give that of every row.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import time
from importlib.util import find_spec

import numpy as np

from hystfmu.core.executor import SEED, Executor
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.report.terminal import table

ROWS, PLAYS, TARGET = 10_000, 40, 3.0  # ms


def milliseconds(f, repeats):
    least, found = np.inf, None
    for _ in range(repeats):
        begin = time.thread_time()
        found = f()
        least = min(least, time.thread_time() - begin)
    return 1e3 * least, found


def forward(u, w0, r, w, z0):
    """Return the derivatives by w0, r, w and z0, shape (rows, 1 + 3 n), of one array operation a row for each."""
    z, by_r, by_z0 = z0.copy(), np.zeros_like(r), np.ones_like(z0)
    found = np.empty((len(u), 1 + 3 * len(r)))
    for k, x in enumerate(u):
        side = np.where(z <= x - r, -1.0, np.where(z >= x + r, 1.0, 0.0))
        moves = side != 0
        z = np.where(moves, x + side * r, z)
        by_r, by_z0 = np.where(moves, side, by_r), np.where(moves, 0.0, by_z0)
        found[k] = np.concatenate([[x], w * by_r, z, w * by_z0])
    return found


def autograd(u, w0, r, w, z0):
    """Return the gradient of the mean square of the output by the four, by torch through a loop over the rows."""
    import torch

    torch.set_num_threads(1)
    x, *free = (torch.tensor(v, dtype=torch.float64) for v in (u, w0, r, w, z0))
    free = [v.requires_grad_() for v in free]
    z, outputs = free[3], []
    for t in range(len(u)):
        z = torch.minimum(torch.maximum(z, x[t] - free[1]), x[t] + free[1])
        outputs.append(free[0] * x[t] + (free[2] * z).sum())
    (torch.stack(outputs) ** 2).mean().backward()
    return np.concatenate([np.atleast_1d(v.grad.numpy()) for v in free])


def main():
    rng = np.random.default_rng(0)
    u = np.cumsum(rng.normal(size=ROWS)) * 0.05
    values = {
        "w0": 0.7,
        "r": np.linspace(0.01, 1.0, PLAYS),
        "w": np.linspace(0.5, 1.5, PLAYS) / PLAYS,
        "z0": rng.uniform(-0.5, 0.5, PLAYS),
    }
    node = Node("plays", "backlash_sum", {}, values)
    graph = Graph([node], [], [Input("u", ("plays.u",))], [Output("y", "plays.y")])
    executor = Executor(graph.to_bytes())
    size = {p.var.name: (p.reference, p.size) for p in graph.ports if p.is_parameter}
    places = [k for name in values for k in range(size[name][0], sum(size[name]))]
    seeds = np.array([(k, column, 1.0) for column, k in enumerate(places)], dtype=SEED)
    rows = u[:, None]

    def differences():
        y, found = executor.run(rows, 1, 1.0), []
        for k in places:
            value = executor.get(k)
            executor.set(k, value + 1e-6)
            found.append((executor.run(rows, 1, 1.0) - y)[:, 0] / 1e-6)
            executor.set(k, value)
        return np.column_stack(found)

    core, (y, dy) = milliseconds(lambda: executor.sensitivities(rows, 1, 1.0, seeds), 40)
    run, _ = milliseconds(lambda: executor.run(rows, 1, 1.0), 40)
    dy = dy[:, 0]
    lines = [["core, one pass", f"{core:.2f}", "1", ""]]
    rivals = [
        ("differences of runs in the core", differences, 2),
        ("numpy, rows in Python", lambda: forward(u, **values), 2),
    ]
    for name, f, repeats in rivals:
        time_of, found = milliseconds(f, repeats)
        lines.append([name, f"{time_of:.0f}", f"{time_of / core:.0f}", f"{np.abs(found - dy).max():.0e}"])
    if find_spec("torch"):
        time_of, found = milliseconds(lambda: autograd(u, **values), 1)
        ours = 2 / ROWS * dy.T @ y[:, 0]
        error = np.abs(found - ours).max() / np.abs(ours).max()
        lines.append(
            [
                "torch, autograd through the rows, one gradient",
                f"{time_of:.0f}",
                f"{time_of / core:.0f}",
                f"{error:.0e}",
            ]
        )
    print(table([f"{len(places)} derivatives of {ROWS} rows", "ms", "times the core", "difference"], lines))
    verdict = "met" if core <= TARGET else "MISSED"
    print(
        f"S21 all of them beside the run: {core:.2f} ms (target {TARGET:g} ms, {verdict}); the run alone {run:.2f} ms"
    )


if __name__ == "__main__":
    main()
