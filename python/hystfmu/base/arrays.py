"""Types that all rooms use: arrays of float64 of any shape, and the function that reports progress."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Progress = Callable[[float], None]
"""Function that is called with the fraction done, 0..1."""


def silent(fraction: float) -> None:
    """Report no progress."""
