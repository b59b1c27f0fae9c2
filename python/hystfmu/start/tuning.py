"""Gains of a PI controller in front of an inverse: the largest integral gain that every corner carries.

The loop is L(z) = slope K(z) G(z): G are the dynamics behind the hysteresis with static gain 1, held and late, and the
slope is what an imperfect inverse leaves of the hysteresis.

Source: Astrom, Panagopoulos & Hagglund 1998, Automatica 34(5) 585-601: the largest integral gain under a bound on the
peak of the sensitivity rejects disturbances best.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.design.delays import StateSpace
from hystfmu.design.frequency import beside, grid, response_of
from hystfmu.design.linear import linearise
from hystfmu.design.sector import gain_of
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.scenario.loop.held import held

MS_DB = 6.0  # largest peak of the sensitivity of the nominal loop
SLOPES = (0.68, 1.64)  # of plant over inverse: gain 20 % off and thresholds 10 %
RESERVE = 1.1  # of the largest slope: not the border of stability itself
LATE = (0.0, 0.25, 0.5, 0.75, 1.0)  # steps beyond the delay that the design knows of; a mode may lie between halves
PROPORTIONAL = np.linspace(0.0, 1.2, 25)
HALVINGS = 24
LEAST, MOST = 1e-5, 2.0  # integral gain a step


@dataclass(frozen=True)
class Gains:
    """Gains of a PI controller.

    Attributes
    ----------
    Kp, Ki : float
        Proportional gain, and integral gain (1/s); the output of the plant over the wanted one has slope 1.
    Ms_db : float
        Peak of the sensitivity for slope 1 and the known delay (dB).
    """

    Kp: float
    Ki: float
    Ms_db: float


def tune(dynamics: Sequence[Sequence[Node]], h: float, delay: float) -> Gains:
    """Find the gains.

    Parameters
    ----------
    dynamics : sequence of sequence of Node
        Transfer functions in series, of the model first, then of the corners; none for a static plant.
    h : float
        Step (s).
    delay : float
        Steps of delay between the controller and the dynamics, beside the hold.

    Raises
    ------
    InputError
        No integral gain is stable at all corners.
    """
    plants = [in_series(nodes) for nodes in dynamics]
    behind = held(plants[0], h, delay)
    z = np.exp(1j * np.union1d(grid(), beside(np.linalg.eigvals(behind[0].astype(complex)), grid())))
    nominal = response_of(behind, z)[:, 0, 0]
    late = [held(p, h, delay + more) for p in plants for more in LATE]
    best: tuple[float, float] | None = None

    def allowed(Kp: float, ki: float) -> bool:
        K = Kp + ki * z / (z - 1)
        if np.abs(1 + K * nominal).min() < 10 ** (-MS_DB / 20):
            return False
        return all(_stable(G, slope, Kp, ki) for G in late for slope in (SLOPES[0], RESERVE * SLOPES[1]))

    for Kp in PROPORTIONAL:
        lowest = LEAST if best is None else 1.001 * best[1]
        if not allowed(Kp, lowest):
            continue
        low, high = lowest, MOST
        for _ in range(HALVINGS):
            middle = np.sqrt(low * high)
            low, high = (middle, high) if allowed(Kp, middle) else (low, middle)
        best = float(Kp), float(low)
    if best is None:
        raise InputError("An integral gain must be stable at all corners. Got none: the dynamics differ too much.")
    Kp, Ki = float(f"{best[0]:.3g}"), _rounded_down(best[1] / h)
    K = Kp + Ki * h * z / (z - 1)
    return Gains(Kp, Ki, float(-20 * np.log10(np.abs(1 + K * nominal).min())))


def _rounded_down(x: float) -> float:
    """Return a positive number with three digits that is not larger: what the search allowed allows no more."""
    below = float(f"{x:.3g}")
    unit = 10.0 ** (math.floor(math.log10(x)) - 2)
    return below if below <= x else float(f"{below - unit:.3g}")


def _stable(G: StateSpace, slope: float, Kp: float, ki: float) -> bool:
    """Whether the poles of the closed loop lie within the unit circle; ki is the integral gain a step."""
    A, B, C, _ = G
    closed = np.block([[A - slope * (Kp + ki) * B @ C, slope * ki * B], [-C, np.eye(1)]])
    return bool(np.abs(np.linalg.eigvals(closed)).max() < 1)


def in_series(nodes: Sequence[Node]) -> StateSpace:
    """Return transfer functions in series as a state space with static gain 1."""
    gain = Node("gain", "scaling", {"n": 1}, {"gain": 1 / float(np.prod([gain_of(n) for n in nodes]))})
    chain = [gain, *(Node(f"part{i}", n.type, n.dims, n.values) for i, n in enumerate(nodes))]
    wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(chain)]
    return linearise(Graph(chain, wires, [Input("u", ("gain.u",))], [Output("y", f"{chain[-1].name}.y")]))
