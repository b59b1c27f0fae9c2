"""Inverse models. An inverse computes the input for which the output of a model follows a wanted output.

There are four methods:

exact    replaces each block by its inverse, in the order from output to input. Every block of the chain must have an
         inverse (Prandtl-Ishlinskii with a linear term, Zhao-Tan, constraint factor, dead zones, scaling).
implicit runs the model inside the block `implicit_inverse`, which finds the input by bounded root finding in the C
         core. The model may contain static functions of one input, operators with memory, and creep. It must not
         contain other dynamics.
learned  trains a network on the response of the model with input and output exchanged. The inputs of the network are
         the outputs of the inverse operator of Zhao & Tan and of a few plays (see `hystfmu.inverse.learned`).
adaptive is the exact inverse of a Prandtl-Ishlinskii operator, whose weights are estimated from the measured output
         during operation. This inverse has further ports (see `hystfmu.inverse.adaptive`).

The method inverts only the hysteresis of the model. Linear dynamics and a delay after the hysteresis are inverted by a
feed-forward that uses future samples of the wanted output (`hystfmu.inverse.dynamic`). The output of the cascade of
inverse and model then lags the wanted output by a number of steps, ``fit["lag_steps"]``.

An inverse is a Model with ports u and y. The `fit` of every inverse except the adaptive inverse contains its accuracy:
the errors of the cascade for the worst held-out signal, in percent of the span of the wanted output. The held-out
signals use 90 % of the input range. For a model with dynamics, they are smooth, their frequencies are at most a tenth
of the natural frequency, and the lag is removed before the errors are computed.
"""

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hystfmu.base import Array, InputError, Progress, silent
from hystfmu.inverse.adaptive import adaptive_inverse
from hystfmu.inverse.dynamic import dynamic_inverse, split, wanted
from hystfmu.inverse.exact import exact_inverse
from hystfmu.inverse.implicit import implicit_inverse
from hystfmu.inverse.learned import learned_inverse
from hystfmu.inverse.ports import over_range
from hystfmu.model import M, Model, beside, with_starts

__all__ = ["inverse"]

METHODS = ("exact", "implicit", "learned", "adaptive")
BACK = 1e-6  # output steps against the direction below this share of the output range count as rounding errors
POOR = 5.0  # RMS error of the cascade (% of the span) above which an inverse is not useful
ENDS = (np.linspace(-1.0, 1.0, 200), np.linspace(1.0, -1.0, 200))
ANALYTIC = ("exact", "implicit")  # a learned inverse exists for every model; it is fitted on request
SHARE = 0.9  # fraction of the input range that the wanted outputs of the cascade test use


def inverse(
    model: M,
    method: str = "exact",
    seed: int = 0,
    progress: Progress = silent,
    **options: Any,
) -> M:
    """Return the inverse of a model. Its input `u` is the wanted output, and its output `y` is the input to apply.

    Parameters
    ----------
    model : Model
        Model with one input and one output. It may also have covariates, which are then inputs of the inverse, too.
    method, seed, progress, options
        See `hystfmu.Model.inverse`. The default method there is "auto".

    Returns
    -------
    Model
        Inverse model. If the provenance of the model contains the range of the input (``span_u``), `fit` contains
        ``cascade_rms_percent`` and ``cascade_max_percent``, and a warning if the errors are large.

    Raises
    ------
    InputError
        The model has no inverse of this kind; the message states the reason and the remedy.
    """
    if method == "auto":
        if options:
            raise InputError(
                f"The method of an inverse with options must be named. Got {next(iter(options))!r} for 'auto'."
            )
        for each in ANALYTIC:
            with suppress(InputError):
                return _with_cascade(model, invert(model, each, seed))
        method = "learned" if len(model.graph.inputs) == 1 else "implicit"  # learned inverses accept no covariates
    made = invert(model, method, seed, progress, **options)
    # the adaptive inverse needs the measured output of a plant, so the cascade test does not apply
    return _warned(made if method == "adaptive" else _with_cascade(model, made))


