"""A foreign FMU: model description, instances, and runs in Co-Simulation with varying inputs (by fmpy).

Only the child process of `check_fmu` uses this module, because the FMU executes foreign native code.
"""

from __future__ import annotations

import math
import struct
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

Values = tuple[float, ...]
_NEAR = 1e-4  # relative tolerance of a directional derivative
_ROUNDING = 2**-50  # four units in the last place


class Finding(Exception):
    """A finding as a sentence; ends its trial."""


def _count(v: Any) -> int:
    return math.prod(v.shape) if v.shape else 1


def tangent_differs(got: float, value: Callable[[float], float], e: float) -> str:
    """Compare a derivative with finite differences of step e; return the central difference if they disagree, else "".

    At a kink the difference of either side is accepted.  At a discontinuity every value is accepted, as no derivative
    exists.  The tolerance includes rounding: values of 1e12 have a spacing of 1e-4.
    """
    low, here, high = (value(off) for off in (-e, 0.0, e))
    quotients = (high - low) / (2 * e), (high - here) / e, (here - low) / e
    rounding = _ROUNDING * max(abs(low), abs(here), abs(high)) / e
    if any(abs(got - s) <= _NEAR * max(1.0, abs(s)) + rounding for s in quotients):
        return ""
    jumps = abs(value(e / 8) - value(-e / 8)) > abs(high - low) / 2
    return "" if jumps else f"{quotients[0]:.6g}"


class Instance:
    """One instance with the calls that the trials need; a failing call raises a `Finding` that names the variable."""

    def __init__(self, folder: Path, description: Any, exchange: bool) -> None:
        from fmpy.fmi2 import FMU2Model, FMU2Slave
        from fmpy.fmi3 import FMU3Model, FMU3Slave

        self.fmi2 = description.fmiVersion.startswith("2")
        self._methods: dict[tuple[str, str], Callable[..., Any]] = {}
        kinds = (FMU2Slave, FMU2Model) if self.fmi2 else (FMU3Slave, FMU3Model)
        kind = kinds[exchange]
        name = (description.modelExchange if exchange else description.coSimulation).modelIdentifier
        try:
            self.unit = kind(
                guid=description.guid, modelIdentifier=name, unzipDirectory=str(folder), instanceName="check"
            )
        except AttributeError as e:  # fmpy looks up every function of the standard
            raise Finding(f"the binary does not export {str(e).split()[-1]}") from None
        except Exception as e:
            raise Finding(f"the binary cannot be loaded: {e}") from None
        try:
            self.unit.instantiate()
        except Exception as e:
            raise Finding(f"the FMU cannot be instantiated: {e}") from None

    def call(self, what: str, name: str, *args: Any, **more: Any) -> Any:
        """Call a method of the fmpy instance; `what` describes the call in a finding."""
        try:
            return getattr(self.unit, name)(*args, **more)
        except Finding:
            raise
        except Exception as e:
            raise Finding(f"{what}: {e}") from None

    def initialize(self, t: float) -> None:
        """Enter Initialization Mode at time t (s)."""
        if self.fmi2:
            self.call("setting up the experiment", "setupExperiment", startTime=t)
            self.call("entering Initialization Mode", "enterInitializationMode")
        else:
            self.call("entering Initialization Mode", "enterInitializationMode", startTime=t)

    def _method(self, verb: str, v: Any) -> Callable[..., Any]:
        """Return the method of the fmpy instance that reads or sets variables of the type of v."""
        key = verb, v.type
        if key not in self._methods:
            kind = ("Integer" if self.fmi2 else "Int64") if v.type == "Enumeration" else str(v.type)
            self._methods[key] = getattr(self.unit, f"{verb}{kind}")
        return self._methods[key]

    def get(self, v: Any) -> Values:
        """Read all elements of a variable."""
        references = [v.valueReference]
        try:
            get = self._method("get", v)
            return tuple(map(float, get(references) if self.fmi2 else get(references, _count(v))))
        except Exception as e:
            raise Finding(f"{v.name} (value reference {v.valueReference}) cannot be read: {e}") from None

    def set(self, v: Any, values: Sequence[float]) -> None:
        """Set all elements of a variable."""
        try:
            self._method("set", v)([v.valueReference], list(values))
        except Exception as e:
            what = f"{v.name} (value reference {v.valueReference}) cannot be set to {values[0]:g}"
            raise Finding(f"{what}: {e}") from None

    def derivative(self, unknown: Any, known: Any) -> float:
        """Read one directional derivative, with seed 1."""
        what = f"the directional derivative of {unknown.name} with respect to {known.name} cannot be read"
        references = [unknown.valueReference], [known.valueReference], [1.0]
        return float(self.call(what, "getDirectionalDerivative", *references)[0])


