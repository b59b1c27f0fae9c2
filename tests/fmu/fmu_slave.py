"""An FMU of either version in fmpy: rows of inputs in, rows of outputs out."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave, defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi3 import FMU3Slave
from fmu_master import unpack


class Slave:
    """An instance for Co-Simulation; `fmu` is an archive, which is unpacked into `folder`, or a folder.

    `events` asks for Event Mode, which FMI 2.0 does not have in Co-Simulation; `silent` drops the log of FMI 2.0.
    The attribute `fmu` is fmpy's instance.
    """

    def __init__(self, fmu: Path, folder: Path | None = None, events: bool = False, silent: bool = False) -> None:
        folder = unpack(fmu, folder) if folder else fmu
        self.description = read_model_description(str(folder), validate=False)
        self.fmi = int(self.description.fmiVersion[0])
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.inputs = [n for n, v in self.variables.items() if v.causality == "input"]
        real = ("Real", "Float64")
        self.outputs = [n for n, v in self.variables.items() if v.causality == "output" and v.type in real]
        self.fmu: Any = (FMU2Slave if self.fmi == 2 else FMU3Slave)(
            guid=self.description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="i",
        )
        more: dict[str, Any] = {"eventModeUsed": True} if events and self.fmi == 3 else {}
        if silent:
            more["callbacks"] = fmi2CallbackFunctions(
                logger=fmi2CallbackLoggerTYPE(lambda *_: None),
                allocateMemory=defaultCallbacks.allocateMemory,
                freeMemory=defaultCallbacks.freeMemory,
            )
        self.fmu.instantiate(**more)

    def write(self, row: Mapping[str, float] | Sequence[float]) -> None:
        """Set the elements of all inputs, or single variables by name."""
        given = row if isinstance(row, Mapping) else None
        names, values = (list(given), list(given.values())) if given is not None else (self.inputs, list(row))
        if values:
            references = [self.variables[n].valueReference for n in names]
            (self.fmu.setReal if self.fmi == 2 else self.fmu.setFloat64)(references, [float(x) for x in values])

    def read(self, names: Sequence[str] | None = None) -> list[float]:
        """Read the elements of all outputs of real numbers, or of variables by name."""
        some = [self.variables[n] for n in (self.outputs if names is None else names)]
        size = [] if self.fmi == 2 else [sum(int(np.prod(v.shape or 1)) for v in some)]
        return list(
            (self.fmu.getReal if self.fmi == 2 else self.fmu.getFloat64)([v.valueReference for v in some], *size)
        )

    def start(self, row: Mapping[str, float] | Sequence[float] = ()) -> list[float]:
        """Initialise with these inputs; the outputs."""
        if self.fmi == 2:
            self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.write(row)
        self.fmu.exitInitializationMode()
        return self.read()

    def step(self, t: float, h: float, row: Mapping[str, float] | Sequence[float] = ()) -> list[float]:
        """Set inputs and make a step from t to t + h; the outputs."""
        self.write(row)
        self.fmu.doStep(t, h)
        return self.read()

    def save(self) -> bytes:
        """Serialize the present state."""
        if self.fmi == 2:
            return bytes(self.fmu.serializeFMUstate(self.fmu.getFMUstate()))
        return bytes(self.fmu.serializeFMUState(self.fmu.getFMUState()))

    def restore(self, content: bytes) -> None:
        """Continue from a serialized state of another instance."""
        if self.fmi == 2:
            self.fmu.setFMUstate(self.fmu.deSerializeFMUstate(content))
        else:
            self.fmu.setFMUState(self.fmu.deserializeFMUState(content))

    def free(self) -> None:
        self.fmu.terminate()
        self.fmu.freeInstance()
