"""The explorer of identified models: those with an analytic inverse get it in front."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.inverse import invert
from hystfmu.model import Model
from hystfmu.model.explored import explored
from hystfmu.report.explorer import Explorer


def explorer(models: Sequence[Model], data: Dataset, u_label: str, y_label: str) -> Explorer:
    """Return the part of a page in which a reader moves the input of models.

    Parameters
    ----------
    models : sequence of Model
        Fitted to `data`.
    data : Dataset
        The measured points.
    u_label, y_label : str
        Names of input and output with their units of measure.
    """
    shown = [explored(m, m.key, _analytic(m)) for m in models]
    return Explorer(shown, u_label, y_label, (data.u, data.y))


def _analytic(model: Model) -> Model | None:
    """Return the exact or the implicit inverse; None if the model admits neither."""
    for method in ("exact", "implicit"):
        with suppress(InputError):
            return invert(model, method)
    return None