class ForeignFmu:
    """An unpacked foreign FMU.

    Parameters
    ----------
    folder : Path
        Folder of the unpacked FMU.
    description : ModelDescription
        Model description read by fmpy.

    Attributes
    ----------
    with_derivatives : set of str
        Interfaces that provide directional derivatives: "CoSimulation", "ModelExchange".
    """

    def __init__(self, folder: Path, description: Any) -> None:
        self.folder, self.description = folder, description
        self.variables = [v for v in description.modelVariables if v.type not in ("String", "Binary", "Clock")]
        self.outputs = [v for v in self.variables if v.causality == "output"]
        self.inputs = [v for v in self.variables if v.causality == "input" and v.type in ("Real", "Float64")]
        flag = "providesDirectionalDerivative" + ("" if description.fmiVersion.startswith("2") else "s")
        self._ranges: dict[Any, tuple[float, float, float, Values]] = {}  # phase, bounds, start values of an input
        root = ET.parse(folder / "modelDescription.xml").getroot()
        # fmpy reads the attribute name of FMI 2.0 in both standards
        self.with_derivatives = {e.tag for e in root if e.get(flag) in ("true", "1")}
        experiment = description.defaultExperiment
        self.t0 = float(experiment.startTime or 0) if experiment else 0.0
        self.h = float(experiment.stepSize or 1e-3) if experiment else 1e-3

    @contextmanager
    def instance(self, exchange: bool = False) -> Iterator[Instance]:
        """Create an instance in Initialization Mode; it is freed at the end, also after a finding."""
        made = Instance(self.folder, self.description, exchange)
        try:
            made.initialize(self.t0)
            yield made
        finally:
            made.unit.freeInstance()

    @contextmanager
    def running(self) -> Iterator[Instance]:
        """Create an instance and leave Initialization Mode."""
        with self.instance() as made:
            made.call("leaving Initialization Mode", "exitInitializationMode")
            yield made

    def start(self, v: Any) -> Values:
        """Return the start value in the model description, one number per element."""
        values = [float({"true": 1, "false": 0}.get(w, w)) for w in str(v.start).split()]
        return tuple(values * _count(v) if len(values) == 1 else values)

    def excitation(self, v: Any, k: int, off: float = 0.0) -> Values:
        """Return row k of the excitation of an input, shifted by `off`: a modulated oscillation within its range.

        Every input has its own phase, because equal inputs would hide a dependency on their difference.
        """
        if v not in self._ranges:
            low = float(v.min) if v.min is not None else -math.inf
            high = float(v.max) if v.max is not None else math.inf
            self._ranges[v] = 2.4 * self.inputs.index(v), low, high, self.start(v)
        phase, low, high, start = self._ranges[v]
        swing = math.sin(0.7 * k + phase) * math.cos(0.11 * k)
        return tuple([min(max(min(max(x + swing, low), high) + off, low), high) for x in start])

    def read(self, made: Instance) -> Values:
        """Read all elements of all outputs."""
        return tuple([x for v in self.outputs for x in made.get(v)])

    def step(self, made: Instance, k: int, row: int | None = None, h: float | None = None) -> Values:
        """Set row k (or `row`) of the inputs, make step k (of length h), read the outputs."""
        for v in self.inputs:
            made.set(v, self.excitation(v, k if row is None else row))
        made.call(f"step {k + 1}", "doStep", self.t0 + k * self.h, self.h if h is None else h)
        return self.read(made)

    def run(
        self, made: Instance, rows: Sequence[int], between: Callable[[Instance, Values], None] | None = None
    ) -> list[Values]:
        """Run the steps `rows` and return their outputs; `between` is called after every step with its outputs."""
        out = []
        for k in rows:
            out.append(self.step(made, k))
            if between:
                between(made, out[-1])
        return out

    def difference(self, want: Sequence[Values], got: Sequence[Values], first: int = 0) -> str:
        """Describe the first output that differs in its bits; "" if all are equal."""
        names = [v.name for v in self.outputs for _ in range(_count(v))]
        for k, (a, b) in enumerate(zip(want, got, strict=True)):
            for name, x, y in zip(names, a, b, strict=True):
                if struct.pack("d", x) != struct.pack("d", y):
                    return f"{name} is {y!r} instead of {x!r} after step {first + k + 1}"
        return ""
