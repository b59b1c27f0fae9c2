"""Describing function of a block or model: gain of the first harmonic in a simulation.

N(A) = (b_1 + j a_1) / A, with y = a_1 cos + b_1 sin + ... for u = A sin (Gelb & Vander Velde, Multiple-Input Describing
Functions, 1968, section 2.2).  N of a static block does not depend on frequency. For a block with dynamics, state the
frequency.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.base.calls import checked
from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Node
from hystfmu.model import Model


@dataclass(frozen=True)
class DescribingFunction:
    """Describing function over amplitude.

    Attributes
    ----------
    amplitude : array, shape (n,)
        Amplitude of u, in the unit of measure of u.
    N : complex array, shape (n,)
        Gain of the first harmonic, y per u.
    distortion : array, shape (n,)
        Ratio of the RMS of the higher harmonics to the RMS of the first harmonic. If this ratio is small, the
        describing function is reliable.
    """

    amplitude: Array
    N: NDArray[np.complex128]
    distortion: Array

    @property
    def gain(self) -> Array:
        """abs(N), shape (n,)."""
        return np.abs(self.N)

    @property
    def phase(self) -> Array:
        """Phase of N (degrees), shape (n,); negative if the output lags."""
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
    """Compute the describing function of a part with one input and one output.

    Parameters
    ----------
    part : Node, Graph or Model
        Part to simulate.
    amplitudes : array, shape (n,)
        Input amplitudes, greater than 0, in the unit of measure of u.
    frequency : float
        Frequency of the sine (Hz). It affects only parts with dynamics.
    samples : int
        Samples per cycle; the first harmonic of a static part is exact to about (1/samples)^2.
    cycles : int
        Number of cycles before the evaluated cycle, at least 1, so that the memory settles.

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
        harmonics = np.fft.rfft(np.roll(y, 1)) / (samples / 2)  # the last cycle begins one sample after a full one
        N[i] = 1j * harmonics[1] / amplitude  # u = A sin is -jA in the first harmonic
        first = np.abs(harmonics[1])
        higher = np.sqrt((np.abs(harmonics[2:]) ** 2).sum())
        distortion[i] = higher / first if first > 0 else (0.0 if higher == 0 else np.inf)
    return DescribingFunction(a, N, distortion)
