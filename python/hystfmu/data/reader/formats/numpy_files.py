"""npy and npz files of numpy, without pickled objects."""

from __future__ import annotations

from functools import partial

import numpy as np

from hystfmu.base.told_arrays import Found, serve, since_first


def arrays(source: str) -> tuple[list[Found], list[str]]:
    """Return the arrays of numbers or times; the array of an npy file has no name.

    Raises
    ------
    ValueError
        The arrays hold objects.
    """
    loaded = np.load(source, allow_pickle=False)
    if isinstance(loaded, np.ndarray):
        return _found("", loaded), []
    found, fault = [], None
    for name in loaded.files:
        try:
            found += _found(name, loaded[name])
        except ValueError as e:  # pickled
            fault = e
    if fault is not None and not found:
        raise fault
    return found, []


def _found(name: str, array: np.ndarray) -> list[Found]:
    if array.dtype.names:
        return [f for n in array.dtype.names for f in _found(n, array[n])]
    if array.dtype.kind == "m":
        return [Found(name, array.shape, array.nbytes, partial(np.divide, array, np.timedelta64(1, "s")), "s")]
    if array.dtype.kind == "M" and array.ndim == 1 and len(array):
        seconds, first = since_first(array)
        return [Found(name, array.shape, array.nbytes, lambda: seconds, "s", first)]
    return [Found(name, array.shape, array.nbytes, lambda: array)] if array.dtype.kind in "biuf" else []


if __name__ == "__main__":
    serve(arrays)
