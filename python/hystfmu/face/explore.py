"""The explorer of identified models, with the inverse in front if it is analytic."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.inverse import invert
from hystfmu.model import Model
from hystfmu.model.coverage import span_of
from hystfmu.model.explored import explored
from hystfmu.report.explorer import Explorer


def explorer(models: Sequence[Model], data: Dataset | None, u_label: str, y_label: str) -> Explorer:
    """Return the section of a page in which the reader can change the input of models.

    Parameters
    ----------
    models : sequence of Model
        Models that were fitted to `data`.
    data : Dataset, optional
        The measured points.
    u_label, y_label : str
        Names of input and output with their units of measure.
    """
    shown = [explored(m, m.key, _analytic(m)) for m in models]
    return Explorer(shown, u_label, y_label, None if data is None else (data.u, data.y))


def explorer_of(model: Model) -> Explorer | None:
    """Return the explorer of one model, without measured points.

    The result is None if the first input or the first output is not a scalar, or if the model does not state the range
    of its input.
    """
    first = {kind: [p for p in model.graph.ports if p.kind == kind] for kind in ("input", "output")}
    if span_of(model) is None or [p.size for (p, *_) in filter(None, first.values())] != [1, 1]:
        return None
    labels = [f"{p.name} ({p.unit})" if p.unit not in ("", "1") else p.name for (p, *_) in first.values()]
    return explorer([model], None, *labels)


def _analytic(model: Model) -> Model | None:
    """Return the exact or the implicit inverse; None if the model has neither inverse."""
    for method in ("exact", "implicit"):
        with suppress(InputError):
            return invert(model, method)
    return None
