"""Open loop of a sampled controller, delays and plant, and its stability margins.

All parts are state spaces. Trap: with several lags and integrators near z = 1, rounding changes the roots of
polynomials; with creep it also changes the response. Hysteresis is a gain, for example from `describing_function`.

A gain at which the Nyquist curve passes through -1 is not always a limit, because a loop may stay stable although the
curve crosses -1. A conditionally stable loop has a lower and an upper limit of the gain.

Frequency responses are computed on a grid up to half the sampling frequency; angles are omega h. Many cases of a
scenario have the same controller and the same plant. Therefore the frequency response of each state space is computed
only once and stored.
"""

import functools
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from hystfmu.base import Array, Complex, InputError, checked
from hystfmu.design.delays import StateSpace, shift_registers
from hystfmu.design.linear import feedthrough, python_control, to_control
from hystfmu.graph import Graph, Node
from hystfmu.model import Model

POINTS = 4000  # number of frequencies in the four decades below half the sampling frequency
PER_LINE = 40  # number of points for each harmonic of a memory of one period
HALVINGS = 36  # number of bisection steps in an interval of the grid, close to the rounding error
KEPT = 64  # number of cached responses
NARROW = 8  # a resonance gets additional points if its half-width is below this number of grid intervals
INTEGRATOR = 1e-7  # a pole at a smaller distance from z = 1 is a pole at 1 with rounding error
BELOW, PER_SLOW = 0.05, 300  # points are added down to this multiple of the slowest pole; number of these points
# distances of points from a resonance, in half-widths
BESIDE = np.sinh(np.linspace(-np.arcsinh(30.0), np.arcsinh(30.0), 61))


