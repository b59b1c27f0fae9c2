"""Play operators as columns of a regression, run by the C core, their thresholds, and the option for their start."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node
from hystfmu.identify.options import Option

LEAST_TRAVEL = 0.02


def thresholds(u: Array, n: int) -> Array:
    """Return half-widths, shape (n,), in equal steps from 0 (excluded) to 98 % of half the range of u.

    A play wider than half the range never moves back: its column is constant after the first loading (Shen & Ma 2017
    spread theirs over the whole range, so half of their columns are constant). A play that moves less than 2 % of the
    range is hardly excited: its weight would fit the noise at the peaks and cause errors for every larger input.
    """
    return np.asarray((1 - LEAST_TRAVEL) * np.ptp(u) / 2 * np.arange(1, n + 1) / n)


def plays(u: Array, r: Array, u0: float) -> Array:
    """Run plays of half-widths `r` (n,) from rest at `u0` over the rows of `u`; shape (rows, n)."""
    bank = Graph.single(Node("bank", "play_bank", {"n": len(r)}, {"r": r, "z0": u0}))
    return bank.run(u).reshape(len(u), len(r))


def u0_option(what: str) -> Option:
    """Return the option of the initial memory; `what` describes the state, e.g. "every play rests"."""
    return Option("u0", None, -1e300, 1e300, text=f"initial memory: {what} at this input; default the first input")


def u0_of(data: Dataset, options: Mapping[str, Any]) -> float:
    """Return the value of the option, in the unit of measure of u."""
    return float(data.u[0]) if options["u0"] is None else float(options["u0"])
