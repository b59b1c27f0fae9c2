"""Search for linear dynamics after a hysteresis: G0(s) = 1 / (s^2/omega_n^2 + 2 zeta s/omega_n + 1) with a delay.

The record can show further modes (resonances). They are added in parallel to G0, each with a share of the static gain,
if they reduce the residuals.

A block `delay` represents the whole samples of the delay. The remaining fraction tau of a sample is represented by a
Padé approximant of e^(-s tau) of order 2 in the transfer function. The phase error of this approximant is (omega
tau)^5/720, which is 5e-9 rad at a fiftieth of the sampling rate.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from hystfmu.base import Array, Indices, InputError
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node
from hystfmu.graph.recursion import discretised
from hystfmu.identify.catalogue import Option, Options
from hystfmu.model import Model

LEAST_REST = 1e-6  # a shorter fractional delay, in samples, is neglected
# standard errors above which a warning is given: of ln f_n and ln zeta, and of the delay as a phase at f_n (rad)
KNOWN, KNOWN_PHASE = 0.02, 0.05

Beside = tuple[tuple[float, float, float], ...]  # natural frequency (Hz), damping ratio, share of the static gain

DYNAMICS_OPTIONS = (
    Option("hold", "foh", choices=("foh", "zoh"), text="input between rows: foh: a ramp; zoh: constant (new value)"),
    Option("delay_max", 10.0, 0.0, 1e5, text="longest delay tried, in samples"),
    Option("zeta_max", 5.0, 0.01, 1e3, text="largest damping ratio tried"),
)


@dataclass(frozen=True)
class Dynamics:
    """Parameters of G0(s) and the delay.

    Attributes
    ----------
    f_n, zeta, delay : float
        Natural frequency (Hz), damping ratio, delay (s).
    beside : tuple of (float, float, float)
        Natural frequency (Hz), damping ratio and share of the static gain of further modes.
    """

    f_n: float
    zeta: float
    delay: float
    beside: Beside = ()

    @classmethod
    def at(cls, p: Sequence[float] | Array, h: float, beside: Beside = ()) -> "Dynamics":
        """Return the dynamics at the point p = (ln f_n, ln zeta, delay in samples) of a search, for the step h (s).

        If p has further elements, they are the shares of the modes `beside`.
        """
        samples = float(p[2])
        if beside and len(p) > 3:
            beside = tuple((f, zeta, float(k)) for (f, zeta, _), k in zip(beside, p[3:], strict=True))
        return cls(float(np.exp(p[0])), float(np.exp(p[1])), samples * h if samples > LEAST_REST else 0.0, beside)

    @property
    def told(self) -> dict[str, Any]:
        """Entries of `Model.fit`. ``modes`` contains the frequency (Hz), damping ratio and share of further modes."""
        further = {"modes": [list(mode) for mode in self.beside]} if self.beside else {}
        return {"f_n": self.f_n, "zeta": self.zeta, "delay": self.delay, **further}

    @property
    def parameters(self) -> int:
        """Number of fitted parameters."""
        return 3 + 3 * len(self.beside)

    def point(self, h: float) -> Array:
        """Return the point p of a search that `at` converts to these dynamics, for the step h (s)."""
        return np.array([np.log(self.f_n), np.log(self.zeta), self.delay / h])

    @lru_cache(maxsize=64)  # noqa: B019 - a search asks for the blocks of a point several times
    def nodes(self, h: float, hold: str) -> tuple[Node, ...]:
        """Return the blocks of the dynamics in series, for the step h (s).

        The blocks are ``g0`` (transfer_function), and ``delay`` if the delay is at least one sample. `hold` is the form
        of the input between rows, ``foh`` (ramp) or ``zoh`` (constant).
        """
        whole = math.floor(self.delay / h + LEAST_REST)
        b, a = polynomials(self, max(self.delay - whole * h, 0.0) if self.delay / h - whole > LEAST_REST else 0.0)
        g0 = Node("g0", "transfer_function", {}, {"b": b, "a": a, "hold": hold, "start": "steady"})
        return (g0, Node("delay", "delay", {"n": whole})) if whole else (g0,)

    def filter(self, columns: Array, h: float, hold: str, rows: Indices | None = None) -> Array:
        """Return the columns (n, m), filtered by G0 and the delay from steady state, on ascending rows or all rows."""
        g0, *delays = self.nodes(h, hold)
        picked = np.arange(len(columns)) if rows is None else rows
        return discretised(g0, h).run(columns, np.maximum(picked - (delays[0].dims["n"] if delays else 0), 0))


def polynomials(g: Dynamics, rest: float) -> tuple[Array, Array]:
    """Return the numerator and denominator of G0(s) times the Padé approximant of e^(-s rest), highest power first."""
    modes = [(g.f_n, g.zeta, 1 - sum(share for *_, share in g.beside)), *g.beside]
    dens = [np.array([1.0, 2 * zeta * 2 * np.pi * f, (2 * np.pi * f) ** 2]) for f, zeta, _ in modes]
    b, a = np.zeros(1), np.ones(1)
    for (f, _, share), den in zip(modes, dens, strict=True):
        b = np.convolve(b, den)
        b[-len(a) :] += share * (2 * np.pi * f) ** 2 * a
        a = np.convolve(a, den)
    b = b[np.flatnonzero(b)[0] :]
    if rest == 0:
        return b, a
    pade = np.array([1.0, 6 / rest, 12 / rest**2])
    return np.polymul(b, pade * [1, -1, 1]), np.polymul(a, pade)


def bounds(data: Dataset, options: Options) -> tuple[Array, Array]:
    """Return the lower and the upper bounds of (ln f_n, ln zeta, delay in samples).

    f_n lies between one cycle per record and the Nyquist frequency. zeta lies between 0.01 and the option `zeta_max`.
    """
    n = data.train.stop - data.train.start
    lo = np.array([np.log(1 / (n * data.h)), np.log(0.01), 0.0])
    return lo, np.array([np.log(0.5 / data.h), np.log(options["zeta_max"]), max(options["delay_max"], 1e-9)])


def unknown(g: Dynamics, spread: Array, data: Dataset, options: Options) -> list[str]:
    """Return one warning for each of the values f_n, zeta and delay that the data do not determine.

    `spread` (3,) contains the standard errors of ln f_n, ln zeta and the delay (samples). The options define the bounds
    of the search.
    """
    lo, hi = bounds(data, options)
    p, room = g.point(data.h), 1e-3
    found: list[str] = []
    if not lo[0] + room < p[0] < hi[0] - room:
        found.append(f"f_n = {g.f_n:.4g} Hz is a bound of the search: the record shows no such dynamics")
    elif spread[0] > KNOWN:
        found.append(
            f"f_n = {g.f_n:.4g} Hz has a standard error of {100 * spread[0]:.3g} %: excite frequencies up to about f_n"
        )
    if spread[1] > KNOWN:
        found.append(f"zeta = {g.zeta:.3g} has a standard error of {100 * spread[1]:.3g} %")
    if options["delay_max"] > 0 and 2 * np.pi * g.f_n * spread[2] * data.h > KNOWN_PHASE:
        found.append(f"the delay {g.delay:.3g} s has a standard error of {spread[2] * data.h:.2g} s")
    return found


def told(g: Dynamics, spread: Array, data: Dataset, options: Options) -> dict[str, Any]:
    """Return entries of `Model.fit`: the dynamics g, the standard errors ``f_n_se`` (Hz) and ``zeta_se``, ``warnings``.

    The entries contain no standard error of a value that is at a bound or has no effect on the residuals.
    """
    lo, hi = bounds(data, options)
    p, room = g.point(data.h), 1e-3
    inside = (lo + room < p) & (p < hi - room) & np.isfinite(spread)
    values = (("f_n_se", g.f_n), ("zeta_se", g.zeta))
    known = {key: float(value * spread[k]) for k, (key, value) in enumerate(values) if inside[k]}
    return {**g.told, **known, "warnings": unknown(g, spread, data, options)}


def hysteresis(model: Model) -> Model:
    """Return the model without G0 and delay, so that `hystfmu.inverse.inverse` can invert it.

    To also compensate the dynamics, place a block ``feedforward`` with ``f_n`` and ``zeta`` of ``model.fit`` before the
    inverse. This block needs the reference and its first two derivatives ``delay`` seconds in advance. A model without
    these dynamics raises an InputError.
    """
    g = model.graph
    if not model.key.startswith("g0_"):
        raise InputError(f"The model of hysteresis() must have a key g0_... . Got {model.key!r} instead.")
    (source,) = (a for a, b in g.wires if b == "g0.u")
    nodes = [n for n in g.nodes if n.name not in ("g0", "delay")]
    wires = [(a, b) for a, b in g.wires if not {a.split(".")[0], b.split(".")[0]} & {"g0", "delay"}]
    static = Graph(nodes, [*wires, (source, "readout.u")], g.inputs, g.outputs)
    return replace(model, key=model.key.removeprefix("g0_"), graph=static, fit={})
