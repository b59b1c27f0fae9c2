"""Range of the input in the identification data."""

from __future__ import annotations

from hystfmu.model import Model


def span(model: Model) -> tuple[float, float] | None:
    """Return least and largest input in the unit of measure of the data; None if they are unknown."""
    found = model.provenance.get("span_u")
    if (
        isinstance(found, list)
        and len(found) == 2
        and all(isinstance(v, int | float) for v in found)
        and found[0] < found[1]
    ):
        return float(found[0]), float(found[1])
    return None
