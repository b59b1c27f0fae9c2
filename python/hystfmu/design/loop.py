"""Open loop of a sampled controller, delays and plant, and its stability margins.

The plant is discretised exactly for the held command.  The command of a sample acts from that sample on, as in the
scenarios (the plant steps first).  Hysteresis enters as a gain, given by `describing_function`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.design.frequency import Complex, beside, grid, least, response_of, roots
from hystfmu.design.linear import python_control, to_control
from hystfmu.graph import Graph, Node
from hystfmu.model import Model


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


def margins(L: Any) -> Margins:
    """Compute the stability margins of a sampled open loop.

    Parameters
    ----------
    L : control.TransferFunction
        Open loop with a step, as `loop` returns it.

    Returns
    -------
    Margins
    """
    poles = python_control().feedback(L, 1).poles()
    angles = np.union1d(grid(), beside(np.append(poles, L.poles()), grid()))
    stable = bool((np.abs(poles) < 1).all())
    return margins_of(
        lambda a: response(L, np.exp(1j * a)), angles, response(L, np.exp(1j * angles)), float(L.dt), stable
    )


def margins_of(L: Callable[[Array], Complex], angles: Array, values: Complex, h: float, stable: bool) -> Margins:
    """Compute the margins of a loop from its frequency response.

    Parameters
    ----------
    L : function
        Response of the open loop at angles omega h, shapes (k,) and (k,).
    angles, values : array, shape (m,)
        Grid up to pi, and the response on it.
    h : float
        Step (s).
    stable : bool
        Whether the closed loop is stable, which a response does not tell.

    Returns
    -------
    Margins
    """
    crossing = roots(lambda a: np.abs(L(a)) - 1, angles, np.abs(values) - 1)
    # phase margin at each crossover: as the delay grows, the crossover with the least phase / frequency is lost first
    phases = np.mod(np.angle(L(crossing)) + np.pi, 2 * np.pi) if len(crossing) else crossing
    steps = float(np.min(phases / crossing, initial=np.inf))
    # phase crossover at 180 degrees; L is real at z = -1, the end of the half circle
    reversed_at = np.append(roots(lambda a: L(a).imag, angles, values.imag), np.pi)
    real = L(reversed_at).real
    factors = -1 / real[(real > -1) & (real < 0)]
    signed = np.abs((phases + np.pi) % (2 * np.pi) - np.pi)  # a loop may also come near from the other side
    nearest = int(np.argmin(signed)) if len(signed) else None
    distance = np.abs(1 + values)
    large = np.flatnonzero(distance < np.sqrt(2))
    return Margins(
        stable,
        float(20 * np.log10(np.min(factors, initial=np.inf))),
        np.inf if nearest is None else float(np.degrees(signed[nearest])),
        steps * h,
        steps,
        least(lambda a: np.abs(1 + L(a)), angles, distance),
        np.inf if nearest is None else float(crossing[nearest] / (2 * np.pi * h)),
        float(angles[large[0]] / (2 * np.pi * h)) * bool(large[0]) if len(large) else np.inf,
    )


def response(L: Any, z: Complex) -> Complex:
    """Return L(z), shape (n,); a state space is solved for all points at once."""
    if not hasattr(L, "A"):
        return np.asarray(L(z))
    A, B, C, D = (np.asarray(m) for m in (L.A, L.B, L.C, L.D))
    return np.asarray(response_of((A, B, C, D), z)[:, 0, 0])
