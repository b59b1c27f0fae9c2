"""Types that every room uses: arrays of float64, any shape, and the report of progress."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Progress = Callable[[float], None]
"""Is called with the fraction done, 0..1."""


def silent(fraction: float) -> None:
    """Report no progress."""
