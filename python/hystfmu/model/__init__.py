"""Models: a graph with values and provenance, its errors, and what part of its input space the data cover."""

from __future__ import annotations

from hystfmu.model.model import Model

__all__ = ["Model"]
