"""Export of an identified static model as the hysteresis of an actuator of the Modelica library, in SI units."""

from hystfmu.modelica.actuator.write import ACTUATOR, actuator_files, actuator_told

__all__ = ["ACTUATOR", "actuator_files", "actuator_told"]
