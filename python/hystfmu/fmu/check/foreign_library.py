"""A foreign FMU during its check, with instances whose inputs follow test signals, and the class `Trial`.

Only the child process of `validate` uses this module, because the FMU executes foreign native code.
"""

import math
import struct
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hystfmu.fmu.foreign.instance import CARRIED, REAL, Instance, Interface, Values, count, numbers, stated, version

STEPS = 100
_NEAR = 1e-4  # relative tolerance of a directional derivative
_ROUNDING = 2**-50  # relative rounding error, four units in the last place


def tangent_differs(got: float, value: Callable[[float], float], e: float) -> str:
    """Return "" if a derivative agrees with finite differences of `value`, otherwise the central difference as text.

    `got` is the derivative of the function `value` at 0, and e is the step of the differences.

    At a kink, each one-sided difference is also accepted. At a discontinuity, every value is accepted, because no
    derivative exists. The tolerance includes the rounding errors of the values.
    """
    low, here, high = (value(off) for off in (-e, 0.0, e))
    quotients = (high - low) / (2 * e), (high - here) / e, (here - low) / e
    rounding = _ROUNDING * max(abs(low), abs(here), abs(high)) / e
    if any(abs(got - s) <= _NEAR * max(1.0, abs(s)) + rounding for s in quotients):
        return ""
    jumps = abs(value(e / 8) - value(-e / 8)) > abs(high - low) / 2
    return "" if jumps else f"{quotients[0]:.6g}"


def bounds(v: Any) -> tuple[float | None, float | None]:
    """Return the smallest and the largest permitted value of a variable; None if the description states none."""
    low, high = (None if (b := stated(v, name)) is None else float(b) for name in ("min", "max"))
    return low, high


def _varied(v: Any) -> bool:
    """Return whether the trials vary an input. The valid values must be known, and the input must not need a clock."""
    if v.causality != "input" or getattr(v, "clocks", None):
        return False
    bounded = None not in bounds(v)
    return v.type in ("Real", "Float64", "Float32", "Boolean") or (v.type in CARRIED and bounded)


