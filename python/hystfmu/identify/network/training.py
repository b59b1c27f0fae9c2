"""Network with one hidden layer and a linear output, which is trained from several random start values.

The residuals, the Jacobian and the gradient are computed without torch. The import of torch takes seconds, and training
steps with torch take twice the time.
"""

from dataclasses import dataclass

import numpy as np

from hystfmu.base import Array, Progress, silent
from hystfmu.identify.solvers.ridge import least_squares
from hystfmu.identify.solvers.trainers import TRAINERS, Squares, Trainer

LEAST_DECAY = 1e-9
MOST_ROWS = 3000  # more rows are thinned evenly, because neighbouring rows are nearly equal


@dataclass(frozen=True)
class Network:
    """Network with one output: y = W2 f(W1 x + b1) + b2, where f is the activation, sigmoid or tanh."""

    W1: Array
    b1: Array
    W2: Array
    b2: float
    activation: str = "sigmoid"

    @property
    def parameters(self) -> int:
        """Number of weights and biases."""
        return self.W1.size + self.b1.size + self.W2.size + 1

    def __call__(self, x: Array) -> Array:
        """Return the outputs (n,) for the inputs x (n, n_in)."""
        return np.asarray(_hidden(x @ self.W1.T + self.b1, self.activation)[0] @ self.W2 + self.b2)


def _hidden(a: Array, activation: str) -> tuple[Array, Array]:
    """Return the outputs of hidden neurons with the weighted sums a, and the derivatives of these outputs."""
    t = np.tanh(a if activation == "tanh" else 0.5 * a)
    return (t, 1 - t * t) if activation == "tanh" else (0.5 + 0.5 * t, 0.25 * (1 - t * t))


@dataclass(frozen=True)
class Fit:
    """Least-squares problem of a network that maps x (n, n_in) to y (n,).

    The vector p of all weights contains W1 row by row, then b1, W2 and b2.
    """

    x: Array
    y: Array
    hidden: int
    activation: str

    def network(self, p: Array) -> Network:
        """Return the network with the weights p."""
        h, n = self.hidden, self.hidden * self.x.shape[1]
        return Network(p[:n].reshape(h, -1), p[n : n + h], p[n + h : n + 2 * h], float(p[-1]), self.activation)

    def errors(self, p: Array) -> Array:
        """Return the residuals (n,): network output minus y."""
        return self.network(p)(self.x) - self.y

    def _layers(self, p: Array) -> tuple[Array, Array, Array]:
        """Return the residuals (n,), the outputs of the hidden neurons (n, hidden), and derivatives (n, hidden).

        The derivatives are those of the network output with respect to the weighted sums of the hidden neurons.
        """
        net = self.network(p)
        f, slope = _hidden(self.x @ net.W1.T + net.b1, self.activation)
        return f @ net.W2 + net.b2 - self.y, f, slope * net.W2

    def residuals(self, p: Array) -> tuple[Array, Array]:
        """Return the residuals (n,) and their Jacobian (n, len(p))."""
        r, f, d = self._layers(p)
        J = np.empty((len(r), len(p)))
        n = d.shape[1] * self.x.shape[1]
        np.multiply(d[:, :, None], self.x[:, None, :], out=J[:, :n].reshape(len(r), d.shape[1], -1))
        J[:, n : n + d.shape[1]], J[:, n + d.shape[1] : -1], J[:, -1] = d, f, 1.0
        return r, J

    def gradient(self, p: Array) -> tuple[float, Array]:
        """Return the sum of squares and its gradient (len(p),) by back-propagation."""
        r, f, d = self._layers(p)
        d = d * r[:, None]
        parts = [(d.T @ self.x).ravel(), d.sum(axis=0), f.T @ r, [r.sum()]]
        return float(r @ r), 2 * np.concatenate(parts)


