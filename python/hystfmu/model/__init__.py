"""Models: a graph with values and provenance, its errors, and the coverage of its input space by the data."""

from __future__ import annotations

from hystfmu.model.model import Model

__all__ = ["Model"]