@functools.lru_cache(maxsize=8)
def grid(period: int = 0) -> Array:
    """Return a grid of angles omega h in (0, pi], shape (m,).

    If `period` is above 0, the grid resolves the harmonics of a period memory with `period` steps.
    """
    angles = np.geomspace(1e-4, 1.0, POINTS) * np.pi
    if period:
        angles = np.union1d(angles, np.linspace(0, np.pi, period * PER_LINE // 2 + 1)[1:])
    angles.setflags(write=False)
    return angles


def beside(poles: Complex, angles: Array) -> Array:
    """Return additional angles, shape (k,), near lightly damped poles for which the grid `angles` is too coarse.

    Trap: two crossings of abs(L) = 1 on both sides of a lightly damped mode may lie between two points of the grid. The
    margins at these crossings would be missed. The poles of creep may have angles below the grid. Therefore angles down
    to these poles are added.
    """
    at, width = np.abs(np.angle(poles)), np.abs(1 - np.abs(poles))
    spacing = np.maximum(at, angles[0]) * (angles[1] / angles[0] - 1)
    narrow = width < NARROW * spacing
    found = (at[narrow, None] + width[narrow, None] * BESIDE).ravel()
    slow = np.abs(1 - poles)
    slow = slow[(slow > INTEGRATOR) & (slow < angles[0])]
    if len(slow):
        found = np.append(found, np.geomspace(BELOW * slow.min(), angles[0], PER_SLOW))
    return np.asarray(np.unique(found[(found > 0) & (found <= np.pi)]))


def response_of(system: StateSpace, z: Complex) -> Complex:
    """Return C (z - A)^-1 B + D.

    Parameters
    ----------
    system : (A, B, C, D), shapes (n, n), (n, q), (p, n), (p, q)
        State space x[k+1] = A x[k] + B u[k], y[k] = C x[k] + D u[k].
    z : array, shape (m,)

    Returns
    -------
    array, shape (m, p, q)
    """
    A, B, C, D = system
    if not len(A):
        return np.repeat(D[None].astype(complex), len(z), 0)
    x = np.linalg.solve(z[:, None, None] * np.eye(len(A)) - A, B.astype(complex)[None])
    return np.asarray(C @ x + D)


def on_grid(system: StateSpace, period: int = 0) -> Complex:
    """Return the frequency response of a state space on `grid(period)`. It is computed once for equal state spaces."""
    return _on_grid(tuple((m.shape, np.ascontiguousarray(m).tobytes()) for m in system), period)


@functools.lru_cache(maxsize=KEPT)
def _on_grid(content: tuple[tuple[tuple[int, ...], bytes], ...], period: int) -> Complex:
    A, B, C, D = (np.frombuffer(data).reshape(shape) for shape, data in content)
    return response_of((A, B, C, D), np.exp(1j * grid(period)))


def roots(f: Callable[[Array], Array], angles: Array, values: Array) -> Array:
    """Compute by bisection the angles at which f changes its sign, at most one in each interval of a grid.

    `values` is f on the grid of `angles`, shape (m,).
    """
    at = np.flatnonzero(values[:-1] * values[1:] < 0)
    low, high, sign = angles[at], angles[at + 1], np.sign(values[at])
    for _ in range(HALVINGS if len(at) else 0):
        middle = (low + high) / 2
        same = np.sign(f(middle)) == sign
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.asarray((low + high) / 2)


def least(f: Callable[[Array], Array], angles: Array, values: Array) -> float:
    """Return the smallest value of a function f of the angle.

    `values` is f on the grid of `angles`, shape (m,). Finer grids between the neighbours of the smallest value refine
    the result.
    """
    k = int(np.argmin(values))
    a, b = angles[max(k - 1, 0)], angles[min(k + 1, len(angles) - 1)]
    found = float(values[k])
    for _ in range(3):  # each pass narrows the interval by a factor of 16
        inner = np.linspace(a, b, 33)
        here = f(inner)
        j = int(np.argmin(here))
        a, b = inner[max(j - 1, 0)], inner[min(j + 1, 32)]
        found = min(found, float(here[j]))
    return found


CONTROLLERS, HOLD = "controllers", "hold"  # name of a family of blocks, and name of a parameter


@dataclass(frozen=True)
class Margins:
    """Stability margins of a loop. A margin is infinite if no change makes the loop unstable.

    The margins of an unstable loop are NaN, and its modulus margin is 0.

    Attributes
    ----------
    stable : bool
        Whether the closed loop with negative feedback is stable.
    gain_db : float
        Upper gain margin (dB): allowed increase of the gain.
    gain_low_db : float
        Lower gain margin (dB), negative: allowed decrease of the gain; -inf if the loop stays stable.
    phase_deg : float
        Phase margin (degrees).
    delay_s, delay_steps : float
        Delay margin in s, and in steps.
    modulus : float
        Modulus margin: smallest abs(1 + L), which is 1 / peak of the sensitivity.
    crossover_hz : float
        Crossover frequency (Hz), at which abs(L) = 1. If there are several, this is the frequency with the smallest
        phase margin.
    bandwidth_hz : float
        Frequency up to which the sensitivity stays below -3 dB (Hz).
    """

    stable: bool
    gain_db: float
    gain_low_db: float
    phase_deg: float
    delay_s: float
    delay_steps: float
    modulus: float
    crossover_hz: float
    bandwidth_hz: float

    @property
    def Ms_db(self) -> float:
        """Peak of the sensitivity abs(1 / (1 + L)) (dB); infinite for an unstable loop."""
        return float(-20 * np.log10(self.modulus)) if self.modulus > 0 else np.inf

    @property
    def conditional(self) -> bool:
        """True if the loop is conditionally stable, that is, if it becomes unstable when the gain decreases."""
        return self.stable and self.gain_low_db > -np.inf

    def __str__(self) -> str:
        if not self.stable:
            return "unstable: no margins"
        state, gain = "stable", f"gain margin {self.gain_db:.1f} dB"
        if self.conditional:
            state, gain = "conditionally stable", f"gain margins {self.gain_low_db:.1f} and {self.gain_db:.1f} dB"
        return (
            f"{state}: {gain}, phase margin {self.phase_deg:.1f} deg at "
            f"{self.crossover_hz:.4g} Hz, delay margin {1e3 * self.delay_s:.3g} ms ({self.delay_steps:.2f} steps), "
            f"modulus margin {self.modulus:.2f} (Ms {self.Ms_db:.1f} dB), bandwidth {self.bandwidth_hz:.4g} Hz"
        )


@checked
def loop(plant: Node | Graph | Model, controller: Node, h: float, *, delay: int = 0, gain: float = 1.0) -> Any:
    """Build the open loop L(z) of controller, delay and plant, for negative feedback.

    Parameters
    ----------
    plant : Node, Graph or Model
        Linear part, see `to_control`.
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
    control.StateSpace
        Open loop with step h. As in the scenarios, the plant is the first unit in the order, so the command that is
        computed from a sample acts on the plant in the next step. Therefore direct feed-through of the plant, for
        example of creep, uses the command of the previous step.

    Raises
    ------
    InputError
        The delay is negative, a block has no linear model, or the plant has several inputs or outputs.
    """
    if delay < 0:
        raise InputError(f"The delay must be an int in [0, inf). Got {delay} instead.")
    control = python_control()
    late = control.ss(*shift_registers((delay,)), h) if delay else 1.0
    return gain * (_behind_hold(plant, h) * late * to_control(controller, h))


def _behind_hold(plant: Node | Graph | Model, h: float) -> Any:
    """Return the sampled plant for a loop in which a sample is taken before the command of its step is applied."""
    control = python_control()
    G, step = to_control(plant, h), control.ss(*shift_registers((1,)), h)
    if (G.noutputs, G.ninputs) != (1, 1):
        raise InputError(
            f"The plant of a loop must have one input and one output. Got {G.ninputs} and {G.noutputs} instead."
        )
    if isinstance(plant, Node):
        if plant.block.family == CONTROLLERS:
            return G
        if any(v.name == HOLD for v in plant.block.parameters) and plant.value(HOLD)[0]:
            return G * step  # with this hold, the output of the plant ramps to the command of the previous sample
        plant = Graph.single(plant)
    at_once = feedthrough(plant)
    if not any(m.any() for m in at_once[1:]):
        return G
    if len(at_once[0]):
        return G + control.ss(*at_once, h) * (step - 1.0)
    return control.ss(G.A, G.B, G.C, 0.0, h) + float(at_once[3][0, 0]) * step


def margins(L: Any) -> Margins:
    """Compute the stability margins of a sampled open loop with negative feedback.

    Parameters
    ----------
    L : control.StateSpace or control.TransferFunction
        Open loop with a step, for example from `loop`.

    Returns
    -------
    Margins
    """
    system = python_control().ss(L)
    A, B, C, D = (np.asarray(m) for m in (system.A, system.B, system.C, system.D))

    def poles(gain: float) -> Complex:
        return np.asarray(np.linalg.eigvals(A - gain / (1 + gain * D[0, 0]) * B @ C).astype(complex))

    closed, opened = poles(1.0), np.linalg.eigvals(A).astype(complex)
    angles = np.union1d(grid(), beside(np.append(closed, opened), grid()))
    return margins_of(
        lambda a: response(L, np.exp(1j * a)),
        angles,
        response(L, np.exp(1j * angles)),
        float(L.dt),
        lambda gain: bool((np.abs(poles(gain)) < 1).all()),
    )


def margins_of(
    L: Callable[[Array], Complex], angles: Array, values: Complex, h: float, stable: Callable[[float], bool]
) -> Margins:
    """Compute the margins of a loop from its frequency response.

    Parameters
    ----------
    L : function
        Response of the open loop at angles omega h; argument and result have the shape (k,).
    angles, values : array, shape (m,)
        Grid of angles up to pi, and the response on this grid.
    h : float
        Step (s).
    stable : function
        Function that returns whether the closed loop is stable if the loop gain is multiplied by its argument. The
        response alone does not determine the stability.
    """
    if not stable(1.0):
        nan = np.nan
        return Margins(False, nan, nan, nan, nan, nan, 0.0, nan, nan)
    crossing = roots(lambda a: np.abs(L(a)) - 1, angles, np.abs(values) - 1)
    # phase margin at each crossover: with more delay, the crossover with the least phase / frequency is the first limit
    phases = np.mod(np.angle(L(crossing)) + np.pi, 2 * np.pi) if len(crossing) else crossing
    steps = float(np.min(phases / crossing, initial=np.inf))
    signed = np.abs((phases + np.pi) % (2 * np.pi) - np.pi)  # a curve may approach -1 from both sides
    nearest = int(np.argmin(signed)) if len(signed) else None
    distance = np.abs(1 + values)
    large = np.flatnonzero(distance < np.sqrt(2))
    factors = crossed(L, angles, values)
    return Margins(
        True,
        20 * float(np.log10(first_lost(factors[factors > 1], stable))),
        -20 * float(np.log10(first_lost(1 / factors[factors < 1], lambda f: stable(1 / f)))),
        np.inf if nearest is None else float(np.degrees(signed[nearest])),
        steps * h,
        steps,
        least(lambda a: np.abs(1 + L(a)), angles, distance),
        np.inf if nearest is None else float(crossing[nearest] / (2 * np.pi * h)),
        float(angles[large[0]] / (2 * np.pi * h)) * bool(large[0]) if len(large) else np.inf,
    )


def response(L: Any, z: Complex) -> Complex:
    """Return the response L(z), shape (n,)."""
    if not hasattr(L, "A"):
        return np.asarray(L(z))
    A, B, C, D = (np.asarray(m) for m in (L.A, L.B, L.C, L.D))
    return np.asarray(response_of((A, B, C, D), z)[:, 0, 0])


LARGEST = 1e6  # largest factor of the gain (120 dB). Above it, rounding errors determine the poles.
SAME = 1e-6  # two factors with a smaller relative difference are equal


def crossed(L: Callable[[Array], Complex], angles: Array, values: Complex) -> Array:
    """Return the factors, shape (k,), with which the loop gain must be multiplied so that L passes through -1.

    L is the response of the open loop at angles omega h; `values` is L on the grid of `angles` up to pi, shape (m,).
    """
    at = np.append(roots(lambda a: L(a).imag, angles, values.imag), np.pi)  # L is real at z = -1, and at z = 1
    real = np.append(L(at).real, _static(L, values[0]))
    factors = -1 / real[real < 0]
    return np.asarray(factors[(factors > 1 / LARGEST) & (factors < LARGEST)])


def _static(L: Callable[[Array], Complex], beside: complex) -> Array:
    """Return L at z = 1, shape (1,), or an empty array if L has a pole at z = 1.

    `beside` is L at the smallest angle of the grid.
    """
    with suppress(np.linalg.LinAlgError), np.errstate(all="ignore"):
        found = L(np.zeros(1))
        if abs(found[0] - beside) < 0.5 * abs(beside):
            return np.asarray(found.real)
    return np.zeros(0)


def first_lost(factors: Array, stable: Callable[[float], bool]) -> float:
    """Return the smallest gain factor beyond which a loop is unstable, or infinity if the loop always stays stable.

    `factors`, shape (k,), contains all factors above 1 at which stability may change. `stable` returns whether the loop
    is stable for a factor.
    """
    found = np.sort(factors)
    found = found[np.diff(found, prepend=0.0) > SAME * found]
    # a factor between two neighbours; after the last, twice this factor
    beyond = np.sqrt(found * np.append(found[1:], 4 * found[-1:]))
    return next((float(f) for f, b in zip(found, beyond, strict=True) if not stable(float(b))), float("inf"))
