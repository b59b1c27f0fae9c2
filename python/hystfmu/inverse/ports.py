"""Ports and signals of an inverse, derived from the model: input range, start values, descriptions."""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.graph import Input, Output
from hystfmu.model import Model
from hystfmu.model.inputs import with_starts


def at_start(model: Model) -> float:
    """Return the output of a model at the start values of its inputs."""
    return float(model.predict(with_starts(model.graph, np.full(2, model.graph.inputs[0].start)))[0])


def over_range(model: Model, v: Array) -> Array:
    """Scale the signal v (n,), in [-1, 1], to the input range of the model; a ramp from its start value precedes it."""
    from hystfmu.data.signals import ramps

    lo, hi = input_range(model, "A learned inverse must have the input range of the model")
    middle, half, start = (lo + hi) / 2, (hi - lo) / 2, model.graph.inputs[0].start
    way_in = ramps([(start - middle) / half, float(v[0])])[:-1] if half > 0 else np.zeros(0)
    return np.asarray(middle + half * np.concatenate([way_in, v]))


def input_range(model: Model, needed: str) -> tuple[float, float]:
    """Return the least and the largest input that the model was identified on, in the unit of measure of u.

    The provenance must state ``span_u``; otherwise an InputError is raised that begins with the rule `needed`.
    """
    span = model.provenance.get("span_u")
    if not (isinstance(span, list) and len(span) == 2):
        raise InputError(f"{needed}, provenance.span_u = [min, max]. Got {span!r} instead.")
    return float(span[0]), float(span[1])


def wanted_text(sink: Output) -> str:
    """Describe the input of an inverse: the wanted output `sink` of the model."""
    return _with("wanted output", sink.text)


def given_text(source: Input) -> str:
    """Describe the output of an inverse: the input `source` of the model."""
    return _with("input that gives it", source.text)


def _with(text: str, own: str) -> str:
    what = own.rpartition(": ")[2]  # of the inverse of an inverse
    return f"{text}: {what}" if what else text
