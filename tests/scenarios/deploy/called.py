"""Call an exported controller as a target does: set what was measured, make a step, read the command."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import fmpy
import numpy as np
from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from numpy.typing import NDArray

Array = NDArray[np.float64]
STRICT = ["-Wall", "-Wextra", "-Werror", "-ffp-contract=off", "-fno-math-errno"]


class Called:
    """An instance of a controller FMU."""

    def __init__(self, fmu: Path, folder: Path) -> None:
        self.folder = folder
        with zipfile.ZipFile(fmu) as archive:
            archive.extractall(folder)
        self.description = read_model_description(str(folder))
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.fmi = int(self.description.fmiVersion[0])
        self.h = float(self.description.defaultExperiment.stepSize)
        kind = FMU2Slave if self.fmi == 2 else FMU3Slave
        self.slave = kind(
            guid=self.description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="controller",
        )
        self.slave.instantiate()
        two = self.fmi == 2
        self._get, self._set = [getattr(self.slave, f"{verb}{'Real' if two else 'Float64'}") for verb in ("get", "set")]
        self.k = 0

    @property
    def inputs(self) -> list[str]:
        return [name for name, v in self.variables.items() if v.causality == "input"]

    def write(self, values: Mapping[str, float]) -> None:
        for name, value in values.items():
            self._set([self.variables[name].valueReference], [float(value)])

    def read(self, name: str = "u") -> float:
        return float(self._get([self.variables[name].valueReference])[0])

    def start(self, values: Mapping[str, float]) -> float:
        """Initialise with the first measurement; the first command."""
        self.k = 0
        if self.fmi == 2:
            self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.write(values)
        self.slave.exitInitializationMode()
        return self.read()

    def sample(self, values: Mapping[str, float]) -> float:
        """The command for a new measurement."""
        self.write(values)
        self.slave.doStep(self.k * self.h, self.h)
        self.k += 1
        return self.read()

    def run(self, columns: Mapping[str, Array]) -> Array:
        rows = [dict(zip(columns, row, strict=True)) for row in np.column_stack(list(columns.values())).tolist()]
        return np.array([self.start(rows[0]), *map(self.sample, rows[1:])])

    def close(self) -> None:
        self.slave.terminate()
        self.slave.freeInstance()


def built_from_source(fmu: Path, folder: Path) -> Path:
    """The same FMU with a binary that a compiler makes of the C file in it."""
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    (source,) = (folder / "sources").glob("*.c")
    (binary,) = (folder / "binaries").rglob(f"*{fmpy.sharedLibraryExtension}")
    binary.unlink()
    headers = f"-isystem{Path(fmpy.__file__).parent / 'c-code'}"
    command = ["cc", "-std=c99", "-O2", "-shared", "-fPIC", *STRICT, headers, str(source), "-o", str(binary)]
    subprocess.run(command, check=True, timeout=200)
    return Path(shutil.make_archive(str(folder), "zip", folder))


def same_bits(make: Callable[[], Called], columns: Mapping[str, Array], want: Array) -> None:
    """The commands of an instance have the bits of the recorded ones."""
    called = make()
    got = called.run({name: column for name, column in columns.items() if name in called.inputs})
    called.close()
    off = np.flatnonzero(got != want)
    assert got.tobytes() == want.tobytes(), f"{len(off)} of {len(want)} differ, the first in row {off[:1]}"


MAIN = """
#include <stdio.h>
#include "{name}.h"
int main(void) {{
  {name}_inputs in = {name}_INPUTS;
  double u, row[{n}];
  for (int k = 0; fread(row, sizeof *row, {n}, stdin) == {n}; k++) {{
    {sets}
    if (k ? {name}_step(&in, &u) : {name}_start(&in, &u)) return 1;
    fwrite(&u, sizeof u, 1, stdout);
  }}
  return 0;
}}
"""


def run_on_target(folder: Path, name: str, columns: Mapping[str, Array], compiler: Sequence[str]) -> Array:
    """Commands of the C form in a program that has neither FMI nor an allocator."""
    sets = " ".join(f"in.{port} = row[{k}];" for k, port in enumerate(columns))
    (folder / "main.c").write_text(MAIN.format(name=name, n=len(columns), sets=sets))
    sources = [str(folder / f"{name}.c"), str(folder / "main.c")]
    command = [*compiler, "-O2", "-Wpedantic", *STRICT, *sources, "-o", str(folder / "program")]
    subprocess.run(command, check=True, timeout=200)
    rows = np.ascontiguousarray(np.column_stack(list(columns.values())))
    done = subprocess.run([str(folder / "program")], input=rows.tobytes(), capture_output=True, check=True, timeout=200)
    return np.frombuffer(done.stdout)
