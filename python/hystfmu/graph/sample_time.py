"""Steps of a graph: rate classes of its blocks, sample time of its memory, suitable step for its dynamics."""

from __future__ import annotations

import math

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.core.executor import ContinuousExecutor
from hystfmu.graph.graph import Graph


def is_hysteretic(graph: Graph) -> bool:
    """Return whether a block updates its memory at every completed step of a solver."""
    return any(n.block.rate == "hysteretic" for n in graph.nodes)


def is_sampled(graph: Graph) -> bool:
    """Return whether a block advances at sample times only."""
    return any(n.block.rate == "sampled" for n in graph.nodes)


def needs_step(graph: Graph) -> bool:
    """Return whether the model depends on the length of its steps.

    The model depends on this length if it has a sampled block. It also does if the source of a memory changes only at
    steps, because the graph depends on time, or reads outputs of the last step in a loop.
    """
    timed = any(n.block.of("time") for n in graph.nodes)
    looped = any(source >= to and place != graph.nodes[to].block.trial - 1 for to, place, source, *_ in graph.links)
    return is_sampled(graph) or ((timed or looped) and any(n.block.rate != "function" for n in graph.nodes))


DEFAULT = 1e-3  # s, without a step of the graph and dynamics
MOST_SAMPLES = 1_000_000  # in one step, as in an FMU
_PER_PERIOD = 20  # steps per period or, for a real pole, per 2 pi time constants


def sample_time(graph: Graph) -> float | None:
    """Return the sample time (s); every communication step must be a multiple of it. None if any step is valid.

    A sampled block in a graph without a step takes a sample at each communication point.
    """
    return graph.step if graph.step > 0 and needs_step(graph) else None


def samples_in(period: float, t: float, h: float) -> int:
    """Return the number of samples, `period` (s) apart, in a step of `h` (s) that begins at `t` (s).

    Raises
    ------
    InputError
        The step is not a multiple of the period. The tolerance is a thousandth of the period plus rounding errors of
        the times.
    """
    n = math.floor(h / period + 0.5)
    off, slack = abs(h - n * period), 1e-3 * period + 16 * np.finfo(float).eps * abs(t + h)
    if not (1 <= n <= MOST_SAMPLES and off <= slack and off < 0.5 * period):
        raise InputError(
            f"The step must be a multiple (1 to {MOST_SAMPLES}) of the sample time {period!r} s of the model. "
            f"Got {h!r} s instead."
        )
    return n


def suitable_step(graph: Graph) -> float:
    """Return the step (s) of the default experiment: the step of the graph, or a step for its fastest pole."""
    if graph.step > 0:
        return graph.step
    pole = _fastest_pole(graph)
    if not (pole > 0 and math.isfinite(pole)):
        return DEFAULT
    step = 2 * math.pi / pole / _PER_PERIOD
    decade = 10.0 ** math.floor(math.log10(step))
    return float(f"{max(m for m in (1, 2, 5) if m * decade <= step * (1 + 1e-9)) * decade:.0e}")


def _fastest_pole(graph: Graph) -> float:
    """Return the largest modulus (1/s) of the poles at the start of the graph; 0 without continuous states."""
    n = len(graph.continuous_states)
    if not n:
        return 0.0
    executor = ContinuousExecutor(graph.to_bytes())
    executor.start(0.0)
    executor.evaluate(0.0)
    columns = [executor.tangent(np.zeros(graph.n_inputs), seed, graph.n_outputs)[1] for seed in np.eye(n)]
    return float(np.abs(np.linalg.eigvals(np.column_stack(columns))).max())
