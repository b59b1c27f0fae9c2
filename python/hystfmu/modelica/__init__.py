"""Identified models as Modelica: `export_modelica` writes a package with a record of values and a ready block."""

from __future__ import annotations

from hystfmu.modelica.package import export_modelica

__all__ = ["export_modelica"]
