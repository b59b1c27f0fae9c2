"""Design of loops: models for python-control, describing functions of hysteresis, margins, gains with their units."""

from hystfmu.design.describing import DescribingFunction, describing_function
from hystfmu.design.gains import Gain, gains
from hystfmu.design.linear import linearise, to_control
from hystfmu.design.loop import Margins, loop, margins

__all__ = [
    "DescribingFunction",
    "Gain",
    "Margins",
    "describing_function",
    "gains",
    "linearise",
    "loop",
    "margins",
    "to_control",
]
