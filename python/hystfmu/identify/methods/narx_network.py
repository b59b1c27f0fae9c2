"""NARX network, a black-box model for any dynamics: a network whose inputs are previous inputs and outputs.

  y(k) = a'x(k) + W2 tanh(W1 x(k) + b1) + b2,   x(k) = (u(k), .., u(k-L), y(k-1), .., y(k-L))

The first stage of the training predicts one step ahead from measured outputs. Noise of the measured outputs biases its
result. The second stage minimises the output error of a simulation, in which y(k-1), ... are outputs of the model. The
derivatives s(k) of the simulated output satisfy s(k) = dy/dp + sum_j dy/dy(k-j) s(k-j) (real-time recurrent learning,
Williams & Zipser 1989). These derivatives form the Jacobian of the Levenberg-Marquardt method.
"""

from functools import partial

import numpy as np

from hystfmu.base import Array, InputError, Progress
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node, Value
from hystfmu.identify.catalogue import LAGS, Candidate, Memory, Option, Options, Row, device, wired
from hystfmu.identify.network.training import train
from hystfmu.identify.solvers.trainers import levenberg_marquardt

TEXT = "network of lagged inputs and outputs, trained in simulation"
RIDGE = 1e-5  # ridge on the parameters, relative to the scaled output
LIMIT = 10.0  # limit of the scaled output in a simulation
STARTS = 3  # maximum number of random start weights
CLOSE = 0.1  # error relative to the output below which no further start is tried
SKIPPED = 20  # the first SKIPPED * lags rows of a simulation are not used, because it starts from measured outputs

