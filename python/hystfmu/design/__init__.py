"""Loop design: python-control models, describing functions of hysteresis, margins, gains with units of measure.

>>> import hystfmu as hy
>>> w = 3141.6
>>> g0 = hy.Node("g0", "transfer_function", {}, {"b": [w**2], "a": [1, 1.4 * w, w**2]})
>>> pid = hy.blocks.Pid(Kp=1.26, Ki=9692.0, Kd=7.036e-4).node
>>> hy.design.margins(hy.design.loop(g0, pid, 1e-4)).phase_deg > 60.0
True
"""

from hystfmu.design.delays import sampled
from hystfmu.design.feedforward import scan_feedforward, scan_harmonics
from hystfmu.design.linear import Gain, gains, linearise, to_control
from hystfmu.design.loop import Margins, loop, margins
from hystfmu.design.repetitive import RepetitiveFilters, repetitive_filters
from hystfmu.design.sector import DescribingFunction, describing_function, sector
from hystfmu.design.structures import LoopShaping, loop_shaping

__all__ = [
    "DescribingFunction",
    "Gain",
    "LoopShaping",
    "Margins",
    "RepetitiveFilters",
    "describing_function",
    "gains",
    "linearise",
    "loop",
    "loop_shaping",
    "margins",
    "repetitive_filters",
    "sampled",
    "scan_feedforward",
    "scan_harmonics",
    "sector",
    "to_control",
]
