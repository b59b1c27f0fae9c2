"""Search for linear dynamics after a hysteresis: G0(s) = 1 / (s^2/omega_n^2 + 2 zeta s/omega_n + 1) with a delay.

The record can show further modes (resonances). They are added in parallel to G0, each with a share of the static gain,
if they reduce the residuals.

The dynamics follow a weighted sum of signals, whose weights are fitted for each trial of the dynamics. The derivatives
of the residuals with respect to the dynamics are those of Kaufman (see `objective`): they need one filtered signal per
parameter, the weighted sum.

A block `delay` represents the whole samples of the delay. The remaining fraction tau of a sample is represented by a
Padé approximant of e^(-s tau) of order 2 in the transfer function. The phase error of this approximant is (omega
tau)^5/720, which is 5e-9 rad at a fiftieth of the sampling rate.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from hystfmu.base import Array, Indices, InputError, Mask, Progress
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise
from hystfmu.graph import Graph, Node
from hystfmu.graph.recursion import discretised
from hystfmu.identify.catalogue import Option, Options
from hystfmu.identify.evidence import Evidence, evidence
from hystfmu.identify.solvers.trust_region import Differences, refined, standard_errors
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


RATED = 1500  # minimum number of rows on which start points are compared; more rows are thinned evenly
DEPENDENT = 1e-10  # relative singular value of normalised columns below which a combination counts as dependent
MOST_ROWS = 60_000  # maximum number of rows of a record whose modes are identified before the fit
TRIALS = 11  # number of start values of f_n, over at most four decades
MOST_EVALUATIONS = 40  # maximum number of evaluations of residuals and Jacobian per start value
TOLERANCE = 1e-9  # relative change that ends a search
NOISY = 1.05  # ratio of residuals to noise up to which a further start point cannot reduce the residuals

_SHOWN: dict[tuple[str | int, ...], Evidence] = {}


class Weighted:
    """Signals before the dynamics, whose weighted sum after the dynamics approximates the output on some rows.

    `columns` (n, m) contains the signals. `fit` returns the weights (m,) of the filtered signals (rows, m) for an
    output (rows,), and the weights that a small change of the dynamics also changes, as a mask (m,).
    """

    def __init__(
        self,
        columns: Array,
        data: Dataset,
        rows: Indices,
        hold: str,
        fit: Callable[[Array, Array], tuple[Array, Mask]],
    ) -> None:
        self.columns, self.data, self.rows, self.hold, self.fit = columns, data, rows, hold, fit
        self._last: tuple[Dynamics | None, Array, Array, Array] = None, columns, columns, columns

    def thinned(self) -> "Weighted":
        """Return the problem on at least `RATED` rows, if there are as many."""
        rows = self.rows[:: max(1, len(self.rows) // RATED)]
        return Weighted(self.columns, self.data, rows, self.hold, self.fit)

    def project(self, g: Dynamics) -> tuple[Array, Array, Array]:
        """Return the residuals (rows,) for the dynamics g, the weights (m,), and the columns of weights that change."""
        if self._last[0] != g:
            seen, y = g.filter(self.columns, self.data.h, self.hold, self.rows), self.data.y[self.rows]
            weights, moves = self.fit(seen, y)
            self._last = g, seen @ weights - y, weights, seen[:, moves]
        return self._last[1:]

    def differences(self, beside: Beside, limits: tuple[Array, Array]) -> Differences:
        """Return the residuals, relative to the span of y, as a function of the point of a search between `limits`."""
        h, size = self.data.h, self.data.span * np.sqrt(len(self.rows))

        def held(p: Array) -> tuple[Callable[[Array], Array], Array]:
            _, weights, moving = self.project(Dynamics.at(p, h, beside))
            total = (self.columns @ weights)[:, None]
            U, s, _ = np.linalg.svd(moving / np.maximum(np.linalg.norm(moving, axis=0), 1e-300), full_matrices=False)

            def run(q: Array) -> Array:
                return np.asarray(Dynamics.at(q, h, beside).filter(total, h, self.hold, self.rows)[:, 0] / size)

            return run, np.asarray(U[:, s > DEPENDENT * s.max(initial=0.0)])

        def residuals(p: Array) -> Array:
            return np.asarray(self.project(Dynamics.at(p, h, beside))[0] / size)

        return Differences(residuals, np.ones(len(limits[0])), limits, held=held)


def search(
    weighted: Weighted, data: Dataset, options: Options, progress: Progress, near: Dynamics | None = None
) -> Dynamics:
    """Return the dynamics that minimise the residuals, by trust-region steps from `near`.

    Without `near`, the search begins at the best start point of a grid of natural frequencies. If the residuals then
    exceed the noise, it also begins at the best other start point: a point of the grid, or the modes that the record
    shows.
    """
    h, (lo, hi) = data.h, bounds(data, options)
    rough = weighted.thinned()

    def problem(of: Weighted, beside: Beside) -> Differences:
        return of.differences(beside, (np.append(lo, -np.ones(len(beside))), np.append(hi, np.ones(len(beside)))))

    def rated(start: tuple[Array, Beside]) -> float:
        at = problem(rough, start[1])
        return float(np.sum(at.residuals(at.coordinates.inside(_point(*start))) ** 2))

    def refine(start: tuple[Array, Beside]) -> tuple[float, Dynamics]:
        found = refined(problem(weighted, start[1]), _point(*start), MOST_EVALUATIONS, TOLERANCE)
        return found.misfit, Dynamics.at(found.p, h, start[1])

    if near is not None:
        return refine((near.point(h), near.beside))[1]
    grid = np.linspace(hi[0], max(lo[0], hi[0] + np.log(1e-4)), TRIALS)
    starts: list[tuple[Array, Beside]] = [(np.array([f, np.log(0.7), d]), ()) for f in grid for d in (0.0, 2.0)]
    first, second, *_ = sorted(starts, key=rated)
    progress(0.3)
    found = refine(first)
    progress(0.65)
    if found[0] * data.span > NOISY * noise(data.y[data.counted]):
        # a lightly damped resonance can lie between two frequencies of the grid
        shown: list[tuple[Array, Beside]] = [(mode.point(h), mode.beside) for mode in _modes(data)]
        found = min(found, refine(min([second, *shown], key=rated)), key=lambda f: f[0])
    progress(1.0)
    return found[1]


def _point(p: Array, beside: Beside) -> Array:
    return np.append(p, [share for *_, share in beside])


def _modes(data: Dataset) -> list[Dynamics]:
    """Return start points of the search: dynamics with each mode that the record shows, and with all modes.

    For a record with more than `MOST_ROWS` rows, there are no such start points.
    """
    if len(data.u) > MOST_ROWS:
        return []
    key = tuple(data.identity)
    if (shown := _SHOWN.get(key)) is None:  # candidates of ``auto`` and folds share a record
        shown = evidence(data)
        _SHOWN.clear()
        _SHOWN[key] = shown
    late = shown.delay if np.isfinite(shown.delay_se) else 0.0
    found = [Dynamics(m.f_n, m.zeta, late) for m in shown.modes]
    if len(shown.modes) > 1:
        total = sum(m.share for m in shown.modes)
        first, *others = sorted(shown.modes, key=lambda m: -m.share)
        found.append(Dynamics(first.f_n, first.zeta, late, tuple((m.f_n, m.zeta, m.share / total) for m in others)))
    return found


def uncertainty(weighted: Weighted, g: Dynamics, data: Dataset, options: Options) -> Array:
    """Return the standard errors (3,) of ln f_n, ln zeta and the delay (samples) of the identified dynamics `g`."""
    lo, hi = bounds(data, options)
    near, p = weighted.differences(g.beside, (lo, hi)), np.clip(g.point(data.h), lo, hi)
    return standard_errors(near.residuals(p), near.jacobian(p), ~near.coordinates.at_bounds(p))
