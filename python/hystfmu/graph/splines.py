"""B-splines of the block ``duhem``. Fits and Modelica exports use them."""

import numpy as np
from scipy.interpolate import BSpline

from hystfmu.base import Array


def uniform_splines(u: Array, n: int) -> Array:
    """Return the values (rows, n) of n uniform B-splines on [-1, 1] at u (rows,); they are constant outside.

    Their degree is 2, or n - 1 if this is smaller.
    """
    degree = min(n - 1, 2)
    cells = n - degree
    knots = -1 + 2 / cells * np.arange(-degree, cells + degree + 1)
    return np.asarray(BSpline.design_matrix(np.clip(u, -1.0, 1.0), knots, degree).toarray())
