"""Checks of every fit: properties of a model that its data do not support.

- Another signal. The model runs free on steps to the ends of the trained range, and on nested reversals inside this
  range. The signal has the speed of the data, and 200 rows a cycle. An output that overflows or grows without bound is
  an error. An output that leaves the range of y by more than the span of y gives a warning: the model extrapolates,
  because the record has few reversals or does not excite the dynamics.
- Poles. The data cannot determine a pole of a transfer function above pi/h, because its response settles within a step
  of the data. Poles of a Padé approximant of a delay, whose zeros mirror the poles, are not checked.
- Bounds. The data do not determine a parameter that is at a bound of its search.
- Coverage. For a network, this is the share of the states of other signals that the training rows reach.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.data.signals import nested_reversals
from hystfmu.graph import Graph
from hystfmu.model import with_starts

HELD = 100  # rows of each step
REVERSALS, SEED = 80, 77
LEAST_STEP, MOST_STEP = 0.01, 0.1  # of the reversals, in half ranges per row
WILD = 100.0  # spans of y beyond its range: the output grows without bound
WIDE = 1.0  # spans of y beyond its range that are warned of
NEAR = 1e-3  # of the width of a search: distance from a bound
POOR = 40.0  # % coverage
STOPPED = "is a bound of the search"
MIRRORED = 1e-6  # relative distance of a pole from a mirrored zero

Bounded = Mapping[str, tuple[float, float, float]]
"""Parameters of a search by name: value, least and largest value tried."""


def other_signal(data: Dataset) -> Array:
    """Return steps to both ends of the trained range, and nested reversals inside it, at two speeds."""
    u = data.u[data.counted]
    lo, hi, first = float(u.min()), float(u.max()), float(data.u[0])
    half = (hi - lo) / 2
    moved = float(np.sqrt(np.mean(np.diff(u) ** 2)))
    speed = float(np.clip(moved / half, LEAST_STEP, MOST_STEP)) if half else LEAST_STEP  # a part that holds one level
    steps = np.repeat([first, hi, lo, (lo + hi) / 2], HELD)
    turns = [nested_reversals(REVERSALS, SEED + k, step) for k, step in enumerate((speed, LEAST_STEP))]
    return np.concatenate([steps, (lo + hi) / 2 + half * np.concatenate(turns)])


def warnings(key: str, graph: Graph, data: Dataset, bounded: Bounded, covered: float | None) -> list[str]:
    """Check a fitted model of the kind `key` by the rules of this module; return a line for each finding.

    `bounded` contains the parameters that were searched between bounds. `covered` is the coverage of the input space of
    a network (%). A model that is unstable on another signal raises an InputError.
    """
    return [*excursion(key, graph, data), *_fast_poles(graph, data.h), *_at_bounds(bounded), *_unseen(covered)]


def excursion(key: str, graph: Graph, data: Dataset) -> list[str]:
    """Return a warning if the model leaves the range of y on another signal; refuse an unstable model."""
    beyond = _beyond(graph, other_signal(data), data)
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


def leaves(graph: Graph, u: Array, data: Dataset) -> bool:
    """Return whether a model on the input u (n,) leaves the range of y of the data by more than its span."""
    return not _beyond(graph, u, data) <= WIDE + _ringing(graph)


def _beyond(graph: Graph, u: Array, data: Dataset) -> float:
    """Return the distance of the output from the range of y, in spans; covariates are at their means."""
    y, measured = graph.run(with_starts(graph, u), data.h), data.y[data.counted]
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.max(np.maximum(y - measured.max(), measured.min() - y))) / data.span


def _ringing(graph: Graph) -> float:
    """Return the overshoot of lightly damped modes for two full steps, in spans, which is not extrapolation."""
    total = 0.0
    for n in graph.nodes:
        if n.block.name == "transfer_function":
            for p in np.roots(n.value("a")):
                if p.imag > 0 and p.real < 0:
                    total += 2 * float(np.exp(np.pi * p.real / p.imag))
    return total


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
    """Return the names of the parameters at a bound of their search, from the warnings of a fit."""
    return [line.partition(" = ")[0] for line in told if STOPPED in line]


def _unseen(covered: float | None) -> list[str]:
    if covered is None or covered >= POOR:
        return []
    return [
        f"the training rows reach {covered:.0f} % of the states that other signals in the range reach: the error "
        "of the network in all other states is unknown"
    ]


def follows_late(graph: Graph) -> bool:
    """Return whether the output of a model depends on past values of u only, by its own dynamics or delay."""
    return not any(graph.inputs[0].name in known for known in graph.dependencies().values())
