"""Initial memory: the option ``u0`` of methods with return-point memory."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hystfmu.data import Dataset
from hystfmu.identify.options import Option


def u0_option(what: str) -> Option:
    """Return the option; `what` describes the state, e.g. "every play rests"."""
    return Option("u0", None, -1e300, 1e300, text=f"initial memory: {what} at this input; default the first input")


def u0_of(data: Dataset, options: Mapping[str, Any]) -> float:
    """Return the value of the option, in the unit of measure of u."""
    return float(data.u[0]) if options["u0"] is None else float(options["u0"])
