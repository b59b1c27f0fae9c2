"""Repetitive control: design of the filters for several loops, and removal of period memories from a graph.

The block `repetitive` is in front of a controller. If the error in one period is e, the error in the next period is (Q
- L T) e. T is the complementary sensitivity of the loop without this block. For any period, the loop is stable if abs(Q
- L T) < 1 at all frequencies (Hara et al. 1988, theorem 1).

A period memory stores one period of n steps in a ring buffer. Its update law is w_k = Q w_(k-n) + L e_(k-n) with
non-causal filters Q and L. A state space of this memory would have n states, so the stability test uses the frequency
response instead.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hystfmu.base import Array, Complex, InputError
from hystfmu.design.loop import response
from hystfmu.graph import Graph, Input, Node, Output

POINTS = 4096  # number of points of the discrete Fourier transform
EDGE = 0.5  # fraction of the taps of L that a cosine window tapers


@dataclass(frozen=True)
class RepetitiveFilters:
    """Filter taps of the block `repetitive`, and the convergence of the error for each loop.

    Attributes
    ----------
    q : array, shape (n_q + 1,)
        Taps of the symmetric zero-phase filter Q: the middle tap, then the taps on one side.
    l : array, shape (2 n_l + 1,)
        Taps of the learning filter L, from n_l steps back to n_l steps ahead.
    contraction : tuple of float
        max abs(Q - L T) over all frequencies, for each loop.
    """

    q: Array
    l: Array  # noqa: E741 - the letter of the papers and of the block
    contraction: tuple[float, ...]

    def error_ratio(self, L: Any, w: Array, n: int) -> Array:
        """Return the factor by which repetitive control changes the error at each frequency.

        Parameters
        ----------
        L : control.TransferFunction or control.StateSpace
            Open loop with a step.
        w : array, shape (m,)
            Frequencies (rad/s).
        n : int
            Number of steps in a period.

        Returns
        -------
        array, shape (m,)
            abs((1 - z^-n Q) / (1 - z^-n (Q - L T))).
        """
        z = np.exp(1j * np.asarray(w, float) * float(L.dt))
        Q, F, T = zero_phase_at(self.q, z), taps_at(self.l, z), _complementary(L, z)
        return np.asarray(np.abs((1 - z**-n * Q) / (1 - z**-n * (Q - F * T))))


def repetitive_filters(
    loops: Sequence[Any], cutoff: float, gain: float = 0.3, n_q: int = 9, n_l: int = 40
) -> RepetitiveFilters:
    """Design the filters Q and L for several loops, for example the nominal loop and its worst-case parameter sets.

    Q is a windowed low-pass. At each frequency, L is the product of `gain`, Q and the common least-squares inverse sum
    conj(T) / sum abs(T)^2 of all loops. L is then truncated to its number of taps.

    Parameters
    ----------
    loops : sequence of control.TransferFunction or control.StateSpace
        Open loops with a common step. The closed loops must be stable.
    cutoff : float
        Upper frequency of learning (Hz).
    gain : float
        Fraction of the error that is corrected in each period.
    n_q, n_l : int
        Number of taps of Q and L on each side of the middle tap.

    Returns
    -------
    RepetitiveFilters

    Raises
    ------
    InputError
        There is no loop, or the cutoff is above half the sampling frequency.
    """
    if not loops:
        raise InputError("The loops must be at least one. Got none.")
    z = np.exp(1j * filter_angles())
    return learning_filters(np.array([_complementary(L, z) for L in loops]), float(loops[0].dt), cutoff, gain, n_q, n_l)


def filter_angles() -> Array:
    """Return the angles omega h of the responses for `learning_filters`, shape (POINTS / 2 + 1,)."""
    angles = 2 * np.pi * np.arange(POINTS // 2 + 1) / POINTS
    angles[0] = 2 * np.pi * 1e-3 / POINTS  # not 0, because integrators have a pole there
    return angles


def learning_filters(
    T: Array,
    h: float,
    cutoff: float,
    gain: float = 0.3,
    n_q: int = 9,
    n_l: int = 40,
    rest: float = 1.0,
    floor: float = 0.0,
) -> RepetitiveFilters:
    """Design the filters Q and L from frequency responses, by the method of `repetitive_filters`.

    Parameters
    ----------
    T : array, shape (loops, POINTS / 2 + 1)
        Frequency responses from a correction to the resulting reduction of the error, at `filter_angles`.
    h : float
        Step (s).
    cutoff, gain, n_q, n_l
        See `repetitive_filters`.
    rest : float
        Value of Q at frequency 0. If it is below 1, corrections that have no effect on the error decay, for example a
        constant correction in front of an integrator.
    floor : float
        Regularisation: this fraction of the mean square of the responses below the cutoff is added at each frequency,
        so that frequencies with a small response are not inverted. Trap: without regularisation, a zero of T at one
        frequency, for example due to an integrator, adds a constant to all taps.

    Raises
    ------
    InputError
        The cutoff is above half the sampling frequency.
    """
    # imported here, so that a process for a foreign FMU does not wait for the import
    from scipy.signal import firwin
    from scipy.signal.windows import tukey

    if not 0 < cutoff < 0.5 / h:
        raise InputError(f"The cutoff must be a float in (0, {0.5 / h:g}) Hz. Got {cutoff:g} instead.")
    z = np.exp(1j * filter_angles())
    taps = rest * firwin(2 * n_q + 1, cutoff, fs=1 / h)[n_q:]
    Q = zero_phase_at(taps, z)
    power = (np.abs(T) ** 2).sum(0)
    ideal = gain * Q * T.conj().sum(0) / (power + floor * power[filter_angles() < 2 * np.pi * cutoff * h].mean())
    ideal[[0, -1]] = ideal[[0, -1]].real
    past = np.fft.irfft(ideal, POINTS)  # tap i is the weight of the error i steps ago
    learning = past[-np.arange(-n_l, n_l + 1)] * tukey(2 * n_l + 3, EDGE)[1:-1]
    left = np.abs(Q - taps_at(learning, z) * T).max(axis=1)
    return RepetitiveFilters(taps, learning, tuple(left.tolist()))


def _complementary(L: Any, z: Any) -> Any:
    value = response(L, z)
    return value / (1 + value)


def zero_phase_at(q: Array, z: Any) -> Any:
    """Return the filter Q at z from its taps."""
    return q[0] + sum(v * (z**j + z**-j) for j, v in enumerate(q[1:], 1))


def taps_at(taps: Array, z: Any) -> Any:
    """Return the learning filter L at z from its taps."""
    ahead = len(taps) // 2
    return np.polyval(taps[::-1], z) * z**-ahead


@dataclass(frozen=True)
class PeriodMemory:
    """Update law of a memory of one period, w = z^-n (Q w + L e)."""

    n: int  # number of steps in a period
    # taps of Q and L, from the oldest step to the same number of steps ahead, shapes (2 n_q + 1,), (2 n_l + 1,)
    q: Array
    l: Array  # noqa: E741
    # whether the memory changes only at the end of a period. Then there is no feedback through the memory within a
    # period.
    lifted: bool

    def factor(self, angles: Array, error: Complex) -> Complex:
        """Return Q + L E, the factor between the corrections of two successive periods.

        Parameters
        ----------
        angles : array, shape (m,)
            Angles omega h.
        error : array, shape (m,)
            Response E = -T from w to e.
        """
        z = np.exp(1j * angles)
        return np.asarray(taps_at(self.q, z) + taps_at(self.l, z) * error)

    def response(self, angles: Array) -> Complex:
        """Return the frequency response from e to w, or 0 if the memory changes only at the end of a period."""
        if self.lifted:
            return np.zeros(len(angles), complex)
        z = np.exp(1j * angles)
        late = z**-self.n
        return np.asarray(late * taps_at(self.l, z) / (1 - late * taps_at(self.q, z)))


def iterative_learning(node: Node) -> PeriodMemory:
    """Return the update law w <- Q (w + gain e) of a block `iterative_learning`.

    The error e is that of the sample `lead` steps later.
    """
    gain, lead, smooth = (float(node.value(name)[0]) for name in ("gain", "lead", "smooth"))
    n = node.dims["n"]
    q = np.array([smooth, 1 - 2 * smooth, smooth])
    ahead = round(lead) % n
    learnt = np.zeros(2 * (ahead + 1) + 1)
    learnt[2 * ahead : 2 * ahead + 3] = gain * q
    return PeriodMemory(n, q, learnt, lifted=True)


def repetitive(node: Node) -> PeriodMemory:
    """Return the update law of a block `repetitive`."""
    q = node.value("q")
    return PeriodMemory(node.dims["n"], np.concatenate([q[:0:-1], q]), node.value("l"), lifted=False)


LAWS: dict[str, tuple[Callable[[Node], PeriodMemory], str, str]] = {
    "iterative_learning": (iterative_learning, "u_ff", "u"),
    "repetitive": (repetitive, "y_d", "r"),
}
"""Block: its law, the input to which it adds its corrections, and the output with them."""


def cut_memories(graph: Graph) -> tuple[Graph, tuple[PeriodMemory, ...]]:
    """Remove the period memories from a graph. The order of the other blocks does not change.

    Returns
    -------
    graph : Graph
        Graph without memories. Its last inputs are the corrections w, and its last outputs are the errors e = y_d - y
        of the memories.
    memories : tuple of PeriodMemory
    """
    found = [n for n in graph.nodes if n.type in LAWS]
    if not found:
        return graph, ()
    blocks: list[Node] = []
    to: dict[str, list[str]] = {}
    source: dict[str, str] = {}
    for n in graph.nodes:
        if n.type not in LAWS:
            blocks.append(n)
            continue
        _, base, corrected = LAWS[n.type]
        added, error = f"{n.name}_added", f"{n.name}_error"
        blocks.append(Node(added, "sum", {"n": 2}, {"k": [1.0, 1.0]}))
        blocks.append(Node(error, "sum", {"n": 2}, {"k": [1.0, -1.0]}))
        to |= {f"{n.name}.{v.name}": [] for v in n.block.of("input")}
        to[f"{n.name}.{base}"].append(f"{added}.u[1]")
        to[f"{n.name}.y_d"].append(f"{error}.u[1]")
        to[f"{n.name}.y"].append(f"{error}.u[2]")
        source[f"{n.name}.{corrected}"] = f"{added}.y"
    wires = [(source.get(a, a), end) for a, b in graph.wires for end in to.get(b, [b])]
    inputs = [Input(i.name, tuple(e for end in i.to for e in to.get(end, [end]))) for i in graph.inputs]
    outputs = [Output(o.name, source.get(o.source, o.source)) for o in graph.outputs]
    inputs = [i for i in inputs if i.to] + [Input(f"{n.name}_w", (f"{n.name}_added.u[2]",)) for n in found]
    outputs = outputs + [Output(f"{n.name}_e", f"{n.name}_error.y") for n in found]
    if any(o.source.partition(".")[0] in {n.name for n in found} for o in outputs):
        raise InputError("The output of a memory of a period must be its corrected signal. Got another one.")
    laws = tuple(LAWS[n.type][0](n) for n in found)
    return Graph(blocks, wires, inputs, outputs, sort=False), laws
