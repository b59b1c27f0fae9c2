"""Design of loops: models for python-control, describing functions of hysteresis, stability margins with units."""

from hystfmu.design.describing import DescribingFunction, describing_function
from hystfmu.design.linear import linearise, to_control
from hystfmu.design.loop import Margins, loop, margins

__all__ = ["DescribingFunction", "Margins", "describing_function", "linearise", "loop", "margins", "to_control"]
