"""Inverses of a model: the input that makes the model's output follow a wanted one, again a Model with ports u and y.

exact    block by block from the output to the input; every block of the chain needs an inverse
         (Prandtl-Ishlinskii with a linear term, Zhao-Tan, constraint factor, dead zones, scaling).
implicit the model itself with the block `implicit_inverse` around it, which finds the input by bounded root finding in
         the core; the model must be static: operators with memory and functions of one input.
learned  a bank of plays and a network, trained on the model's own response with input and output exchanged.

Every inverse states what it is worth: `fit` holds the errors of inverse -> model, in percent of the span of the wanted
output, the worst of the held-out signals within 90 % of the range of the input.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.inverse.exact import exact_inverse
from hystfmu.inverse.implicit import implicit_inverse
from hystfmu.inverse.input_range import over_range
from hystfmu.inverse.learned import learned_inverse
from hystfmu.model import Model

__all__ = ["inverse"]

METHODS = ("exact", "implicit", "learned")
SHARE = 0.9  # of the range of the input, for the wanted outputs that an inverse is judged on


def inverse(model: Model, method: str = "exact", seed: int = 0, **options: Any) -> Model:
    """The inverse of a model as a second model: input `u` is the wanted output, output `y` the input to apply.

    Parameters
    ----------
    model : Model
        One input, one output.
    method : {"exact", "implicit", "learned"}
        See the module's text.
    seed : int
        Of the learned inverse: starts of the network and the reversals it is trained on.
    **options
        Of the implicit inverse: ``lo`` and ``hi``, the limits of the input; by default the range of the data
        (provenance ``span_u``).  Of the learned inverse: those of ``play_bank_mlp``.

    Returns
    -------
    Model
        `fit` holds ``cascade_rms_percent`` and ``cascade_max_percent``, see the module's text (not for a model that
        does not know the range of its input, provenance ``span_u``).

    Raises
    ------
    InputError
        No such inverse exists; the sentence says why and what to do.
    """
    made = invert(model, method, seed, **options)
    return replace(made, fit={**made.fit, **_cascade(model, made)})


def invert(model: Model, method: str = "exact", seed: int = 0, **options: Any) -> Model:
    """As `inverse`, but not judged: for those who only run it.

    Raises
    ------
    InputError
        As `inverse`.
    """
    if method not in METHODS:
        raise InputError(f"no inverse method {method!r}; there are: {', '.join(METHODS)}")
    if len(model.graph.inputs) != 1 or len(model.graph.outputs) != 1:
        raise InputError("an inverse needs a model with one input and one output")
    if not any(model.graph.dependencies().values()):
        raise InputError(
            f"the output of {model.key} depends on past inputs only (dynamics or a delay): no causal inverse exists; "
            "invert its hysteresis alone, with the inverse of the dynamics (feedforward) in front"
        )
    unknown = set(options) - {"exact": set(), "implicit": {"lo", "hi"}}.get(method, set(options))
    if unknown:
        raise InputError(f"the {method} inverse has no option {sorted(unknown)[0]!r}")
    if method == "learned":
        return learned_inverse(model, seed, options)
    return implicit_inverse(model, **options) if method == "implicit" else exact_inverse(model)


def _cascade(model: Model, made: Model) -> dict[str, float]:
    """Errors of inverse -> model on outputs that the model gives for every held-out signal: the worst of each."""
    from hystfmu.data.signals import held_out
    from hystfmu.identify import errors

    if "span_u" not in model.provenance:
        return {}
    wanted = [model.predict(over_range(model, SHARE * v)) for v in held_out().values()]
    found = [errors(model.predict(made.predict(r, model.step)), r, float(np.ptp(r))) for r in wanted]
    return {f"cascade_{k}": max(e[k] for e in found) for k in ("rms_percent", "max_percent")}
