"""Checks after every fit, which find properties of a model that its data do not determine.

- Another signal. The model is simulated with a test signal in the trained range. The signal begins with steps to both
  ends of this range. Two sequences of nested reversals follow: the first at about the speed of the data, the second at
  a slow speed. If the output overflows or grows without limit, the fit fails. If the output leaves the range of y by
  more than the span of y, a warning is given: the model extrapolates, because the record has few reversals or does not
  excite the dynamics.
- Poles. The data cannot determine a pole of a transfer function whose magnitude exceeds pi/h, because the response of
  such a pole settles within one step h of the data. Poles of a Padé approximant of a delay are not checked; the zeros
  of such an approximant mirror its poles.
- Bounds. If the search stops with a parameter at its bound, the data do not determine this parameter.
- Drift. The residuals are averaged over chunks of consecutive rows, because neighbouring residuals of a hysteresis
  model are not independent. A straight line is fitted to the averages. The drift is the change of this line from the
  first to the last row, and the scatter of the averages gives its standard error. The result is a lower bound, because
  wide plays, which move rarely, absorb part of the drift. Creep is not drift: creep depends on the input, and models
  with lags represent it.
- Coverage. For a network, the coverage is the share of the states of other signals that are near the training rows.
"""

from collections.abc import Iterable, Mapping

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.data import Dataset
from hystfmu.data.signals import nested_reversals
from hystfmu.graph import Graph
from hystfmu.model import with_starts

HELD = 100  # number of rows of each step
REVERSALS, SEED = 80, 77
LEAST_STEP, MOST_STEP = 0.01, 0.1  # limits of the speed of the reversals, in half ranges per row
WILD = 100.0  # distance from the range of y, in spans, above which the output counts as unbounded
WIDE = 1.0  # distance from the range of y, in spans, above which a warning is given
NEAR = 1e-3  # distance from a bound, relative to the width of the search interval
POOR = 40.0  # coverage (%) below which a warning is given
STOPPED = "is a bound of the search"
CHUNKS = 20  # number of averages to which the line of the drift is fitted
SURE = 5.0  # number of standard errors that a reported drift must exceed
SAID = 0.5  # smallest drift that is reported (% of the span)
MIRRORED = 1e-6  # largest relative distance between a pole and a mirrored zero

Bounded = Mapping[str, tuple[float, float, float]]
"""Searched parameters by name, each with its value, its lower bound and its upper bound."""


def excursion(key: str, graph: Graph, data: Dataset) -> list[str]:
    """Return a warning if the output of a fitted model leaves the range of y when the input is `other_signal`.

    If the output diverges for this input, the function raises an InputError, which names the kind `key`.
    """
    u = other_signal(data.u[data.counted], float(data.u[0]))
    y = graph.run(with_starts(graph, u), data.h)
    # at a jump, the force of a dashpot is inversely proportional to the sample time
    even = np.abs(np.diff(u, prepend=u[0])) <= MOST_STEP * np.ptp(u)
    beyond = _beyond(y[even], data.y[data.counted], data.span)
    if not beyond <= WILD:
        got = f"an output {beyond:.2g} spans of y outside its range" if np.isfinite(beyond) else "one that diverges"
        raise InputError(
            f"{data.path or data.name}: A model of the kind {key} must be stable on other signals within the trained "
            f"range of u. Got {got}: take another kind, or data with more reversals."
        )
    if beyond <= WIDE + _ringing(graph):
        return []
    return [
        f"on other signals within the trained range of u the output leaves the range of y by {beyond:.2g} times its "
        "span: the record does not show the output of the device there"
    ]


def leaves(graph: Graph, y: Array, measured: Array, span: float) -> bool:
    """Return whether an output y (n,) of a model leaves the range of `measured` by more than `span`."""
    return not _beyond(y, measured, span) <= WIDE + _ringing(graph)


def other_signal(u: Array, first: float) -> Array:
    """Return a test signal: steps from `first` to both ends of the range of u (n,), then reversals at two speeds."""
    lo, hi = float(u.min()), float(u.max())
    half = (hi - lo) / 2
    moved = float(np.sqrt(np.mean(np.diff(u) ** 2)))
    speed = float(np.clip(moved / half, LEAST_STEP, MOST_STEP)) if half else LEAST_STEP  # 0 if u is constant
    steps = np.repeat([first, hi, lo, (lo + hi) / 2], HELD)
    turns = [nested_reversals(REVERSALS, SEED + k, step) for k, step in enumerate((speed, LEAST_STEP))]
    return np.concatenate([steps, (lo + hi) / 2 + half * np.concatenate(turns)])


