"""Open loop of a case: frequency response, poles and margins for any incremental gain and delay.

The open loop is L(z) = -slope K(z) G(z). The factor `slope` is the incremental gain of inverse and plant in series. K
is the exact tangent of all units except the plant. G is the dynamics of the plant with static gain 1. G is exact for a
command that is constant or a ramp in each step, with any delay, including fractions of a step. The period memory of a
repetitive or learning controller is represented in K by its frequency response.
"""

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hystfmu.base import Array, Complex, InputError
from hystfmu.design.delays import StateSpace, close
from hystfmu.design.linear import NO_STATES, python_control
from hystfmu.design.loop import Margins, beside, grid, least, margins_of, on_grid, response_of
from hystfmu.design.repetitive import PeriodMemory
from hystfmu.scenario.loop.plant import PlantSide, held, slopes_of
from hystfmu.scenario.system.system import Link, System

DELAYS = (0.0, 0.5, 1.0, 2.0)  # additional delays in steps, compared with the case
SLOPES = 7  # number of incremental gains in the sector at which stability is tested
DOUBLINGS = 64  # number of doublings of the time over which the noise in a loop accumulates
NO_SLOPE = 1e-3  # an incremental gain below this fraction of the largest one counts as 0


@dataclass(frozen=True)
class OpenedLoop:
    """The loop of a case, opened at the input of the plant or at another signal.

    The controller with the step h consists of all units except the plant. Its outputs depend on the inputs of the same
    step. The first input of the controller is the output of the plant. The other inputs are the outputs (corrections)
    of period memories. The first output is the command. The other outputs are the inputs (errors) of period memories.
    `slopes` contains the smallest and the largest incremental gain along the path of the case. `hysteresis` contains
    the names of the models of plant and inverse. `at` is the signal at which the loop is opened, by default the input
    of the plant.
    """

    system: System
    controller: StateSpace  # state space of the controller
    plant: StateSpace  # continuous dynamics with static gain 1; time in s
    h: float  # step (s)
    slopes: tuple[float, float]
    hysteresis: tuple[str, ...]
    side: PlantSide  # units at the rate of the plant, with the delay of the case
    memories: tuple[PeriodMemory, ...] = ()  # memory of learning or repetitive control, at most one
    at: str = ""
    broken: StateSpace | None = None  # controller opened at the signal `at`, with a second input and a second output
    # True if the loop gain decreases with the amplitude; the margins are those for the largest gain
    falling: bool = False
    inverted: bool = True  # True if the loop contains an inverse
    ramp: float = 0.0  # ramp time of a new command for the dynamics of the plant (s)
    command: Link | None = None  # connection of the command to the inverse, or to the plant if there is no inverse

    @functools.cached_property
    def nominal(self) -> float:
        """Incremental gain for which the margins are computed. With an inverse it is 1.

        Without an inverse, the slope of the plant, for example in um/V, is a part of the loop gain. If the plant never
        has the slope 1, the largest slope is used.
        """
        if self.inverted:
            return 1.0
        low, high = slopes_of(self.system, self.side, ())
        return 1.0 if low <= 1 <= high else max(low, high, key=abs)

    @property
    def key(self) -> tuple[object, ...]:
        """Key of all data that determine the margins. Loops with equal data have equal keys."""
        matrices = tuple((m.shape, m.tobytes()) for m in (*self.controller, *self.plant))
        laws = tuple((m.n, m.q.tobytes(), m.l.tobytes(), m.lifted) for m in self.memories)
        return self.h, self.ramp, self.hysteresis, f"{self.nominal:.3g}", self.side.delay, self.at, matrices, laws

    def open_loop(self, slope: float, delay: float) -> Any:
        """Return L(z) at the input of the plant as a state space of python-control, for an incremental gain.

        `delay` is the additional delay compared with the case (steps).
        """
        control = python_control()
        A, B, C, D = self.controller
        K = control.ss(A, B[:, :1], C[:1], D[:1, :1], self.h)
        return -slope * K * control.ss(*self.held(delay), self.h)

    def held(self, delay: float) -> StateSpace:
        """Return the state space of G(z) for an additional delay compared with the case (steps)."""
        return held(self.plant, self.h, self.side.delay + delay, self.ramp)

    def margins(self, slope: float | None = None, delay: float = 0.0) -> Margins:
        """Return the margins for one incremental gain (by default `nominal`) and an additional delay (steps)."""
        slope = self.nominal if slope is None else slope
        return margins_of(*self._resolved(slope, delay), self.h, lambda gain: self._stable_with(gain, slope, delay))

    def _stable_with(self, gain: float, slope: float, delay: float) -> bool:
        """Return whether the loop is stable with an additional gain at the opened signal."""
        if self.broken is None:
            return self.stable(gain * slope, delay)
        return self._closed_break(gain).stable(slope, delay)

    def _closed_break(self, gain: float) -> "OpenedLoop":
        """Return the loop closed through a gain at the opened signal, and opened at the input of the plant."""
        assert self.broken is not None
        A, B, C, D = self.broken
        order = [0, *range(2, len(D)), 1]  # the opened signal is the last one
        system = A, B[:, order], C[order], D[np.ix_(order, order)]
        return replace(self, controller=close(system, (*NO_STATES, np.array([[gain]]))), broken=None, at="")

    def _resolved(self, slope: float, delay: float) -> tuple[Callable[[Array], Complex], Array, Complex]:
        """Return L as a function of angles, a grid that resolves each narrow resonance, and L on this grid."""

        def L(angles: Array) -> Complex:
            return self.response_at(angles, slope, delay)

        angles, values = self._angles, self.response(slope, delay)
        more = np.setdiff1d(beside(self.poles(slope, delay), self._angles), angles)
        if not len(more):
            return L, angles, values
        at = np.searchsorted(angles, more)
        return L, np.insert(angles, at, more), np.insert(values, at, L(more))

    def poles(self, slope: float, delay: float) -> Complex:
        """Return the poles of the open loop and of the closed loop, without period memories."""
        closed = self._closed_from_plant(slope, delay)
        systems = [(self.broken or self.controller)[0], self.held(delay)[0], closed]
        return np.concatenate([np.linalg.eigvals(A) for A in systems])

    def _closed_from_plant(self, slope: float, delay: float) -> Array:
        A, B, C, D = self._from_plant()
        F, G, H, _ = self.held(delay)
        return np.block([[A, B @ H], [slope * G @ C, F + slope * G @ D @ H]])

    def response_at(self, angles: Array, slope: float = 1.0, delay: float = 0.0) -> Complex:
        """Return L at angles omega h, shape (m,)."""
        z = np.exp(1j * angles)
        K, G = response_of(self.broken or self.controller, z), response_of(self.held(delay), z)[:, 0, 0]
        return self._broken(K, slope * G, angles)

    def response(self, slope: float = 1.0, delay: float = 0.0) -> Complex:
        """Return L on the grid of `angles`, shape (m,)."""
        return self._broken(
            on_grid(self.broken or self.controller, self._period), slope * self._late(delay), self._angles
        )

    @property
    def _period(self) -> int:
        return self.memories[0].n if self.memories else 0

    @property
    def _angles(self) -> Array:
        return grid(self._period)

    def _late(self, delay: float) -> Complex:
        return on_grid(self.held(delay), self._period)[:, 0, 0]

    def _closed(self, angles: Array, K: Complex) -> Complex:
        """Return the response of the controller including its period memories."""
        if not self.memories:
            return K
        R = self.memories[0].response(angles)[:, None, None]
        return np.asarray(K[:, :-1, :-1] + K[:, :-1, -1:] * R * K[:, -1:, :-1] / (1 - R * K[:, -1:, -1:]))

    def _broken(self, K: Complex, G: Complex, angles: Array) -> Complex:
        """Return L at the opened signal from the responses of controller and plant."""
        K = self._closed(angles, K)
        if self.broken is None:
            return np.asarray(-K[:, 0, 0] * G)
        return np.asarray(-(K[:, 1, 1] + K[:, 1, 0] * G * K[:, 0, 1] / (1 - K[:, 0, 0] * G)))

    def radius(self, slope: float, delay: float) -> float:
        """Return the largest modulus of a pole of the closed loop. The loop is stable if it is below 1.

        The additional poles of a period memory of n steps are not computed. The bound learning^(1/n) is used for their
        modulus.
        """
        largest = float(np.abs(np.linalg.eigvals(self._closed_from_plant(slope, delay))).max())
        if not self.memories or largest >= 1:
            return largest
        return max(largest, float(self.learning(slope, delay) ** (1 / self._period)))

    def stable(self, slope: float, delay: float) -> bool:
        """Return whether the closed loop is stable for an incremental gain and a delay."""
        plain = replace(self, memories=())
        if plain.radius(slope, delay) >= 1:
            return False
        if not self.memories:
            return True
        factor = self._factor(slope, delay)
        if np.abs(factor).max() < 1 or self.memories[0].lifted:
            return bool(np.abs(factor).max() < 1)
        # 1 - z^-n factor has no pole outside the unit circle, so its encirclements of 0 count its zeros there
        return _turns(1 - np.exp(-1j * self._period * self._angles) * factor) == 0

    def learning(self, slope: float | None = None, delay: float = 0.0) -> float:
        """Return the largest factor from the correction in one period to the correction in the next period.

        The factor is the maximum of abs(Q - L T) over frequency, with the filters Q and L of the period memory and the
        response T (see `learnt`). Without a period memory, the result is NaN.
        """
        slope = self.nominal if slope is None else slope
        return float(np.abs(self._factor(slope, delay)).max()) if self.memories else np.nan

    def _factor(self, slope: float, delay: float) -> Complex:
        K, G = on_grid(self.controller, self._period), slope * self._late(delay)
        return self.memories[0].factor(self._angles, _error(K, G))

    def learnt(self, angles: Array, slope: float | None = None, delay: float = 0.0) -> Complex:
        """Return the response T from a correction of the period memory to the reduction of the error, shape (m,).

        T is computed at the angles omega h for the closed loop without the period memory, but the loop must have one.
        With the memory and its filters Q and L, errors are multiplied by abs(Q - L T) in each period.
        """
        if not self.memories:
            raise InputError(f"{self.system.case.title}: The loop must have a memory of a period. Got none.")
        z = np.exp(1j * angles)
        slope = self.nominal if slope is None else slope
        return -_error(response_of(self.controller, z), slope * response_of(self.held(delay), z)[:, 0, 0])

    def worst_peak_db(self, delay: float = 0.0) -> float:
        """Return the largest peak of the sensitivity over the sector (dB), or infinity for an unstable loop."""
        if not self.stable_at(delay):
            return np.inf
        return max(self._peak_db(float(slope), delay) for slope in np.linspace(*self.slopes, SLOPES))

    def _peak_db(self, slope: float, delay: float) -> float:
        L, angles, values = self._resolved(slope, delay)
        return float(-20 * np.log10(least(lambda a: np.abs(1 + L(a)), angles, np.abs(1 + values))))

    @property
    def tested(self) -> list[float]:
        """Incremental gains in the sector at which stability is tested.

        An incremental gain of 0, for example of an inverse at its limit, opens the loop, so that no signal grows.
        Therefore a value close to 0 is tested instead. A conditionally stable loop is unstable at this value.
        """
        least = NO_SLOPE * max(self.slopes, key=abs)
        return [float(s) if abs(s) >= abs(least) else least for s in np.linspace(*self.slopes, SLOPES)]

    def stable_at(self, delay: float) -> bool:
        """Return whether the loop is stable for every incremental gain in the sector, see `tested`."""
        return all(self.stable(slope, delay) for slope in self.tested)

    def stable_to(self, delays: Sequence[float] = DELAYS) -> float:
        """Return the largest of `delays` (steps) up to which the whole sector is stable, or NaN if there is none."""
        found = np.nan
        for delay in sorted(delays):
            if not self.stable_at(delay):
                break
            found = delay
        return float(found)

    def noise_gain(self, slope: float | None = None, delay: float = 0.0) -> float:
        """Return the RMS of the command for white sensor noise of RMS 1, or infinity for an unstable loop."""
        slope = self.nominal if slope is None else slope
        if not self.stable(slope, delay):
            return np.inf
        if self.memories:
            K = self._closed(self._angles, on_grid(self.controller, self._period))[:, 0, 0]
            power = np.abs(K / (1 - slope * K * self._late(delay))) ** 2
            return float(np.sqrt(np.trapezoid(power, self._angles) / np.pi))
        _, B, C, D = self._from_plant()
        _, G, H, _ = self.held(delay)
        M = self._closed_from_plant(slope, delay)
        N, out = np.vstack([B, slope * G @ D]), np.hstack([C, D @ H])
        X = _covariance(M, N)
        return float(np.sqrt((out @ X @ out.T + D @ D.T)[0, 0])) if np.isfinite(X).all() else np.inf

    def _from_plant(self) -> StateSpace:
        """Return the controller from the output of the plant to the command, without period memories."""
        A, B, C, D = self.controller
        return A, B[:, :1], C[:1], D[:1, :1]


def _error(K: Complex, G: Complex) -> Complex:
    """Return the response from the correction of a memory to its error, in the closed loop without this memory."""
    return np.asarray(K[:, -1, -1] + K[:, -1, 0] * G * K[:, 0, -1] / (1 - K[:, 0, 0] * G))


def _covariance(M: Array, N: Array) -> Array:
    """Return the solution X of X = M X M' + N N' for a stable M. The doubling algorithm keeps X positive."""
    X, P = N @ N.T, M
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(DOUBLINGS):
            if not np.abs(P).max() > 1e-150:
                return X
            X, P = X + P @ X @ P.T, P @ P
    return np.full_like(X, np.inf)  # the modulus of a pole is below 1 only because of rounding


def _turns(f: Complex) -> int:
    """Return the number of encirclements of 0 by a response on (0, pi] and its conjugate."""
    return round(float(np.angle(f[1:] / f[:-1]).sum()) / np.pi)
