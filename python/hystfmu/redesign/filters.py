"""Search for the filters of repetitive control with the largest cutoff and gain that are stable in every corner."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.design.frequency import Complex
from hystfmu.design.repetitive import RepetitiveFilters, filter_angles, learning_filters, taps_at, zero_phase_at
from hystfmu.redesign.corners import Corner, angles_of, fastest_mode
from hystfmu.scenario.loop.opened import OpenedLoop

GAINS = (0.3, 0.2, 0.1, 0.05)  # shares of the error learnt in a period, the first that some cutoff allows
REST = 0.999  # Q at frequency 0: a constant correction before an integrator is forgotten
FLOOR = 1e-3  # of the mean square of responses: what the loop does not respond to is not inverted
ABOVE_MODE = 1.2  # cutoff over the fastest mode: Q is closed at twice that mode, above which a record shows little
HARMONICS = 10  # of the reference that are learnt where the plant has no dynamics, and nothing else says more
KEPT = 0.5  # of the cutoff, for which a gain is kept that peaks too much above
PHASES = 96  # of a period, for a peak between harmonics
HIGHEST = 0.4  # cutoff over the sampling frequency
STEP = 2**0.25  # between cutoffs that are tried
SIDE_Q, SIDE_L = 2.6, 5.0  # taps on each side, in samples of the cutoff
MOST = 1500  # taps on a side


def highest(opened: OpenedLoop, n: int) -> float:
    """Return the upper limit of the default cutoff (Hz)."""
    mode = fastest_mode(opened)
    wanted = HARMONICS / (n * opened.h) if mode is None else ABOVE_MODE * mode
    return min(wanted, HIGHEST / opened.h)


class Search:
    """Filters for cutoffs and gains, tested in all corners. The nominal loop is the first corner.

    `h` is the step (s). `n` is the number of steps in a period. `peak` is the largest allowed peak of the sensitivity
    of the nominal loop with learning.
    """

    def __init__(self, found: Sequence[Corner], h: float, n: int, peak: float = math.inf) -> None:
        self._found, self._h, self._n, self._peak = found, h, n, peak
        angles = angles_of(list(found))
        self._z: Complex = np.exp(1j * angles)
        self._T = np.array([c.learnt(angles) for c in found])
        first = [c for c in found if c.name == found[0].name and c.delay == 0]
        nominal = min(first, key=lambda c: abs(c.slope - c.opened.nominal))
        self._S = np.abs(1 / (1 + nominal.without_memory(angles)))
        self._T_nominal = nominal.learnt(angles)
        self._design = np.array([c.learnt(filter_angles()) for c in found if c.delay == 0])

    def at(self, cutoff: float, gain: float) -> RepetitiveFilters:
        """Design filters, and compute the remaining share of an error in each corner."""
        n_q, n_l = (min(math.ceil(k / (cutoff * self._h)), self._n - 1, MOST) for k in (SIDE_Q, SIDE_L))
        made = learning_filters(self._design, self._h, cutoff, gain, n_q, n_l, REST, FLOOR)
        Q, L = zero_phase_at(made.q, self._z), taps_at(made.l, self._z)
        return RepetitiveFilters(made.q, made.l, tuple(np.abs(Q - L * self._T).max(axis=1).tolist()))

    def best(self, cutoff: float | None, gain: float | None, top: float) -> tuple[RepetitiveFilters, float, float]:
        """Return the filters for the largest stable gain, with the largest cutoff for this gain.

        A reduction of the error at the harmonics increases the sensitivity between the harmonics. Therefore default
        values of cutoff and gain meet the limit of the sensitivity, if possible. If no filter is stable, an InputError
        is raised.
        """
        if cutoff is not None and not 0 < cutoff < 0.5 / self._h:
            raise InputError(f"The cutoff must be a float in (0, {0.5 / self._h:g}) Hz. Got {cutoff:g} instead.")
        first: tuple[RepetitiveFilters, float, float] | None = None
        for g in GAINS if gain is None else (gain,):
            highest = 0.0
            for f in self._cutoffs(top) if cutoff is None else (cutoff,):
                if f < KEPT * highest:
                    break
                found = self.at(f, g)
                if max(found.contraction) < 1:
                    first, highest = first or (found, f, g), highest or f
                    if self._peak_with(found) <= self._peak:
                        return found, f, g
        if first is None:
            raise InputError(self._refusal(cutoff, gain, top))
        return first

    def _peak_with(self, filters: RepetitiveFilters) -> float:
        """Return the largest sensitivity of the nominal loop with learning, over all phases of the period."""
        Q, L = zero_phase_at(filters.q, self._z), taps_at(filters.l, self._z)
        turn = np.exp(2j * np.pi * np.arange(PHASES) / PHASES)[:, None]
        return float((np.abs((1 - turn * Q) / (1 - turn * (Q - L * self._T_nominal))) * self._S).max())

    def worst(self, filters: RepetitiveFilters, cutoff: float) -> tuple[str, float]:
        """Return the corner with the slowest decrease of harmonics up to half the cutoff, and its factor per period."""
        top = max(math.floor(self._n * cutoff * self._h / 2), 1)
        angles = 2 * np.pi * np.arange(1, top + 1) / self._n
        z = np.exp(1j * angles)
        Q, L = zero_phase_at(filters.q, z), taps_at(filters.l, z)
        left = [float(np.abs(Q - L * c.learnt(angles)).max()) for c in self._found]
        k = int(np.argmax(left))
        return self._found[k].name, left[k]

    def _cutoffs(self, top: float) -> Array:
        """Return cutoffs to try, the largest first, down to the frequency of the reference."""
        lowest = 1 / (self._n * self._h)
        k = max(math.floor(math.log(max(top / lowest, 1.0), STEP)), 0)
        return np.array([float(f"{top / STEP**i:.4g}") for i in range(k + 1)])

    def _refusal(self, cutoff: float | None, gain: float | None, top: float) -> str:
        """Return a message with the corner in which an error grows, and the reachable values."""
        g, f = gain or GAINS[0], cutoff or top
        left = self.at(f, g).contraction
        k = int(np.argmax(left))
        reachable = []
        if cutoff is not None:
            lower = next(
                (float(x) for x in self._cutoffs(min(f, HIGHEST / self._h)) if max(self.at(x, g).contraction) < 1), None
            )
            reachable += [f"a cutoff of {lower:.4g} Hz"] if lower is not None else []
        lower = next((x for x in (g / 2, g / 4, g / 8) if max(self.at(f, x).contraction) < 1), None)
        reachable += [f"a gain of {lower:g}"] if lower is not None else []
        what = f"reachable: {' or '.join(reachable)}" if reachable else "no cutoff and no gain is reachable"
        case = self._found[k].opened.system.case
        return (
            f"{case.scenario}: Errors must shrink from period to period in every corner. Got a factor of {left[k]:.4g} "
            f"at {self._found[k].name} with cutoff {f:.4g} Hz and gain {g:g}; {what}."
        )
