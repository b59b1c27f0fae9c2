"""Common types of the package: arrays of any shape, and functions that report progress."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Mask = NDArray[np.bool_]
"""True for the rows or elements that are meant."""
Indices = NDArray[np.intp]
"""Numbers of rows or elements."""
Progress = Callable[[float], None]
"""Function that a long computation calls with the completed fraction of its work, 0..1."""


def silent(fraction: float) -> None:
    """Ignore the progress of a computation."""
