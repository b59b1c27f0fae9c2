"""Open loop of a sampled controller, delays and plant, and its stability margins.

The plant is discretised exactly for the held command.  The command of a sample acts from that sample on, as in the
scenarios (the plant steps first).  Hysteresis enters as a gain, given by `describing_function`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.design.delays import StateSpace
from hystfmu.design.linear import python_control, to_control
from hystfmu.graph import Graph, Node
from hystfmu.model import Model

BISECTIONS = 40  # of an interval between two frequencies
POINTS = 4000  # frequencies, four decades below half the sampling frequency


@dataclass(frozen=True)
class Margins:
    """Stability margins of a loop; a margin that no frequency limits is infinite.

    Attributes
    ----------
    stable : bool
        Whether the closed loop with negative feedback is stable.
    gain_db : float
        Gain margin (dB).
    phase_deg : float
        Phase margin (degrees).
    delay_s, delay_steps : float
        Delay margin (s), and the same in steps.
    modulus : float
        Modulus margin: smallest abs(1 + L), 1 / peak of the sensitivity.
    crossover_hz : float
        Crossover frequency, abs(L) = 1, with the smallest phase margin (Hz).
    bandwidth_hz : float
        Frequency up to which the sensitivity stays below -3 dB (Hz).
    """

    stable: bool
    gain_db: float
    phase_deg: float
    delay_s: float
    delay_steps: float
    modulus: float
    crossover_hz: float
    bandwidth_hz: float

    @property
    def Ms_db(self) -> float:
        """Peak of the sensitivity abs(1 / (1 + L)) (dB)."""
        return float(-20 * np.log10(self.modulus))

    def __str__(self) -> str:
        state = "stable" if self.stable else "UNSTABLE"
        return (
            f"{state}: gain margin {self.gain_db:.1f} dB, phase margin {self.phase_deg:.1f} deg at "
            f"{self.crossover_hz:.4g} Hz, delay margin {1e3 * self.delay_s:.3g} ms ({self.delay_steps:.2f} steps), "
            f"modulus margin {self.modulus:.2f} (Ms {self.Ms_db:.1f} dB), bandwidth {self.bandwidth_hz:.4g} Hz"
        )


def loop(plant: Node | Graph | Model, controller: Node, h: float, *, delay: int = 0, gain: float = 1.0) -> Any:
    """Build the open loop L(z) of controller, delay and plant, for negative feedback.

    Parameters
    ----------
    plant : Node, Graph or Model
        Linear part, as `to_control` takes it.
    controller : Node
        `pid`, `lead_lag`, `sliding_mode` or `super_twisting`.
    h : float
        Step (s).
    delay : int
        Delay beyond the hold, in steps.
    gain : float
        Gain in the loop: describing function of the hysteresis, or a gain error of the plant.

    Returns
    -------
    control.TransferFunction
        Open loop with step h.

    Raises
    ------
    InputError
        The delay is negative, or a block has no linear model.
    """
    if delay < 0:
        raise InputError(f"The delay must be an int in [0, inf). Got {delay} instead.")
    control = python_control()
    late = control.tf([1.0], [1.0] + [0.0] * delay, h)
    return gain * to_control(controller, h) * late * control.tf(to_control(plant, h))


@dataclass(frozen=True)
class Response:
    """An open loop that is known by its frequency response.

    Attributes
    ----------
    at : callable
        L(z) of an array of points.
    dt : float
        Step (s).
    stable : bool
        Whether the loop is stable when closed.
    w : array, shape (m,)
        Frequencies (rad/s) that resolve it.
    """

    at: Callable[[NDArray[np.complex128]], NDArray[np.complex128]]
    dt: float
    stable: bool
    w: Array

    def __call__(self, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Return L(z)."""
        return self.at(z)


def margins(L: Any) -> Margins:
    """Compute the stability margins of a sampled open loop.

    Parameters
    ----------
    L : control.TransferFunction or Response
        Open loop with a step, as `loop` returns it.

    Returns
    -------
    Margins
    """
    h = float(L.dt)

    def at(w: Array) -> NDArray[np.complex128]:
        return response(L, np.exp(1j * w * h))

    w = np.geomspace(1e-4, 1.0, POINTS) * np.pi / h
    if isinstance(L, Response):
        stable, w = L.stable, np.union1d(w, L.w)
    else:
        stable = bool((np.abs(python_control().feedback(L, 1).poles()) < 1).all())
    values = at(w)
    crossing = _roots(lambda w: np.abs(at(w)) - 1, w, np.abs(values) - 1)
    # phase margin at each crossover: as the delay grows, the crossover with the least phase / frequency is lost first
    left = np.mod(np.angle(at(crossing)) + np.pi, 2 * np.pi)
    delay = (left / crossing).min(initial=np.inf)
    # phase crossover at 180 degrees; L is real at z = -1, the end of the half circle
    reversed_at = np.append(_roots(lambda w: at(w).imag, w, values.imag), np.pi / h)
    real = at(reversed_at).real
    factors = -1 / real[(real > -1) & (real < 0)]
    signed = np.abs(_wrap(left))
    phase, w_c = min(zip(signed, crossing, strict=True), default=(np.inf, np.inf))
    large = np.flatnonzero(np.abs(1 + values) < np.sqrt(2))
    return Margins(
        stable,
        float(20 * np.log10(factors.min(initial=np.inf))),
        float(np.degrees(phase)),
        float(delay),
        float(delay / h),
        float(np.abs(1 + values).min()),
        float(w_c / (2 * np.pi)),
        float(w[large[0]] / (2 * np.pi)) * bool(large[0]) if len(large) else np.inf,
    )


def response(L: Any, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return L(z), shape (n,); a state space is solved for all points at once."""
    if not hasattr(L, "A"):
        return np.asarray(L(z))
    return response_matrix((L.A, L.B, L.C, L.D), z)[:, 0, 0]


def response_matrix(system: StateSpace, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return the frequency response of a state space, shape (n, p, m)."""
    A, B, C, D = (np.asarray(m) for m in system)
    if not len(A):
        return np.tile(D.astype(complex), (len(z), 1, 1))
    x = np.linalg.solve(z[:, None, None] * np.eye(len(A)) - A, B.astype(complex)[None])
    return np.asarray(C @ x + D)


def _roots(f: Callable[[Array], Array], w: Array, values: Array) -> Array:
    """Return where f changes its sign, all intervals of the grid w (with f = values) at once by bisection."""
    k = np.flatnonzero(values[:-1] * values[1:] < 0)
    a, b, sign = w[k], w[k + 1], np.sign(values[k])
    for _ in range(BISECTIONS if len(k) else 0):
        middle = 0.5 * (a + b)
        before = np.sign(f(middle)) == sign
        a, b = np.where(before, middle, a), np.where(before, b, middle)
    return 0.5 * (a + b)


def _wrap(phase: Array) -> Array:
    """Wrap a phase into -pi .. pi: a loop may also approach instability from the other side."""
    return (phase + np.pi) % (2 * np.pi) - np.pi
