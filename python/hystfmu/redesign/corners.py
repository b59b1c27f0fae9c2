"""The loops of a scenario that a design covers: its cases, slopes, delays, and mode errors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.design.frequency import Complex, beside, grid
from hystfmu.scenario.loop_margins import OpenedLoop
from hystfmu.scenario.system.spec import MarginsSpec


@dataclass(frozen=True)
class Corner:
    """A loop for which a design has to hold.

    Attributes
    ----------
    name : str
        Case, and difference from it.
    opened : OpenedLoop
    slope : float
        Of plant over inverse.
    delay : float
        In steps beyond that of the case.
    """

    name: str
    opened: OpenedLoop
    slope: float
    delay: float

    def learnt(self, angles: Array) -> Complex:
        """Return the response from a correction to the reduction of the error."""
        return self.opened.learnt(angles, self.slope, self.delay)

    def without_memory(self, angles: Array) -> Complex:
        """Return the response of the open loop without its memory."""
        return replace(self.opened, memories=()).response_at(angles, self.slope, self.delay)

    @property
    def stable(self) -> bool:
        """True if the loop is stable without its memory."""
        return replace(self.opened, memories=()).stable(self.slope, self.delay)


def corners(
    opened: Mapping[str, OpenedLoop], limits: MarginsSpec | None, off: float, *, stable: bool = True
) -> list[Corner]:
    """Return the corners of a scenario.

    Parameters
    ----------
    opened : mapping of str to OpenedLoop
        Loops by case, the nominal one first.
    limits : MarginsSpec or None
        Limits of the scenario: its corners, with slopes and delays for which the loop must be stable.
    off : float
        Share by which the natural frequencies of the plant may differ.
    stable : bool
        Refuse a loop that is unstable without learning.

    Raises
    ------
    InputError
        Such a loop.
    """
    found: list[Corner] = []
    seen: set[tuple[object, ...]] = set()
    for k, (case, one) in enumerate(opened.items()):
        named = limits is not None and any(fnmatchcase(case, pattern) for pattern in limits.corners)
        slopes, late = {one.nominal}, 0.0
        if limits is None or limits.slopes is None:
            slopes |= set(one.slopes)
        elif named:
            slopes |= set(limits.slopes)
        if named and limits is not None:
            late = limits.stable_to_steps or 0.0
        for name, other in ((case, one), *(_off(case, one, off) if k == 0 else ())):
            for slope in sorted(slopes):
                for delay in sorted({0.0, late / 2, late}):
                    key = (*replace(other, memories=()).key, slope, delay)
                    if key not in seen:
                        seen.add(key)
                        found.append(Corner(name, other, float(slope), delay))
    for corner in found if stable else ():
        if not corner.stable:
            raise InputError(
                f"{corner.opened.system.case.scenario}: The loop must be stable before it learns. Got an unstable one "
                f"at {corner.name} for slope {corner.slope:g} and {corner.delay:g} further steps of delay."
            )
    return found


def _off(case: str, opened: OpenedLoop, off: float) -> Iterator[tuple[str, OpenedLoop]]:
    """Yield loops whose plant has other natural frequencies: s becomes s / f."""
    A, B, C, D = opened.plant
    for f in (1 - off, 1 - off / 2, 1 + off / 2, 1 + off) if off and len(A) else ():
        yield f"{case}, modes {100 * (f - 1):+.3g} %", replace(opened, plant=(f * A, f * B, C, D))


def fastest_mode(opened: OpenedLoop) -> float | None:
    """Return the largest natural frequency of the plant (Hz); None if it has no dynamics."""
    A = opened.plant[0]
    return float(np.abs(np.linalg.eigvals(A)).max() / (2 * np.pi)) if len(A) else None


def angles_of(found: list[Corner]) -> Array:
    """Return angles that resolve the resonances of all loops, shape (m,)."""
    poles = np.concatenate([c.opened.poles(c.slope, c.delay) for c in found])
    return np.union1d(grid(), beside(poles, grid()))