SMALL = {"lags": 4, "hidden": 6, "one_step": 30, "iterations": 15}  # the full size takes minutes
CANDIDATES = (Candidate(LAGS, 1.0, 1.5, SMALL, {**SMALL, "one_step": 15, "iterations": 4}),)
OPTIONS = (
    Option("lags", 10, 1, 1000, text="number of previous inputs and outputs"),
    Option("hidden", 15, 1, 10000, text="hidden neurons"),
    Option("one_step", 40, 1, 100000, text="number of iterations of the one-step-ahead training"),
    Option("iterations", 40, 1, 100000, text="number of iterations of the training in simulation"),
    Option("y0", None, -1e300, 1e300, text="output before the first row; default: the output of the first row"),
)


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit ``scaling -> narx_network -> scaling``; return graph and number of weights.

    An InputError is raised if the record has too few rows for the lags, or if the model is unstable in simulation.
    """
    lags, hidden = options["lags"], options["hidden"]
    u, y = data.u[data.train], np.full(data.train.stop, np.nan)
    y[data.counted] = data.y[data.counted]
    y = y[data.train]
    least = (SKIPPED + 2) * lags
    if len(u) < least:
        raise InputError(f"The training rows must be at least {least} for {lags} lags. Got {len(u)} instead.")
    gain_u, gain_y = 1 / float(np.abs(u).max()), 1 / float(np.nanmax(np.abs(y)))
    iterations = options["one_step"], options["iterations"]
    tries = []

    def part(k: int, done: float) -> None:
        progress((k + done) / STARTS)

    for k in range(STARTS):  # the simulation error has poor local minima, such as a second rest position
        tries.append(trained(u * gain_u, y * gain_y, lags, hidden, iterations, seed + k, partial(part, k)))
        if tries[-1][1] < CLOSE:
            break
    p, _ = min(tries, key=lambda found: found[1])
    y0 = float(data.y[0]) if options["y0"] is None else options["y0"]
    graph = assemble(p, lags, hidden, (gain_u, gain_y), y0, data)
    if not np.abs(graph.run(data.u, data.h)).max() * gain_y < LIMIT:
        raise InputError(
            f"The model with {lags} lags must be stable in a free run. Got an unstable one: use fewer lags or neurons."
        )
    return graph, len(p)


def trained(
    u: Array, y: Array, lags: int, hidden: int, iterations: tuple[int, int], seed: int, progress: Progress
) -> tuple[Array, float]:
    """Train a network on the input u (n,) and the output y (n,), both scaled to [-1, 1].

    Held-out outputs are NaN. `iterations` contains the number of Levenberg-Marquardt iterations of the two stages. The
    result is the vector of parameters (a, W1 row by row, b1, W2, b2), with the oldest lag first, and the RMS error of
    the simulation, relative to the RMS output.
    """
    n = len(u) - lags
    skip = SKIPPED * lags
    x = np.column_stack([u[j : j + n] for j in range(lags + 1)] + [y[j : j + n] for j in range(lags)])
    target = y[lags:]
    known = np.isfinite(x).all(axis=1) & np.isfinite(target)
    x, after = x[known], target[known]
    a = np.linalg.lstsq(x, after, rcond=None)[0]
    rest = after - x @ a
    most = float(np.abs(rest).max())
    gain = 1 / most if most > 0 else 1.0
    net, _ = train(
        x, rest * gain, hidden, "tanh", 1, iterations[0], 1e-7, seed, None, lambda f: progress(0.3 * f), len(x)
    )
    p = np.concatenate([a, net.W1.ravel(), net.b1, net.W2 / gain, [net.b2 / gain]])
    size = float(np.sqrt(np.nansum(y**2)))
    counts = np.flatnonzero(np.isfinite(target) & (np.arange(n) >= skip))

    def function(p: Array) -> tuple[Array, Array]:
        free, s = simulate(p, u[lags:], y[:lags], lags, hidden, derivatives=True)
        e = np.concatenate([(free - target)[counts] / size, RIDGE * p])
        return e, np.vstack([s[counts] / size, RIDGE * np.eye(len(p))])

    p = levenberg_marquardt(p, function, iterations[1], progress=lambda f: progress(0.3 + 0.7 * f))[0]
    free, _ = simulate(p, u[lags:], y[:lags], lags, hidden, derivatives=False)
    return p, float(np.sqrt(np.sum((free - target)[counts] ** 2)) / size)


def assemble(p: Array, lags: int, hidden: int, gains: tuple[float, float], y0: float, data: Dataset) -> Graph:
    """Return the graph with the parameters p (oldest lag first); the parameters of the block begin with the newest lag.

    `gains` contains the scaling gains of input and output.
    """
    gain_u, gain_y = gains
    a, W1, b1, W2, b2 = _split(p, lags, hidden)
    newest = np.r_[lags:-1:-1, 2 * lags : lags : -1]
    values: dict[str, Value] = {"a": a[newest], "W1": W1[:, newest].ravel(), "b1": b1, "W2": W2, "b2": b2}
    values["y0"] = y0 * gain_y
    nodes = [
        Node("input", "scaling", {"n": 1}, {"gain": gain_u}),
        Node("network", "narx_network", {"n_u": lags + 1, "n_y": lags, "n_hidden": hidden}, values),
        Node("readout", "scaling", {"n": 1}, {"gain": 1 / gain_y}),
    ]
    return device(data, nodes, wired(nodes))


def _split(p: Array, lags: int, hidden: int) -> tuple[Array, Array, Array, Array, float]:
    n = 2 * lags + 1
    at = np.cumsum([n, hidden * n, hidden, hidden])
    a, W1, b1, W2, b2 = np.split(p, at)
    return a, W1.reshape(hidden, n), b1, W2, float(b2[0])


def simulate(
    p: Array, u: Array, before: Array, lags: int, hidden: int, derivatives: bool = False
) -> tuple[Array, Array]:
    """Simulate the network; return the output (n,) and its derivatives (n, m) with respect to p.

    The derivatives are empty unless `derivatives` is True. u (n,) is the scaled input; before row 0 it has the value of
    row 0. `before` (lags,) contains the scaled outputs before row 0, the oldest first. If the output leaves [-10, 10],
    it stays at this limit.
    """
    a, W1, b1, W2, b2 = _split(p, lags, hidden)
    n = len(u)
    past_u = np.concatenate([np.full(lags, u[0]), u])
    y = np.concatenate([before, np.zeros(n)])
    s = np.zeros((n + lags if derivatives else 0, len(p)))
    direct = np.empty(len(p))
    width = 2 * lags + 1
    x = np.empty(width)
    for k in range(n):
        x[: lags + 1] = past_u[k : k + lags + 1]  # oldest first, which avoids a reversal in the loop
        x[lags + 1 :] = y[k : k + lags]
        t = np.tanh(W1 @ x + b1)
        value = float(a @ x + W2 @ t) + b2
        if not abs(value) < LIMIT:
            y[k + lags :] = np.copysign(LIMIT, value)
            break
        y[k + lags] = value
        if derivatives:
            g = W2 * (1 - t * t)
            direct[:width] = x
            direct[width : width * (hidden + 1)] = np.outer(g, x).ravel()
            direct[width * (hidden + 1) : -hidden - 1] = g
            direct[-hidden - 1 : -1] = t
            direct[-1] = 1
            s[k + lags] = direct + (a[lags + 1 :] + g @ W1[:, lags + 1 :]) @ s[k : k + lags]
    return y[lags:], s[lags:]


KINDS = {"narx_network": Row(TEXT, build, OPTIONS, CANDIDATES, Memory(2000.0))}
