"""Export of identified models to Modelica. `export_modelica` writes a package with a parameter record and a block."""

from hystfmu.modelica.package import export_modelica

__all__ = ["export_modelica"]
