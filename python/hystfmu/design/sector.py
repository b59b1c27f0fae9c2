"""Sector of the incremental gain of an imperfect inverse and its plant in series.

The incremental gain is the local slope of the output over the wanted output. It depends on the path, and it is a factor
of the loop gain. The sector is the range of the incremental gain along a path. The loop must be stable for every
incremental gain in the sector.

The describing function of a block or model is the gain of the first harmonic in a simulation: N(A) = (b_1 + j a_1) / A,
with y = a_1 cos + b_1 sin + ... for u = A sin (Gelb & Vander Velde, Multiple-Input Describing Functions, 1968, section
2.2). For a static block, N does not depend on the frequency. For a block with dynamics, the frequency must be stated.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hystfmu.base import Array, Complex, Indices, InputError, checked
from hystfmu.core.library import block_types
from hystfmu.design.delays import DELAY, is_fir
from hystfmu.design.linear import linearise
from hystfmu.graph import Graph, Node
from hystfmu.model import Model


@dataclass(frozen=True)
class DescribingFunction:
    """Describing function as a function of the amplitude.

    Attributes
    ----------
    amplitude : array, shape (n,)
        Amplitude of u, in the unit of measure of u.
    N : complex array, shape (n,)
        Complex gain of the first harmonic, in units of measure of y per u.
    distortion : array, shape (n,)
        Ratio of the RMS of the higher harmonics to the RMS of the first harmonic. If this ratio is small, the
        describing function is reliable.
    """

    amplitude: Array
    N: Complex
    distortion: Array

    @property
    def gain(self) -> Array:
        """Absolute gain abs(N), shape (n,)."""
        return np.abs(self.N)

    @property
    def phase(self) -> Array:
        """Phase of N (degrees), shape (n,). It is negative if the output lags."""
        return np.degrees(np.angle(self.N))


@checked
def describing_function(
    part: Node | Graph | Model,
    amplitudes: Sequence[float] | Array,
    *,
    frequency: float = 1.0,
    samples: int = 4096,
    cycles: int = 2,
) -> DescribingFunction:
    """Compute the describing function of a block, graph or model with one input and one output.

    Parameters
    ----------
    part : Node, Graph or Model
        Block, graph or model to simulate.
    amplitudes : array, shape (n,)
        Input amplitudes, greater than 0, in the unit of measure of u.
    frequency : float
        Frequency of the sine (Hz). It affects only parts with dynamics.
    samples : int
        Number of samples in a cycle. The relative error of the first harmonic of a static part is about (1/samples)^2.
    cycles : int
        Number of cycles before the evaluated cycle, at least 1. In these cycles the memory reaches its steady state.

    Returns
    -------
    DescribingFunction

    Raises
    ------
    InputError
        The part has more than one input or output, or an amplitude, a frequency or a count is out of range.
    """
    graph = part.graph if isinstance(part, Model) else part if isinstance(part, Graph) else Graph.single(part)
    if graph.n_inputs != 1 or graph.n_outputs != 1:
        raise InputError(
            "The part of a describing function must have one input and one output. "
            f"Got {graph.n_inputs} and {graph.n_outputs} instead."
        )
    a = np.atleast_1d(np.asarray(amplitudes, dtype=np.float64))
    if not (np.isfinite(a).all() and (a > 0).all()):
        raise InputError(f"The amplitudes must be finite and greater than 0. Got {a.tolist()} instead.")
    if samples < 16 or cycles < 1:
        raise InputError(f"The samples and cycles must be at least 16 and 1. Got {samples} and {cycles} instead.")
    if not (np.isfinite(frequency) and frequency > 0):
        raise InputError(f"The frequency must be finite and greater than 0. Got {frequency!r} instead.")
    k = np.arange((cycles + 1) * samples + 1)
    wave = np.sin(2 * np.pi * (k % samples) / samples)
    N = np.empty(len(a), dtype=np.complex128)
    distortion = np.empty(len(a))
    for i, amplitude in enumerate(a):
        y = graph.run(amplitude * wave, 1 / (frequency * samples))[-samples:]
        # the last cycle begins one sample late, so y is shifted by one sample
        harmonics = np.fft.rfft(np.roll(y, 1)) / (samples / 2)
        N[i] = 1j * harmonics[1] / amplitude  # the first harmonic of u = A sin is -jA
        first = np.abs(harmonics[1])
        higher = np.sqrt((np.abs(harmonics[2:]) ** 2).sum())
        distortion[i] = higher / first if first > 0 else (0.0 if higher == 0 else np.inf)
    return DescribingFunction(a, N, distortion)


MOVED = 1e-3  # smaller steps, relative to the largest step of the path, are ignored because of rounding
COMPARED = 20_000  # largest number of rows at which the slope of a path with creep is computed
CONTINUOUS = "continuous"  # rate class of the blocks that are replaced by their static gain


def sector(path: Array, *chain: Graph | Model, h: float) -> tuple[float, float]:
    """Return the smallest and the largest incremental gain of units in series along a path.

    Parameters
    ----------
    path : array, shape (n,)
        Input of the first unit, one value per step.
    *chain : Graph or Model
        Units in series, for example the inverse and the plant. The path drives the first input of each unit; its other
        inputs keep their start values. The first output of each unit is used. Linear dynamics and delays are replaced
        by their static gain.
    h : float
        Step (s).

    Returns
    -------
    least, largest : float
        Smallest and largest change of the last output over the change of the path.

    Raises
    ------
    InputError
        The path is constant.
    """
    graphs = [without_dynamics(unit.graph if isinstance(unit, Model) else unit) for unit in chain]
    return slopes_along(path, *graphs, h=h)


def slopes_along(path: Array, *chain: Graph, h: float) -> tuple[float, float]:
    """Return the sector of units in series as `sector` does, also for units with creep or inverse creep.

    For units with creep, each incremental gain is computed from the difference between the outputs with and without one
    step of the path. Trap: creep continues while the path is constant. Therefore the difference of the output between
    two rows is not the effect of the path. For an inverse at its limit, such differences gave an incremental gain of
    -1.3.
    """
    v = np.asarray(path, float)
    dv = np.diff(v)
    largest = np.abs(dv).max(initial=0.0)
    if not largest > 0:
        raise InputError("The path of a sector must vary. Got a constant path.")
    moved = np.flatnonzero(np.abs(dv) > MOVED * largest) + 1
    if any(_drifts(n) for graph in chain for n in graph.nodes):
        moved = moved[:: -(-len(moved) // COMPARED)]
        dy = _against_rest(v, moved, chain, h)
    else:
        y = v
        for graph in chain:
            sizes = [p.size for p in graph.ports if p.kind == "input"]
            rows = np.tile(np.repeat([i.start for i in graph.inputs], sizes), (len(y), 1))
            rows[:, 0] = y
            y = graph.executor().run(rows, graph.n_outputs, h)[:, 0]
        dy = y[moved] - y[moved - 1]
    found = dy / dv[moved - 1]
    return float(found.min()), float(found.max())


def _drifts(node: Node) -> bool:
    """Return whether the output of a block moves while its input is constant."""
    undone = node.block.inverts
    return node.block.rate == CONTINUOUS or bool(undone and block_types()[undone].rate == CONTINUOUS)


def _against_rest(v: Array, moved: Indices, chain: Sequence[Graph], h: float) -> Array:
    """Return, for each row in `moved`, the change of the output that the last change of the path `v` causes.

    This is the output of the last unit minus its output for a path that is constant since the previous row.
    """
    units = [graph.executor() for graph in chain]
    ends = [[next(p.reference for p in g.ports if p.kind == kind) for kind in ("input", "output")] for g in chain]

    def through(x: float, k: int) -> float:
        for unit, (into, out) in zip(units, ends, strict=True):
            unit.set(into, x)
            if k:
                unit.step(k * h, h)
            else:
                unit.start(0.0)
            x = unit.get(out)
        return x

    asked, found = set(moved.tolist()), []
    through(float(v[0]), 0)
    for k in range(1, len(v)):
        if k not in asked:
            through(float(v[k]), k)
            continue
        before = [unit.state for unit in units]
        rest = through(float(v[k - 1]), k)
        for unit, state in zip(units, before, strict=True):
            unit.state = state
        found.append(through(float(v[k]), k) - rest)
    return np.array(found)


def without_dynamics(graph: Graph) -> Graph:
    """Return a graph in which static gains replace the linear dynamics, the delays and the FIR filters."""
    for n in graph.nodes:
        if n.block.rate == CONTINUOUS or n.type == DELAY:
            gain = 1.0 if n.type == DELAY else gain_of(n)
            graph = graph.replace(Node(n.name, "scaling", {"n": 1}, {"gain": gain}))
    return without_filters(graph)


def without_filters(graph: Graph) -> Graph:
    """Return a graph in which scalings with the same static gain and offset replace the FIR filters."""
    for n in filter(is_fir, graph.nodes):
        *weights, offset = n.value("theta")
        graph = graph.replace(Node(n.name, "scaling", {"n": 1}, {"gain": sum(weights), "offset": offset}))
    return graph


def gain_of(node: Node) -> float:
    """Return the gain that replaces a linear block: its static gain, or 1 if the static gain is 0 or infinite.

    An integrator has no finite static gain, so its gain counts as a part of the dynamics.
    """
    gain = static_gain(node)
    return gain if np.isfinite(gain) and gain != 0 else 1.0


def static_gain(node: Node) -> float:
    """Return the static gain D - C A^-1 B of a linear block; infinite for an integrator."""
    A, B, C, D = linearise(Graph.single(node))
    if not len(A):
        return float(D[0, 0])
    try:
        return float((D - C @ np.linalg.solve(A, B))[0, 0])
    except np.linalg.LinAlgError:
        return np.inf
