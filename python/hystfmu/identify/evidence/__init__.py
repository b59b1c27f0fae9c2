"""Evidence in a record for linear dynamics behind a hysteresis, as numbers with standard errors."""

from __future__ import annotations

from hystfmu.identify.evidence.found import Evidence, Mode
from hystfmu.identify.evidence.record import evidence

__all__ = ["Evidence", "Mode", "evidence"]
