"""Parameters that a design computes. A study then varies the requirements of the design, not each tap or pole.

The design is computed for the drawn values, and its result is set in every case. The result equals the result of
`hy.design`.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
import pydantic
from pydantic import Field

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.design import loop_shaping, repetitive_filters
from hystfmu.design.linear import python_control
from hystfmu.graph.tables import STRICT, Name
from hystfmu.scenario import build
from hystfmu.scenario.loop.opened import OpenedLoop
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.scenario.system.case import Case

Finite = Annotated[float, Field(allow_inf_nan=False)]
PREFIX = "design."
"""Prefix of parameters that only the design reads."""


class LearntLoops(pydantic.BaseModel):
    """Loops of one case for the design of a repetitive controller."""

    model_config = STRICT
    case: Name
    set: dict[str, str | float | list[Finite]] = Field({}, description="additional settings, as `set` of a scenario")
    slopes: list[Finite] = Field([1.0], min_length=1, max_length=20, description="local slopes of plant and inverse")


class RepetitiveDesign(pydantic.BaseModel):
    """Filters of a unit `repetitive` for several loops, from the drawn `design.cutoff` (Hz) and `design.gain`."""

    model_config = STRICT
    method: Literal["repetitive_filters"]
    unit: Name = Field(description="unit of the block `repetitive`, whose taps are set")
    loops: list[LearntLoops] = Field(min_length=1, max_length=50)
    _opened: list[Any] = pydantic.PrivateAttr([])  # the loops do not depend on what is drawn

    @property
    def reads(self) -> tuple[str, ...]:
        """Parameters that the design reads."""
        return f"{PREFIX}cutoff", f"{PREFIX}gain"

    @property
    def cases(self) -> tuple[str, ...]:
        """Cases that the design linearises."""
        return tuple(loop.case for loop in self.loops)

    def settings(self, cases: Mapping[str, Case], values: Mapping[str, float]) -> dict[str, Any]:
        """Return the taps in the form of `set` of a scenario."""
        for spec in self.loops if not self._opened else ():
            case = cases[spec.case]
            opened = open_loop(build(replace(case, overrides={**case.overrides, **spec.set})), (1.0, 1.0))
            self._opened += [behind_memory(opened, slope) for slope in spec.slopes]
        dims = cases[self.loops[0].case].units[self.unit].dims
        cutoff, gain = (values[k] for k in self.reads)
        found = repetitive_filters(self._opened, cutoff, gain, dims["n_q"], dims["n_l"])
        return {f"{self.unit}.q": found.q.tolist(), f"{self.unit}.l": found.l.tolist()}


def behind_memory(opened: OpenedLoop, slope: float) -> Any:
    """Return the open loop without its memory of a period.

    The complementary sensitivity of the returned loop is the response to the corrections of the memory. A loop without
    such a memory is an InputError.
    """
    if not opened.memories:
        raise InputError(f"{opened.system.case.title}: The loop must have a memory of a period. Got none.")
    control = python_control()
    A, B, C, D = opened.controller
    last = [-1, 0]  # the memory first, then the plant
    K = control.ss(A, B[:, last], C[last], D[np.ix_(last, last)], opened.h)
    T = -K.lft(slope * control.ss(*opened.held(0.0), opened.h))
    return control.feedback(T, 1, sign=1)


class Weight(pydantic.BaseModel):
    """Names of the drawn parameters of W = K (1 + K_1 / s) (1 + K_2 / s) (T_z s + 1) / (T_p s + 1), or Ki / s for K."""

    model_config = STRICT
    K: str | None = None
    Ki: str | None = None
    K_1: str | None = None
    K_2: str | None = None
    T_z: str | None = None
    T_p: str | None = None

    @pydantic.model_validator(mode="after")
    def _one_gain(self) -> Weight:
        if (self.K is None) == (self.Ki is None):
            raise ValueError("must have exactly one of K and Ki.")
        return self

    def transfer(self, values: Mapping[str, float]) -> Any:
        """Return the weight of the drawn values."""
        control = python_control()
        drawn = {k: values[name] for k, name in self.model_dump(exclude_none=True).items()}
        W = control.tf([drawn.get("K", drawn.get("Ki"))], [1.0] if self.Ki is None else [1.0, 0.0])
        for k in ("K_1", "K_2"):
            if k in drawn:
                W *= control.tf([1.0, drawn[k]], [1.0, 0.0])
        return W * control.tf([drawn.get("T_z", 0.0), 1.0], [drawn.get("T_p", 0.0), 1.0])


class LoopShapingDesign(pydantic.BaseModel):
    """Most robust controller for a weight with drawn parameters, as transfer functions in parallel."""

    model_config = STRICT
    method: Literal["loop_shaping"]
    case: Name = Field(description="case of the nominal plant; its delay is given by `delay`")
    delay: Annotated[float, Field(ge=0, le=100)] = Field(description="steps of delay and hold, as a Pade approximant")
    order: int = Field(2, ge=1, le=6, description="of the approximant")
    ratio: Annotated[float, Field(gt=1, le=10)] = Field(1.1, description="ratio of the optimal margin to the margin")
    weight: Weight
    robust: list[str] = Field(
        min_length=1, max_length=2, description="transfer functions `unit.block`: slow poles, then fast ones"
    )

    @property
    def reads(self) -> tuple[str, ...]:
        """Parameters that the design reads."""
        return tuple(self.weight.model_dump(exclude_none=True).values())

    @property
    def cases(self) -> tuple[str, ...]:
        """Cases that the design linearises."""
        return (self.case,)

    def settings(self, cases: Mapping[str, Case], values: Mapping[str, float]) -> dict[str, Any]:
        """Return the coefficients in the form of `set` of a scenario."""
        control = python_control()
        opened = open_loop(build(cases[self.case]), (1.0, 1.0))
        G = control.ss(*opened.plant) * control.ss(control.tf(*control.pade(self.delay * opened.h, self.order)))
        robust = loop_shaping(G, self.weight.transfer(values), self.ratio).robust
        n = len(robust.A)
        sizes = [n] if len(self.robust) == 1 else [n // 2, n - n // 2]
        parts = in_parallel(robust.A, robust.B, robust.C, sizes)
        found: dict[str, Any] = {}
        for name, (b, a) in zip(self.robust, parts, strict=True):
            found |= {f"{name}_b": b.tolist(), f"{name}_a": a.tolist()}
        return found


def in_parallel(A: Array, B: Array, C: Array, sizes: list[int]) -> list[tuple[Array, Array]]:
    """Split a strictly proper system of simple poles into transfer functions, the slow poles first.

    A, B, C have the shapes (n, n), (n, 1), (1, n). `sizes` contains the number of poles of each part; the sum is n.
    Return numerator and denominator of each part. For a part with k poles, the shapes are (k,) and (k + 1,). The
    constant coefficient of the denominator is 1.
    """
    poles, V = np.linalg.eig(A)
    residues = (C @ V).ravel() * np.linalg.solve(V, B.astype(complex)).ravel()
    groups = _pairs(poles)
    if len(sizes) == 1:
        chosen = [list(range(len(poles)))]
    else:  # pairs stay together: the subset of this many poles whose fastest one is slowest
        subsets = (s for k in range(len(groups) + 1) for s in itertools.combinations(groups, k))
        flat = [[i for g in s for i in g] for s in subsets]
        slow = min((s for s in flat if len(s) == sizes[0]), key=lambda s: sorted(np.abs(poles[s]))[::-1])
        chosen = [slow, [i for i in range(len(poles)) if i not in slow]]
    parts = []
    for part in chosen:
        a = np.poly(poles[part]).real
        b = sum(residues[i] * np.poly(poles[[j for j in part if j != i]]) for i in part)
        parts.append((np.real(b) / a[-1], a / a[-1]))
    return parts


def _pairs(poles: Array) -> list[list[int]]:
    """Return groups of indices: one index for a real pole, two indices for a conjugate pair."""
    left, groups = list(range(len(poles))), []
    while left:
        i = left.pop(0)
        if abs(poles[i].imag) <= 1e-12 * abs(poles[i]):
            groups.append([i])
            continue
        j = min(left, key=lambda k: abs(poles[k] - poles[i].conjugate()))
        left.remove(j)
        groups.append([i, j])
    return groups


Design = Annotated[RepetitiveDesign | LoopShapingDesign, Field(discriminator="method")]
