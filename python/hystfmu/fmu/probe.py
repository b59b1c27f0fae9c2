"""The child process of `check_fmu`: loads an unpacked FMU with fmpy, steps it, writes the problems it saw as JSON."""

from __future__ import annotations

import json
import math
import shutil
import struct
import sys
from pathlib import Path
from typing import Any

STEPS = 100


class _Slave:
    """An FMI 2.0 or 3.0 instance behind the few calls that the check needs."""

    def __init__(self, folder: str, description: Any) -> None:
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        self.fmi2 = description.fmiVersion.startswith("2")
        kind = FMU2Slave if self.fmi2 else FMU3Slave
        self.unit = kind(
            guid=description.guid,
            modelIdentifier=description.coSimulation.modelIdentifier,
            unzipDirectory=folder,
            instanceName="check",
        )
        self.unit.instantiate()

    def initialize(self, t: float) -> None:
        if self.fmi2:
            self.unit.setupExperiment(startTime=t)
            self.unit.enterInitializationMode()
        else:
            self.unit.enterInitializationMode(startTime=t)

    def _name(self, v: Any) -> str:
        return ("Integer" if self.fmi2 else "Int64") if v.type == "Enumeration" else str(v.type)

    def get(self, v: Any, n: int = 1) -> list[float]:
        get = getattr(self.unit, f"get{self._name(v)}")
        return [float(x) for x in (get([v.valueReference]) if self.fmi2 else get([v.valueReference], nValues=n))]

    def set(self, v: Any, values: list[float]) -> None:
        getattr(self.unit, f"set{self._name(v)}")([v.valueReference], values)


def _start(v: Any) -> list[float]:
    words = str(v.start).split()
    return [float({"true": 1, "false": 0}.get(w, w)) for w in words]


def _count(v: Any) -> int:
    return math.prod(v.shape) if v.shape else 1


def _excitation(v: Any, start: list[float], k: int) -> list[float]:
    """An input that moves back and forth with growing and shrinking swings, inside its range."""
    low = float(v.min) if v.min is not None else -math.inf
    high = float(v.max) if v.max is not None else math.inf
    return [min(max(x + math.sin(0.7 * k) * math.cos(0.11 * k), low), high) for x in start]


def probe(folder: str) -> list[str]:
    """Problems seen while loading and stepping the FMU unpacked in `folder`."""
    from fmpy import platform, platform_tuple, read_model_description

    description = read_model_description(folder, validate=False)
    if description.coSimulation is None:
        return ["the FMU has no co-simulation interface: it was not run"]
    host = platform if description.fmiVersion.startswith("2") else platform_tuple
    if not Path(folder, "binaries", host).is_dir():
        return [f"the FMU has no binary for this platform ({host}): it was not run"]
    scalar = [v for v in description.modelVariables if v.type not in ("String", "Binary", "Clock")]
    experiment = description.defaultExperiment
    t0 = float(experiment.startTime or 0) if experiment else 0.0
    h = float(experiment.stepSize or 1e-3) if experiment else 1e-3
    slave = _Slave(folder, description)
    slave.initialize(t0)
    problems = []
    for v in scalar:
        if v.causality in ("input", "parameter") and v.start is not None:
            read, start = slave.get(v, _count(v)), _start(v)
            start = start * len(read) if len(start) == 1 else start
            if read != start:
                problems.append(f"{v.name}: the start value is {v.start}, but the binary has {read}"[:300])
    slave.unit.exitInitializationMode()
    outputs = [v for v in scalar if v.causality == "output"]
    inputs = [(v, slave.get(v, _count(v))) for v in scalar if v.causality == "input" and v.type in ("Real", "Float64")]

    def step(k: int) -> list[float]:
        for v, start in inputs:
            slave.set(v, _excitation(v, start, k))
        slave.unit.doStep(t0 + k * h, h)
        values = [slave.get(v, _count(v)) for v in outputs]
        for v, value in zip(outputs, values, strict=True):
            if not all(map(math.isfinite, value)) and not problems:
                problems.append(f"{v.name} is {value} after step {k + 1}")
        return [x for value in values for x in value]

    for k in range(STEPS // 2):
        step(k)
    capabilities = description.coSimulation
    restores, serializes = capabilities.canGetAndSetFMUstate, capabilities.canSerializeFMUstate
    state = slave.unit.getFMUState() if restores else None
    if restores and serializes:
        saved = slave.unit.serializeFMUState(state)
        slave.unit.freeFMUState(state)
    first = [step(k) for k in range(STEPS // 2, STEPS)]
    if restores:
        if serializes:
            state = slave.unit.deserializeFMUState(saved)
        slave.unit.setFMUState(state)
        slave.unit.freeFMUState(state)
        second = [step(k) for k in range(STEPS // 2, STEPS)]
        for k, (a, b) in enumerate(zip(first, second, strict=True)):
            if struct.pack(f"{len(a)}d", *a) != struct.pack(f"{len(b)}d", *b):
                problems.append(f"after restoring a saved state, step {STEPS // 2 + k + 1} gives other outputs")
                break
    slave.unit.terminate()
    slave.unit.freeInstance()
    return problems


def main() -> None:
    """``python -m hystfmu.fmu.probe FOLDER RESULT``."""
    folder, result = sys.argv[1:]
    try:
        problems = probe(folder)
    except Exception as e:  # whatever a foreign FMU provokes is a finding
        problems = [f"the FMU cannot be run: {' '.join(str(e).split())}"]
    temporary = Path(result).with_suffix(".part")
    temporary.write_text(json.dumps(problems))
    shutil.move(temporary, result)


if __name__ == "__main__":
    main()
