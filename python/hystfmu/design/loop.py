"""Open loop of a sampled controller around a plant with its delays, and how far it is from instability.

The plant is discretised exactly for the held command; the command of one sample acts from that sample on, as in the
scenarios (the plant steps first).  Hysteresis enters as a gain: `describing_function` says which.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.design.linear import python_control, to_control
from hystfmu.graph import Graph, Node
from hystfmu.model import Model


@dataclass(frozen=True)
class Margins:
    """Distances of a loop from instability.

    stable : of the closed loop with negative feedback
    gain_db : factor on the loop gain until instability (dB);  phase_deg : phase until instability (degrees)
    delay_s : additional delay until instability (s);  delay_steps : the same in steps
    modulus : smallest abs(1 + L): 1 / peak of the sensitivity
    crossover_hz : where abs(L) = 1, with the smallest phase margin (Hz)

    A margin that no frequency limits is infinite.
    """

    stable: bool
    gain_db: float
    phase_deg: float
    delay_s: float
    delay_steps: float
    modulus: float
    crossover_hz: float

    def __str__(self) -> str:
        state = "stable" if self.stable else "UNSTABLE"
        return (
            f"{state}: gain margin {self.gain_db:.1f} dB, phase margin {self.phase_deg:.1f} deg at "
            f"{self.crossover_hz:.4g} Hz, delay margin {1e3 * self.delay_s:.3g} ms ({self.delay_steps:.2f} steps), "
            f"modulus margin {self.modulus:.2f}"
        )


def loop(plant: Node | Graph | Model, controller: Node, h: float, *, delay: int = 0, gain: float = 1.0) -> Any:
    """Open loop L(z) of controller, delay and plant.

    Parameters
    ----------
    plant : Node, Graph or Model
        Linear part, as `to_control` takes it.
    controller : Node
        `pid`, `lead_lag`, `sliding_mode` or `super_twisting`.
    h : float
        Step (s).
    delay : int
        Steps of delay beyond the hold, known or feared.
    gain : float
        Of what is between: hysteresis by its describing function, a wrong gain of the plant.

    Returns
    -------
    control.TransferFunction
        With step h; negative feedback.

    Raises
    ------
    InputError
        A negative delay, or a block without a linear model.
    """
    if delay < 0:
        raise InputError(f"delay: must be at least 0; got {delay}")
    control = python_control()
    late = control.tf([1.0], [1.0] + [0.0] * delay, h)
    return gain * to_control(controller, h) * late * control.tf(to_control(plant, h))


def margins(L: Any) -> Margins:
    """Margins of a sampled open loop.

    Parameters
    ----------
    L : control.TransferFunction
        With a step (`loop` makes it).
    """
    h = float(L.dt)

    def at(w: float) -> complex:
        return complex(L(np.exp(1j * w * h)))

    poles = python_control().feedback(L, 1).poles()
    w = np.geomspace(1e-4, 1.0, 20_000) * np.pi / h
    values = L(np.exp(1j * w * h))
    crossing = [_root(lambda w: abs(at(w)) - 1, *w[i : i + 2]) for i in _changes(np.abs(values) - 1)]
    # the phase that is left at each of them: under a growing delay the one with the least phase / frequency goes first
    left = [float(np.mod(np.angle(at(w_c)) + np.pi, 2 * np.pi)) for w_c in crossing]
    delay = min((phase / w_c for phase, w_c in zip(left, crossing, strict=True)), default=np.inf)
    # phase through 180 degrees; z = -1 is the end of the circle, where L is real
    reversed_at = [_root(lambda w: at(w).imag, *w[i : i + 2]) for i in _changes(values.imag)] + [np.pi / h]
    real = [at(w_r).real for w_r in reversed_at]
    factors = [-1 / r for r in real if -1 < r < 0]
    signed = [(abs(_wrap(phase)), w_c) for phase, w_c in zip(left, crossing, strict=True)]
    phase, w_c = min(signed, default=(np.inf, np.inf))
    return Margins(
        bool((np.abs(poles) < 1).all()),
        float(20 * np.log10(min(factors, default=np.inf))),
        float(np.degrees(phase)),
        float(delay),
        float(delay / h),
        float(np.abs(1 + values).min()),
        float(w_c / (2 * np.pi)),
    )


def _changes(f: Array) -> NDArray[np.intp]:
    """Places k where f changes its sign from k to k + 1."""
    return np.flatnonzero(f[:-1] * f[1:] < 0)


def _root(f: Callable[[float], float], a: float, b: float) -> float:
    from scipy.optimize import brentq

    return float(brentq(f, a, b, xtol=1e-12 * b))


def _wrap(phase: float) -> float:
    """Into -pi .. pi: a loop may also be near instability from the other side."""
    return (phase + np.pi) % (2 * np.pi) - np.pi
