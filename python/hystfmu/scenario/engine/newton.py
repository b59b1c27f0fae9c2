"""Newton's method for the values of iterative coupling, from the tangents of the units.

The matrix and its updates are those of `fmu_build/master/newton.c`, and tangents pass through the units as in
`master.c`, so that the engines have the same bits.
"""

from __future__ import annotations

import ctypes as C
from collections.abc import Sequence

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.core.library import library
from hystfmu.scenario.engine.fmu_member import FmuMember
from hystfmu.scenario.engine.member import Member
from hystfmu.scenario.system.system import System


class Newton:
    """Newton steps of the guess in one step of the units that are due.

    Parameters
    ----------
    system : System
    due : sequence of Member
    values : array, shape (n_values,)
        All values of the system, which change during the run.
    """

    def __init__(self, system: System, due: Sequence[Member], values: Array) -> None:
        self._values, self._early = values, system.early()
        n = len(self._early)
        loops = {system.parts[k].name for k in system.loops()}
        width = {p.name: (p.first, len(p.outputs)) for p in system.parts}
        # whoever is in a loop has tangents, or there would be no Newton: an adapted FMU is never asked
        inside = [m if isinstance(m, FmuMember) and m.name in loops else None for m in due]
        own = [slice(width[m.name][0], sum(width[m.name])) for m in due]
        self._due = list(zip(due, inside, own, strict=True))
        names = {m.name for m in due}
        self._steps = [system.parts[k].name in names for k in system.makers().tolist()]
        self._J, self._H, self._change, self._room = np.empty((n, n)), np.empty((n, n)), np.empty(n), np.empty(2 * n)
        self._lib, self._n = library(), C.c_int64(n)

    def start(self, begin: Array, guess: Array) -> bool:
        """Factor the matrix after the first sweep from `begin` with `guess`.

        Returns False if a tangent is not finite or the loop gain is one.
        """
        for c, steps in enumerate(self._steps):
            d, read = np.zeros_like(self._values), begin.copy()
            read[self._early] = guess
            d[self._early[c]] = float(steps)  # a unit that is not due holds its outputs
            for m, inside, own in self._due:
                if not self._follow(m, inside, own, begin, read, d):
                    return False
                read[own] = self._values[own]
            self._J[:, c] = d[self._early]
        return not self._lib.newton_start(self._n, _at(self._J), _at(self._H))

    @staticmethod
    def _follow(m: Member, inside: FmuMember | None, own: slice, begin: Array, read: Array, d: Array) -> bool:
        """Write the tangent of a unit's outputs into `d`, on the branch on which its inputs moved."""
        du = [float(d[j]) if j >= 0 else 0.0 for j in m.sources]
        along = 0.0
        for j, v in zip(m.sources, du, strict=True):
            along += v * float(read[j] - begin[j]) if v else 0.0
        d[own] = 0.0
        if inside is None or not any(du) or own.start == own.stop:
            return True
        dy = inside.tangent([-v for v in du] if along < 0 else du)
        if dy is None:
            return False
        d[own] = [-v for v in dy] if along < 0 else dy
        return True

    def step(self, residual: Array) -> Array:
        """Return the change of the guess."""
        self._lib.newton_step(self._n, _at(self._H), _at(residual), _at(self._change))
        return self._change

    def learn(self, before: Array, now: Array) -> None:
        """Update the matrix with the last change of the residual (Broyden)."""
        self._lib.newton_learn(self._n, *[_at(a) for a in (self._H, self._change, before, now, self._room)])


def _at(a: Array) -> C.c_void_p:
    return C.c_void_p(a.ctypes.data)