class ForeignFmu:
    """An unpacked foreign FMU with its model description, as read by fmpy.

    A trial that repeats an action as often as possible lasts `seconds` (s). `with_derivatives` contains the interfaces
    that provide directional derivatives. `steps` is the number of steps in a run. It is less than `STEPS` if the FMU
    ends the simulation or cannot continue.
    """

    def __init__(self, folder: Path, description: Any, seconds: float = 10.0) -> None:
        self.seconds = seconds
        self.folder, self.description, self.version = folder, description, version(description)
        self.variables = [v for v in description.modelVariables if v.type in CARRIED]
        self.outputs = [v for v in self.variables if v.causality == "output" and not getattr(v, "clocks", None)]
        self.inputs = [v for v in self.variables if _varied(v)]
        self.continuous = [v for v in self.inputs if v.type in REAL and v.variability != "discrete"]
        self.discrete = [v for v in self.inputs if v not in self.continuous]
        self.steps = STEPS
        self._ranges: dict[Any, tuple[float, float, float, Values]] = {}  # phase, bounds, start values
        root = ET.parse(folder / "modelDescription.xml").getroot()
        # fmpy uses the attribute name of FMI 2.0 for both standards
        flag = "providesDirectionalDerivative" + ("s" if self.version == 3 else "")
        self.with_derivatives = {e.tag for e in root if e.get(flag) in ("true", "1")}
        experiment = description.defaultExperiment
        self.t0 = float(experiment.startTime or 0) if experiment else 0.0
        fixed = getattr(description.coSimulation, "fixedInternalStepSize", None)
        self.h = float((experiment and experiment.stepSize) or fixed or 1e-3)

    def reach(self, steps: int) -> None:
        """Store the number of steps that the FMU can make."""
        self.steps = steps

    @contextmanager
    def instance(self, interface: Interface = "CoSimulation") -> Iterator[Instance]:
        """Create an instance in Initialization Mode. It is freed at the end of the context, also after a finding."""
        made = Instance(self.folder, self.description, interface)
        try:
            made.initialize(self.t0)
            yield made
        finally:
            made.free()

    @contextmanager
    def running(self) -> Iterator[Instance]:
        """Create an instance that has left Initialization Mode."""
        with self.instance() as made:
            made.begin()
            yield made

    @contextmanager
    def readable(self) -> Iterator[Instance]:
        """Create an instance whose variables can be set and read. In FMI 1.0, the instance must be initialised."""
        with self.running() if self.version == 1 else self.instance() as made:
            yield made

    def start(self, v: Any) -> Values:
        """Return the start value in the model description, one number for each element; 0 if it is missing."""
        values = numbers(v.start or 0)
        return values * count(v) if len(values) == 1 else values

    def excitation(self, v: Any, k: int, off: float = 0.0) -> Values:
        """Return row k of the test signal of an input, a modulated oscillation in the range of v, shifted by `off`.

        Every input has its own phase, because equal inputs would hide a dependency on their difference. A boolean is
        true while its oscillation is positive. The values of integers are rounded.
        """
        if v not in self._ranges:
            low, high = bounds(v)
            ends = -math.inf if low is None else low, math.inf if high is None else high
            self._ranges[v] = 2.4 * self.inputs.index(v), *ends, self.start(v)
        phase, low, high, start = self._ranges[v]
        swing = math.sin(0.7 * k + phase) * math.cos(0.11 * k)
        if v.type == "Boolean":
            return tuple([float(swing + off > 0) for _ in start])
        if v.type not in REAL:
            return tuple([min(max(float(round(x + 2 * (swing + off))), low), high) for x in start])
        values = [min(max(min(max(x + swing, low), high) + off, low), high) for x in start]
        return tuple([struct.unpack("f", struct.pack("f", x))[0] for x in values] if v.type == "Float32" else values)

    def put(self, made: Instance, k: int) -> None:
        """Set all inputs to row k of their test signals."""
        for v in self.inputs:
            made.set(v, self.excitation(v, k))

    def read(self, made: Instance) -> Values:
        """Return the values of all elements of all outputs."""
        return tuple([x for v in self.outputs for x in made.get(v)])

    def step(self, made: Instance, k: int, row: int | None = None) -> Values | None:
        """Make step k with row `row` of the test signals, by default row k, and return the outputs.

        The result is None if the FMU ends the simulation.
        """
        self.put(made, k if row is None else row)
        if not made.step(f"step {k + 1}", self.t0 + k * self.h, self.h):
            return None
        return self.read(made)

    def run(
        self, made: Instance, rows: Sequence[int], between: Callable[[Instance, Values], None] | None = None
    ) -> list[Values]:
        """Make one step for each of the given rows of the test signals, and return the outputs after each step.

        The list is shorter if the FMU ends the simulation.

        The function `between` is called after every step with its outputs.
        """
        out = []
        for k in rows:
            values = self.step(made, k)
            if values is None:
                break
            out.append(values)
            if between:
                between(made, values)
        return out

    def difference(self, want: Sequence[Values], got: Sequence[Values], first: int = 0) -> str:
        """Return a description of the first output that differs; "" if all outputs are bit-identical."""
        names = [v.name for v in self.outputs for _ in range(count(v))]
        for k, (a, b) in enumerate(zip(want, got, strict=False)):
            for name, x, y in zip(names, a, b, strict=True):
                if struct.pack("d", x) != struct.pack("d", y):
                    return f"{name} is {y!r} instead of {x!r} after step {first + k + 1}"
        return "" if len(want) == len(got) else f"it ends after {first + len(got)} steps instead of {first + len(want)}"


MADE: dict[Interface, str] = {
    "CoSimulation": "making an instance",
    "ModelExchange": "making an instance for Model Exchange",
    "ScheduledExecution": "making an instance for Scheduled Execution",
}
"""Name of the trial of each interface that all other trials of this interface need."""


@dataclass(frozen=True)
class Trial:
    """Trial of one property. The function `find` yields the problems of an FMU as sentences.

    `name` describes the action of the trial. If `find` raises a `Finding`, the trial cannot be completed. `needs` is
    the name of another trial that must be completed first, so that both do not report the same problem.
    """

    name: str
    find: Callable[[ForeignFmu], Iterator[str]]
    needs: str


def making(interface: Interface) -> Trial:
    """Return the trial that creates an instance, enters Initialization Mode and frees the instance."""

    def find(fmu: ForeignFmu) -> Iterator[str]:
        with fmu.instance(interface):
            yield from ()

    return Trial(MADE[interface], find, "")
