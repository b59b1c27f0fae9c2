"""Training of a `torch.nn` module with the optimisers of this package; torch computes the derivatives in float64.

Levenberg-Marquardt needs the Jacobian, which has one row per sample and output. The other optimisers need only the
gradient, so they are suitable for larger networks.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from threadpoolctl import threadpool_limits
from torch import nn

from hystfmu.base.arrays import Array, Progress, silent
from hystfmu.base.errors import InputError
from hystfmu.identify.solvers.trainers import TRAINERS, Squares


def train_module(
    module: nn.Module,
    x: Array,
    y: Array,
    trainer: str = "levenberg_marquardt",
    iterations: int = 150,
    progress: Progress = silent,
) -> float:
    """Train a module by least squares, starting from its present weights; the new weights replace them.

    Parameters
    ----------
    module : torch.nn.Module
        Module that maps an array (n, n_in) to an array (n, n_out). It is converted to float64.
    x : array, shape (n, n_in)
        Inputs, scaled to about [-1, 1].
    y : array, shape (n,) or (n, n_out)
        Wanted outputs, also scaled to about [-1, 1].
    trainer : {"levenberg_marquardt", "powell_beale", "lbfgs"}
        Optimiser; see `hystfmu.identify.solvers.trainers`.
    iterations : int
        Maximum number of iterations.

    Returns
    -------
    float
        RMS error over all samples and outputs.

    Raises
    ------
    InputError
        The trainer is unknown, x and y have different lengths, the output of the module has another size than y, or the
        module has no weights.
    """
    if trainer not in TRAINERS:
        raise InputError(f"The trainer must be one of {', '.join(TRAINERS)}. Got {trainer!r} instead.")
    inputs = torch.as_tensor(np.asarray(x, dtype=np.float64))
    wanted = torch.as_tensor(np.asarray(y, dtype=np.float64).reshape(len(y), -1))
    if inputs.ndim != 2 or len(inputs) != len(wanted):
        raise InputError(
            f"The array x must have shape (n, n_in) and y n rows. Got {tuple(np.shape(x))} and {len(y)} rows instead."
        )
    module.double()
    if not list(module.parameters()):
        raise InputError("The module must have weights to train. Got none.")
    gives = tuple(module(inputs[:1]).shape[1:])
    if gives != (wanted.shape[1],):
        raise InputError(f"The module must give {wanted.shape[1]} values a row, as y has. Got {gives} instead.")
    start = nn.utils.parameters_to_vector(module.parameters()).detach().numpy().copy()
    with threadpool_limits(1):  # see hystfmu.identify.fit
        p, value = TRAINERS[trainer](start, problem(module, inputs.numpy(), wanted.numpy()), iterations, progress)
    nn.utils.vector_to_parameters(torch.as_tensor(p), module.parameters())
    return float(np.sqrt(value / wanted.numel()))


def problem(module: nn.Module, x: Array, y: Array) -> Squares:
    """Return the sum of squared errors between module(x) and y (n, n_out) as a function of the module weights."""
    inputs, wanted = torch.as_tensor(x), torch.as_tensor(y)
    weights = dict(module.named_parameters())

    def named(p: Any) -> dict[str, Any]:
        parts = torch.split(p, [w.numel() for w in weights.values()])
        return {k: part.view_as(w) for (k, w), part in zip(weights.items(), parts, strict=True)}

    def one(p: Any, row: Any) -> tuple[Any, Any]:
        out = torch.func.functional_call(module, named(p), (row[None],))[0]
        return (out[0], out) if len(out) == 1 else (out, out)

    # reverse mode returns the output and its derivatives for each row; for a single output, `grad` is faster
    differentiate = torch.func.grad if wanted.shape[1] == 1 else torch.func.jacrev
    jacobian = torch.func.vmap(differentiate(one, has_aux=True), in_dims=(None, 0))

    def residuals(p: Array) -> tuple[Array, Array]:
        with torch.no_grad():
            J, out = jacobian(torch.as_tensor(p), inputs)
            r = out - wanted
            return r.numpy().ravel(), J.numpy().reshape(r.numel(), len(p))

    def errors(p: Array) -> Array:
        with torch.no_grad():
            r = torch.func.functional_call(module, named(torch.as_tensor(p)), (inputs,)) - wanted
            return np.asarray(r.numpy().ravel())

    def gradient(p: Array) -> tuple[float, Array]:
        q = torch.as_tensor(p).requires_grad_()
        value = ((torch.func.functional_call(module, named(q), (inputs,)) - wanted) ** 2).sum()
        (g,) = torch.autograd.grad(value, q)
        return float(value.detach()), g.numpy()

    return Squares(residuals, errors, gradient)
