"""Inverse of a model with linear dynamics after the hysteresis: y = e^(-s tau) G(s) H[u].

G(s) has no causal inverse, but it has an approximate inverse that uses samples up to `p` steps ahead. Therefore the
cascade of inverse and model has a lag of ``lag_steps`` = p + delay steps. At low frequencies, the output of the cascade
is the wanted output, delayed by the lag. The cascade has no lag if the inverse receives the reference ``lag_steps``
steps early (parameter ``lead`` of the block `reference`).

The feed-forward is a weighted sum of the last 2 p + 1 samples of the wanted output. The weights f_i satisfy

  sum_i f_i z^-i = z^-p / G(z),  z = e^theta,

for the value and the first 2 p derivatives at theta = 0. For p = 1 and a second-order G, the sum is r + 2 zeta /
omega_n r' + r'' / omega_n^2, computed with central differences. G(z) is the transfer function of the discrete block,
which includes the hold and the Padé delay. The output of the feed-forward is the input of the inverse hysteresis, which
is computed by the chosen method.

At the highest frequency, the feed-forward amplifies noise of the wanted output by 4 / (omega_n h)^2. Therefore the
wanted output must be computed, not measured. The error of the feed-forward increases with frequency. `p` is the
smallest number of steps for which this error is at most `ACCURATE` at a tenth of the lowest natural frequency. A wanted
output with kinks, such as a triangle, has high frequencies, so the cascade follows it with an error.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from math import factorial
from typing import Generic

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.core.library import NO_LIMIT
from hystfmu.graph import Graph, Node
from hystfmu.graph.recursion import discretised
from hystfmu.inverse.ports import assembled, line, over_range
from hystfmu.model import M, Model, with_starts

ACCURATE, MOST_AHEAD = 1e-4, 8
BAND = 0.1  # highest frequency of the accurate band and of the cascade test, relative to the lowest natural frequency
LEAST_SAMPLES = 20  # minimum number of samples in a cycle of the test signals
DYNAMICS, LINEAR = ("transfer_function", "delay"), ("transfer_function", "delay", "scaling")


@dataclass(frozen=True)
class Parts(Generic[M]):
    """A model in two parts: the hysteresis `front`, and the chain `tail` of linear blocks after it."""

    front: M
    tail: tuple[Node, ...]

    @property
    def delay(self) -> int:
        """Number of steps by which the delay blocks of the tail delay a signal."""
        return sum(n.dims["n"] for n in self.tail if n.type == "delay")

    @property
    def filters(self) -> list[Node]:
        """The transfer functions of the tail."""
        return [n for n in self.tail if n.type == "transfer_function"]

    @property
    def readout(self) -> tuple[float, float]:
        """Gain and offset of the scalings in the tail."""
        return line(self.tail)

    def fractions(self, h: float) -> list[tuple[Array, Array]]:
        """Return the numerator and the denominator in z of each transfer function, discretised with the step h (s)."""
        return [discretised(n, h).fraction() for n in self.filters]

    def frequency(self) -> float:
        """Return the lowest natural frequency of the tail (Hz)."""
        poles = [abs(p) for n in self.filters for p in np.roots(n.value("a"))]
        return float(min(poles, default=np.inf) / (2 * np.pi))


def split(model: M) -> Parts[M] | None:
    """Separate the linear dynamics at the end of a model; return None if there are no dynamics or no other blocks."""
    g = model.graph
    drives = {b: a for a, b in g.wires}
    tail: list[Node] = []
    source = g.outputs[0].source
    while (node := g.node(source.split(".")[0])).type in LINEAR and f"{node.name}.u" in drives:
        limits = [abs(v) for name in ("lo", "hi") if name in node.values for v in node.value(name)]
        if min(limits, default=NO_LIMIT) < NO_LIMIT or sum(a.startswith(f"{node.name}.") for a, _ in g.wires) > 1:
            break
        tail.insert(0, node)
        source = drives[f"{node.name}.u"]
    while tail and tail[0].type not in DYNAMICS:
        source = f"{tail.pop(0).name}.y"
    if not tail or any(a.type == "scaling" for a, b in pairwise(tail) if b.type in DYNAMICS):
        return None
    names = {n.name for n in tail}
    nodes = [n for n in g.nodes if n.name not in names]
    wires = [(a, b) for a, b in g.wires if b.split(".")[0] not in names]
    front = Graph(nodes, wires, g.inputs, [replace(g.outputs[0], source=source)])
    return Parts(replace(model, key=model.key.removeprefix("g0_"), graph=front, fit={}), tuple(tail))


def dynamic_inverse(model: M, parts: Parts[M], inverted: Callable[[M], M]) -> M:
    """Return the series connection of the feed-forward of the dynamics and the inverse of the hysteresis.

    `parts` is the result of `split`. The function `inverted` returns the inverse of the hysteresis. `fit` of the result
    contains ``lag_steps``, ``lag`` (s), and ``band`` (Hz), the frequency up to which the inverse is accurate. If the
    hysteresis has no inverse of this kind, or the dynamics have no static gain, an InputError is raised.
    """
    if model.step is None:
        raise InputError(f"The model {model.key} must state its step for an inverse of its dynamics. Got none.")
    ahead, taps = feedforward(parts, model.step)
    behind = inverted(parts.front)
    g = behind.graph
    name = g.unused("dynamics")
    gain, offset = parts.readout
    theta = np.append(taps / gain, -offset / gain * taps.sum())
    node = Node(name, "polynomial_narx", {"n_u": len(taps), "n_f": 0, "n_y": 0, "q": 1, "n_k": 0}, {"theta": theta})
    wires = [*g.wires, *((f"{name}.y", end) for end in g.inputs[0].to)]
    how, steps = behind.provenance["inverse"], ahead + parts.delay
    made = assembled(model, how, [node, *g.nodes], wires, (f"{name}.u",), g.outputs[0].source, g.inputs[1:])
    lag = {"lag_steps": steps, "lag": steps * model.step, "band": BAND * parts.frequency()}
    told = {**behind.provenance, "samples": len(taps), "of": model.provenance}
    late = f"{how} inverse, {steps} step{'s' * (steps > 1)} late: {model.text}"
    return replace(made, text=late, fit={**behind.fit, **lag}, provenance=told)


def feedforward(parts: Parts[M], h: float) -> tuple[int, Array]:
    """Return the number p of steps ahead and the weights of the feed-forward, newest sample first, for the step h (s).

    The feed-forward inverts the transfer functions, but not the scalings and delays. Dynamics without static gain, or
    dynamics that need more than `MOST_AHEAD` steps, raise an InputError.
    """
    fractions = parts.fractions(h)
    theta = min(2 * np.pi * BAND * parts.frequency() * h, np.pi / 10)
    z = np.exp(1j * theta)
    there = np.prod([np.polyval(b, z) / np.polyval(a, z) for b, a in fractions])
    for ahead in range(1, MOST_AHEAD + 1):
        n = 2 * ahead + 1
        order = np.arange(n)
        target = _exponential(-ahead, n)
        for b, a in fractions:
            target = np.convolve(target, _quotient(_polynomial(a, n), _polynomial(b, n)))[:n]
        moments = np.array([_exponential(-float(i), n) for i in range(n)]).T
        taps = np.linalg.solve(moments, target)
        found = np.sum(taps * z ** (-order.astype(float))) * z**ahead * there
        if abs(found - 1) <= ACCURATE:
            return ahead, taps
    raise InputError(
        f"The dynamics of {parts.front.key} must have an inverse that looks at most {MOST_AHEAD} samples ahead. Got "
        f"an error above {ACCURATE:g} at {BAND * parts.frequency():.4g} Hz with steps of {h:g} s."
    )


def _exponential(k: float, n: int) -> Array:
    """Return the first n Taylor coefficients of e^(k theta)."""
    return np.array([k**m / factorial(m) for m in range(n)])


def _polynomial(p: Array, n: int) -> Array:
    """Return the first n Taylor coefficients in theta of a polynomial in z = e^theta.

    `p` contains the coefficients of the polynomial, the highest power of z first.
    """
    degree = len(p) - 1
    return np.asarray(sum(c * _exponential(degree - i, n) for i, c in enumerate(p)))


def _quotient(a: Array, b: Array) -> Array:
    """Return the first len(a) coefficients of the quotient a / b of two power series."""
    out = np.zeros(len(a))
    for m in range(len(a)):
        out[m] = (a[m] - out[:m] @ b[m:0:-1]) / b[0] if b[0] else np.nan
    return out


def wanted(model: Model, parts: Parts[M], share: float) -> list[Array]:
    """Return wanted outputs for the cascade test: two decaying sines and a sum of two sines.

    Their frequencies are at most `BAND` times the lowest natural frequency. Their range is the fraction `share` of the
    range of the model. In its first cycle, each signal increases smoothly from the output at rest to its full
    amplitude. `parts` is the result of `split`.
    """
    from hystfmu.data.signals import decaying_sine, two_tones

    assert model.step is not None
    there = over_range(parts.front, share * np.array([1.0, -1.0, 1.0]))
    reached = parts.front.predict(with_starts(parts.front.graph, there))
    gain, offset = parts.readout
    start, least, most = (gain * v + offset for v in (float(reached[0]), float(reached.min()), float(reached.max())))
    samples = max(round(1 / (BAND * parts.frequency() * model.step)), LEAST_SAMPLES)
    shapes = (
        (samples, decaying_sine(8, 0.1, samples)),
        (samples, decaying_sine(6, 0.3, samples)),
        (round(3.7 * samples), two_tones(4, 3.7, 0.4, round(3.7 * samples))),
    )
    out = []
    for cycle, v in shapes:
        way_in = 0.5 - 0.5 * np.cos(np.pi * np.minimum(np.arange(len(v)) / cycle, 1))
        out.append(start + way_in * ((least + most) / 2 - start + (most - least) / 2 * v))
    return out