def start(
    x: Array, y: Array, hidden: int, activation: str, rng: np.random.Generator, direction: Array | None = None
) -> Array:
    """Return random start weights p: the hidden layer after Nguyen & Widrow 1990, the output layer by least squares.

    With a `direction` (n_in,), the weights of every second neuron are parallel to this direction. For many inputs,
    random weights are rarely near an important direction.
    """
    k = x.shape[1]
    W1 = rng.normal(size=(hidden, k))
    if direction is not None:
        W1[::2] = direction * np.sign(rng.normal(size=(len(W1[::2]), 1)))
    W1 *= (1.4 if activation == "tanh" else 2.8) * hidden ** (1 / k) / np.linalg.norm(W1, axis=1, keepdims=True)
    centre = x[rng.integers(len(x), size=hidden)]  # the centre of each neuron is a random data point
    b1 = -np.sum(W1 * centre, axis=1)
    f = np.column_stack([_hidden(x @ W1.T + b1, activation)[0], np.ones(len(x))])
    # a small ridge prevents large output weights that cancel each other
    return np.concatenate([W1.ravel(), b1, least_squares(f, y, 1e-3)[0]])


def train(
    x: Array,
    y: Array,
    hidden: int,
    activation: str = "sigmoid",
    starts: int = 4,
    iterations: int = 300,
    decay: float = 1e-9,
    seed: int = 0,
    direction: Array | None = None,
    progress: Progress = silent,
    most_rows: int = MOST_ROWS,
    trainer: Trainer = TRAINERS["levenberg_marquardt"],
) -> tuple[Network, float]:
    """Train a network from several random start values; return the network and its RMS error on the scaled output.

    From each start value, the network is trained for a tenth of the iterations. Then the best network is trained for
    all iterations. With a single start value, the first stage is omitted. The inputs x (n, n_in) and the output y (n,)
    must be scaled to about [-1, 1]. Weight decay adds `decay` times the sum of the squared weights to the mean square
    error. `direction` (n_in,) is an important direction of the input space (see `start`). If there are more than
    `most_rows` rows, they are thinned evenly. The returned error includes the weight decay.
    """
    stride = -(-len(x) // most_rows)
    x, y = np.ascontiguousarray(x[::stride]), y[::stride]
    rng = np.random.default_rng(seed)
    first = max(iterations // 10, 10) if starts > 1 else 0
    total = starts * first + iterations

    ridge = np.sqrt(decay * len(x)) * np.eye(hidden * (x.shape[1] + 2) + 1)[:-1]  # no decay of the output bias

    fit = Fit(x, y, hidden, activation)

    def function(p: Array) -> tuple[Array, Array]:
        r, J = fit.residuals(p)
        return np.concatenate([r, ridge @ p]), np.vstack([J, ridge])

    def gradient(p: Array) -> tuple[float, Array]:
        (value, g), w = fit.gradient(p), ridge @ p
        return value + float(w @ w), g + 2 * (ridge.T @ w)

    squares = Squares(function, lambda p: np.concatenate([fit.errors(p), ridge @ p]), gradient)

    def part(done: float, share: float) -> Progress:
        return lambda fraction: progress((done + fraction * share) / total)

    trials = []
    for i in range(starts):
        p = start(x, y, hidden, activation, rng, direction)
        trials.append(trainer(p, squares, first, part(i * first, first)) if first else (p, 0.0))
    best = min(trials, key=lambda trial: trial[1])
    p, cost = trainer(best[0], squares, iterations, part(starts * first, iterations))
    return fit.network(p), float(np.sqrt(cost / len(x)))


def decay_for(y: Array, least: float = LEAST_DECAY) -> float:
    """Return the weight decay for noisy data: the noise variance of y divided by a weight variance of 10 (MacKay 1992).

    The noise is estimated from the third differences of y (n,). Kinks of y have less effect on this estimate than on
    `hystfmu.data.reversals.noise`.
    """
    third = np.diff(y, 3)
    variance = (np.median(np.abs(third)) / 0.6745) ** 2 / 20 if len(third) else 0.0
    return max(least, float(variance) / 10)
