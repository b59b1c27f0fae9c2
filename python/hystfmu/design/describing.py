"""Describing function of a block or model: the gain of the first harmonic, measured on the block itself.

N(A) = (b_1 + j a_1) / A, with y = a_1 cos + b_1 sin + ... for u = A sin: Gelb & Vander Velde, Multiple-Input Describing
Functions, 1968, section 2.2.  For a static block the frequency does not matter; for one with dynamics it is given.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Node
from hystfmu.model import Model


@dataclass(frozen=True)
class DescribingFunction:
    """`N` over amplitude, with what it leaves out.

    amplitude : of u, shape (n,), unit of u;  N : complex gain of the first harmonic, unit of y / unit of u
    distortion : RMS of the higher harmonics / RMS of the first, 0..1: how far a describing function can be trusted
    """

    amplitude: Array
    N: NDArray[np.complex128]
    distortion: Array

    @property
    def gain(self) -> Array:
        """abs(N), in the shape of N."""
        return np.abs(self.N)

    @property
    def phase(self) -> Array:
        """Of N in degrees, in its shape; negative: the output lags."""
        return np.degrees(np.angle(self.N))


def describing_function(
    part: Node | Graph | Model,
    amplitudes: Sequence[float] | Array,
    *,
    frequency: float = 1.0,
    samples: int = 4096,
    cycles: int = 2,
) -> DescribingFunction:
    """Describing function from the loops of a part with one input and one output.

    Parameters
    ----------
    part : Node, Graph or Model
    amplitudes : array of float, shape (n,)
        Of the input, its unit, greater than 0.
    frequency : float
        Of the sine (Hz); matters for parts with dynamics only.
    samples : int
        Per cycle; the first harmonic of a static part is exact to about (1/samples)^2.
    cycles : int
        Cycles before the one that is measured, at least 1: the memory must have settled.

    Raises
    ------
    InputError
        More than one input or output, an amplitude, frequency or count out of range.
    """
    graph = part.graph if isinstance(part, Model) else part if isinstance(part, Graph) else Graph.single(part)
    if graph.n_inputs != 1 or graph.n_outputs != 1:
        raise InputError(
            f"a describing function needs one input and one output; got {graph.n_inputs} and {graph.n_outputs}"
        )
    a = np.atleast_1d(np.asarray(amplitudes, dtype=np.float64))
    if not (np.isfinite(a).all() and (a > 0).all()):
        raise InputError(f"amplitudes: must be greater than 0; got {a.tolist()}")
    if samples < 16 or cycles < 1:
        raise InputError(f"samples, cycles: at least 16 and 1; got {samples}, {cycles}")
    if not (np.isfinite(frequency) and frequency > 0):
        raise InputError(f"frequency: must be greater than 0; got {frequency!r}")
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