def _beyond(y: Array, measured: Array, span: float) -> float:
    """Return the largest distance of an output y (n,) from the range of `measured`, in multiples of `span`."""
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.max(np.maximum(y - measured.max(), measured.min() - y))) / span


def _ringing(graph: Graph) -> float:
    """Return the total overshoot of lightly damped modes after one step up and one step down, each of one span.

    The unit is the span of y. This overshoot is a property of the dynamics and not a sign of extrapolation.
    """
    total = 0.0
    for n in graph.nodes:
        if n.block.name == "transfer_function":
            for p in np.roots(n.value("a")):
                if p.imag > 0 and p.real < 0:
                    total += 2 * float(np.exp(np.pi * p.real / p.imag))
    return total


def warnings(graph: Graph, h: float, bounded: Bounded, covered: float | None) -> list[str]:
    """Return warnings about poles and parameters that the data do not determine, and about a low coverage.

    `bounded` contains the parameters that were searched between bounds. `covered` is the coverage of the input space of
    a network (%).
    """
    return [*_fast_poles(graph, h), *_at_bounds(bounded), *_unseen(covered)]


def _fast_poles(graph: Graph, h: float) -> list[str]:
    found = []
    for n in graph.nodes:
        if n.block.name != "transfer_function":
            continue
        zeros = np.roots(n.value("b"))
        poles = [p for p in np.roots(n.value("a")) if not np.any(np.abs(zeros + p) <= MIRRORED * abs(p))]
        fast = max((abs(p) for p in poles), default=0.0)
        if fast * h > np.pi:
            found.append(
                f"a pole of {n.name} at {fast:.2g} 1/s lies above pi/h = {np.pi / h:.2g} 1/s of the data, which do "
                "not determine this pole: the record shows slower dynamics, or no dynamics"
            )
    return found


def _at_bounds(bounded: Bounded) -> list[str]:
    return [
        f"{name} = {value:.4g} {STOPPED} ({lo:.4g} to {hi:.4g}): the data do not determine it"
        for name, (value, lo, hi) in bounded.items()
        if not lo + NEAR * (hi - lo) < value < hi - NEAR * (hi - lo)
    ]


def at_bounds(told: Iterable[str]) -> list[str]:
    """Return the names of the parameters that are at a bound of their search according to the warnings of a fit."""
    return [line.partition(" = ")[0] for line in told if STOPPED in line]


def _unseen(covered: float | None) -> list[str]:
    if covered is None or covered >= POOR:
        return []
    return [
        f"the training rows reach {covered:.0f} % of the states that other signals in the range reach: the error "
        "of the network in all other states is unknown"
    ]


def follows_late(graph: Graph) -> bool:
    """Return whether the output of a model depends only on past values of u, because of dynamics or a delay."""
    return not any(graph.inputs[0].name in known for known in graph.dependencies().values())


def drift(e: Array) -> tuple[float, float]:
    """Estimate the drift from the first row to the last row, and the standard error of this drift.

    Parameters
    ----------
    e : array, shape (n,)
        Residuals: measured output minus output of the model.

    Returns
    -------
    total, error : float
        Drift and standard error, in the unit of measure of e. For fewer than 6 rows, they are 0 and infinite.
    """
    n = min(CHUNKS, len(e) // 2)
    if n < 3:  # no residuals of the straight line
        return 0.0, np.inf
    means = np.array([part.mean() for part in np.array_split(e, n)])
    t = (np.arange(n) + 0.5) / n - 0.5
    slope = float(t @ means) / float(t @ t)
    left = means - means.mean() - slope * t
    error = float(np.sqrt(left @ left / max(n - 2, 1) / (t @ t)))
    return slope, error


def drifts(e: Array, span: float) -> list[str]:
    """Return a warning if the residuals e (n,) drift; `span` is the span of y."""
    total, error = drift(e)
    percent = 100 * total / span
    if abs(percent) < SAID or abs(total) < SURE * error:
        return []
    return [
        f"the output drifts by {percent:+.2g} % of its span or more over the training rows, which no model of the "
        "input represents; remove the drift from the data, or train on fewer rows"
    ]
