"""Common types of the package: float64 arrays of any shape, and functions that report progress."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Progress = Callable[[float], None]
"""Function that a long computation calls with the completed fraction of its work, 0..1."""


def silent(fraction: float) -> None:
    """Ignore the progress of a computation."""