def invert(
    model: M,
    method: str = "exact",
    seed: int = 0,
    progress: Progress = silent,
    **options: Any,
) -> M:
    """Return the inverse of a model without the cascade test. Parameters and errors are those of `inverse`."""
    if method == "adaptive":
        return adaptive_inverse(model, **options)
    if method not in METHODS:
        raise InputError(f"The method of an inverse must be one of {', '.join(METHODS)}. Got {method!r} instead.")
    n_in, n_out = len(model.graph.inputs), len(model.graph.outputs)
    covariates = set(model.provenance.get("span_covariates", {}))
    if n_in == 0 or n_out != 1 or not set(beside(model.graph)) <= covariates:
        raise InputError(f"A model to invert must have one input and one output. Got {n_in} and {n_out} instead.")
    if n_in > 1 and method == "learned":
        raise InputError(
            f"A model to invert by learning must have no covariates. Got {', '.join(beside(model.graph))}: use the "
            "method 'exact' or 'implicit'."
        )
    parts = split(model)
    if parts is None and model.graph.inputs[0].name not in model.graph.dependencies()[model.graph.outputs[0].name]:
        raise InputError(
            f"The output of {model.key} must depend on the present input, or end in linear dynamics. Got a dependence "
            "on past inputs only, which has no causal inverse."
        )
    allowed: dict[str, set[str]] = {"exact": set(), "implicit": {"lo", "hi"}}
    unknown = set(options) - allowed.get(method, set(options))
    if unknown:
        legal = ", ".join(sorted(allowed[method])) or "none"
        raise InputError(
            f"The options of the {method} inverse must be among: {legal}. Got {sorted(unknown)[0]!r} instead."
        )

    def static(part: M) -> M:
        if method == "learned":
            return learned_inverse(part, seed, options, progress)
        return implicit_inverse(part, **options) if method == "implicit" else exact_inverse(part)

    return static(model) if parts is None else dynamic_inverse(model, parts, static)


def _with_cascade(model: M, made: M) -> M:
    return replace(made, fit={**made.fit, **_cascade(model, made)})


def _warned(made: M) -> M:
    rms = made.fit.get("cascade_rms_percent")
    if rms is None or rms <= POOR:
        return made
    line = (
        f"a poor inverse: in cascade with its model, RMS {rms:.2g} % of the span; the method 'implicit' is exact for "
        "static models"
    )
    return replace(made, fit={**made.fit, "warnings": [*made.fit.get("warnings", []), line]})


def _cascade(model: Model, made: Model) -> dict[str, float]:
    """Return the errors of the cascade of the inverse `made` and the model for the worst held-out signal."""
    from hystfmu.data.signals import held_out
    from hystfmu.model import errors

    if "span_u" not in model.provenance:
        return {}
    parts, late = split(model), made.fit.get("lag_steps", 0)
    if parts is None:
        signals = [model.predict(with_starts(model.graph, over_range(model, SHARE * v))) for v in held_out().values()]
    else:
        signals = wanted(model, parts, SHARE)
    found = []
    for r in signals:
        reached = model.predict(with_starts(model.graph, made.predict(with_starts(made.graph, r), model.step)))
        found.append(errors(reached[late:], r[: len(r) - late], float(np.ptp(r))))
    return {f"cascade_{k}": max(e[k] for e in found) for k in ("rms_percent", "max_percent")}


@dataclass(frozen=True)
class Inverses:
    """Functions by which the kind `auto` finds out whether a model has a useful inverse."""

    def kind(self, model: Model) -> str:
        """Return the first method of `ANALYTIC` that can invert the model, or ``learned`` if there is none.

        For a model with a non-monotone output, return the text ``none: not monotone``.
        """
        if _folded(model):
            return "none: not monotone"
        for method in ANALYTIC:
            try:
                invert(model, method)
            except InputError:
                continue
            return method
        return "learned"

    def fault(self, model: Model) -> str:
        """Return the reason why no method of `ANALYTIC` gives a useful inverse, or an empty text if one does."""
        if _folded(model):
            return "the output is not monotone in the input: a wanted output has several inputs"
        reason = refused = ""
        for method in ANALYTIC:
            try:
                made = inverse(model, method)
            except InputError as e:
                refused = str(e)  # of the last method: the refusals of the others advise other methods
                continue
            off = made.fit.get("cascade_rms_percent", 0.0)
            if off <= POOR:
                return ""
            reason = f"the {method} inverse and the model in cascade are off by {off:.2g} % of the span"
        return reason or refused


def _at_rest(model: Model, u: Array) -> Array:
    """Return the output of a model for the input u (n,), with all covariates at their start values."""
    return np.asarray(model.predict(with_starts(model.graph, u)))


def _folded(model: Model) -> bool:
    """Return whether the output of a static model changes direction while the input rises or falls over its range.

    In this case several inputs give the same output. Models with dynamics, creep or lags are not tested, because their
    output can continue in the old direction after a reversal of the input.
    """
    if split(model) is not None:
        return False
    u = over_range(model, np.concatenate([*ENDS, *ENDS]))
    y, n = _at_rest(model, u), len(ENDS[0])
    room = BACK * float(np.ptp(y))
    if np.abs(_at_rest(model, np.repeat(u, 2))[1::2] - y).max() > room:
        return False
    up, down = np.diff(y[-2 * n : -n]), np.diff(y[-n:])
    return not any((s * up >= -room).all() and (s * down <= room).all() for s in (1, -1))
