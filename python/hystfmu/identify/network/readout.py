"""Network as the output stage (readout) of a model: limiting of its inputs, the network, and an output scaling.

The inputs of the network are called features; they are, for example, outputs of plays. Each feature is limited to its
range in the training rows. `hidden_sweep` compares networks of different sizes on a validation split.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from threadpoolctl import threadpool_limits

from hystfmu.base import Array, Progress, silent
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output, Value
from hystfmu.identify.catalogue import Option, Options, covariate_inputs
from hystfmu.identify.network.training import LEAST_DECAY, MOST_ROWS, decay_for, train
from hystfmu.identify.solvers.ridge import least_squares
from hystfmu.identify.solvers.trainers import TRAINERS

QUICK = {"starts": 1, "iterations": 30}  # options of a short trial fit of a network
WORKERS = 2  # number of threads of a sweep


def network_options(hidden: int, starts: int, iterations: int, least_decay: float = LEAST_DECAY) -> tuple[Option, ...]:
    """Return the options of a network; the arguments are their default values and the smallest weight decay."""
    decay = f"weight decay; default: a tenth of the noise variance of y, at least {least_decay:g}"
    return (
        Option("hidden", hidden, 1, 10000, text="hidden neurons"),
        Option("activation", "sigmoid", choices=("sigmoid", "tanh"), text="activation of the hidden neurons"),
        Option("starts", starts, 1, 1000, text="number of random start values; training continues from the best one"),
        Option("trainer", "levenberg_marquardt", choices=tuple(TRAINERS), text="optimiser"),
        Option("iterations", iterations, 1, 100000, text="number of iterations from the best start value"),
        Option("decay", None, 0.0, 1e3, text=decay),
        Option(
            "margin", 0.05, 0.0, 1e300, text="features are limited to the training range, extended by this fraction"
        ),
    )


class Features:
    """Blocks that compute the features of a network from the input, and the features of a data set.

    The input is connected to the endpoints `to`. `outputs` contains the endpoints of the features, in the order of the
    network inputs. The covariates of the data are the last features. ``values`` contains the features of all rows.
    """

    def __init__(
        self,
        nodes: Sequence[Node],
        wires: Sequence[tuple[str, str]],
        to: Sequence[str],
        outputs: Sequence[str],
        data: Dataset,
    ) -> None:
        self.nodes, self.wires, self.to, self.outputs = nodes, wires, tuple(to), outputs
        self._data = data
        ends = [Output(f"f{i}", source) for i, source in enumerate(outputs)]
        sizes = {n.name: n.sizes for n in nodes}
        self._scalars: list[str] = []
        for source in outputs:
            name, variable = source.split(".")
            n = sizes[name][variable]
            self._scalars += [source] if n == 1 else [f"{source}[{i + 1}]" for i in range(n)]
        front = Graph(nodes, wires, [Input("u", self.to)], ends)
        own = data.along(lambda u: front.run(u, data.h).reshape(len(u), -1))
        self.values = np.hstack([own, data.covariates.values]) if data.covariates else own

    def into(self, end: str) -> list[tuple[str, str]]:
        """Return the wires from all features except covariates to the first elements of the array input `end`."""
        return [(source, f"{end}[{i + 1}]") for i, source in enumerate(self._scalars)]

    def inputs(self, ends: Sequence[str]) -> list[Input]:
        """Return the inputs of the model; covariates are connected to the last elements of the array inputs `ends`."""
        data, n = self._data, len(self._scalars)
        driven = [tuple(f"{end}[{n + j + 1}]" for end in ends) for j in range(len(data.covariates.names))]
        return [Input("u", self.to, data.unit_u, float(data.u[0])), *covariate_inputs(data, driven)]


def centre_and_gain(v: Array) -> tuple[Array, Array]:
    """Return the middle and the gain 2/range that scale each column of v (n, m) to [-1, 1].

    The gain of a constant column is 0.
    """
    lo, hi = v.min(axis=0), v.max(axis=0)
    width = hi - lo
    return (lo + hi) / 2, np.divide(2.0, width, out=np.zeros_like(width), where=width > 0)


def fit_readout(
    features: Features,
    data: Dataset,
    chosen: Options,
    seed: int,
    progress: Progress,
    linear: bool = False,
    most_rows: int = MOST_ROWS,
    least_decay: float = LEAST_DECAY,
) -> tuple[Graph, int, float]:
    """Train a network on the training rows; return the graph, the number of weights, and the RMS training error.

    The error is in the unit of measure of y. The graph is features -> scaling ``features`` -> mlp ``network`` ->
    scaling ``readout``. Its inputs are `u` and the covariates, and its output is `y`. With `linear`, a linear readout
    of the features is fitted first by least squares, and the network is trained on the residual. The graph then also
    contains the sum blocks ``linear`` and ``total``. If there are more than `most_rows` rows, they are thinned evenly.
    If the option ``decay`` is not given, the weight decay is computed from the noise, and it is at least `least_decay`.
    """
    x, y = features.values[data.counted], data.y[data.counted]
    middle, gain = centre_and_gain(x)
    scaled = (x - middle) * gain
    # the ridge prevents large weights of nearly equal features
    a = least_squares(np.column_stack([scaled, np.ones(len(y))]), y, 1e-6)[0] if linear else np.zeros(0)
    rest = y - (scaled @ a[:-1] + a[-1]) if linear else y
    (rest_middle,), (rest_gain,) = centre_and_gain(rest[:, None])
    target = (rest - rest_middle) * rest_gain
    network, rms = train(
        scaled,
        target,
        chosen["hidden"],
        chosen["activation"],
        chosen["starts"],
        chosen["iterations"],
        decay_for(target, least_decay) if chosen["decay"] is None else chosen["decay"],
        seed,
        a[:-1] if linear else None,
        progress,
        most_rows,
        TRAINERS[chosen["trainer"]],
    )
    extra = chosen["margin"] * np.ptp(x, axis=0)
    n, hidden = len(gain), len(network.b1)
    limits = {"gain": gain, "offset": -middle * gain, "lo": x.min(axis=0) - extra, "hi": x.max(axis=0) + extra}
    weights: dict[str, Value] = {"W1": network.W1.ravel(), "b1": network.b1, "W2": network.W2, "b2": network.b2}
    weights["activation"] = network.activation
    scale = 1 / rest_gain if rest_gain > 0 else 0.0
    nodes = [
        *features.nodes,
        Node("features", "scaling", {"n": n}, limits),
        Node("network", "mlp", {"n_in": n, "n_hidden": hidden}, weights),
        Node("readout", "scaling", {"n": 1}, {"gain": scale, "offset": rest_middle}),
    ]
    wires = [*features.wires, ("features.y", "network.u"), ("network.y", "readout.u")]
    wires += features.into("features.u")
    if linear:
        k = a[:-1] * gain
        nodes += [
            Node("linear", "sum", {"n": n}, {"k": k, "offset": a[-1] - float(k @ middle)}),
            Node("total", "sum", {"n": 2}),
        ]
        wires += [*features.into("linear.u"), ("linear.y", "total.u[1]"), ("readout.y", "total.u[2]")]
    output = Output("y", "total.y" if linear else "readout.y", data.unit_y)
    inputs = features.inputs(("features.u", "linear.u") if linear else ("features.u",))
    graph = Graph(nodes, wires, inputs, [output])
    return graph, network.parameters + len(a), rms * scale


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
    """Return the mean square validation error for each number of hidden neurons (Shen & Ma 2017, table 2).

    Networks that map x (n, n_in) to y (n,) are trained on the rows `fitted` and tested on the rows `validation`.
    `chosen` contains the options of a network readout. The errors are in the square of the unit of measure of y, in the
    order of `counts`.

    Several threads train the networks, the largest network first. Each size has its own random start values, so the
    result does not depend on the order. BLAS uses one thread per network, because threads of small factorisations wait
    for each other longer than they compute. The progress is weighted with the estimated cost of each size.
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
