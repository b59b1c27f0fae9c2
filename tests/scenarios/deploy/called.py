"""Call an exported controller as a target does: set what was measured, make a step, read the command."""

import shutil
import subprocess
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import fmpy
import numpy as np
from fmu_slave import Slave
from numpy.typing import NDArray

Array = NDArray[np.float64]
STRICT = ["-Wall", "-Wextra", "-Werror", "-ffp-contract=off", "-fno-math-errno"]


class Called(Slave):
    """An instance of a controller FMU."""

    def __init__(self, fmu: Path, folder: Path) -> None:
        super().__init__(fmu, folder)
        self.h = float(self.description.defaultExperiment.stepSize)
        self.k = 0

    def command(self, values: Mapping[str, float]) -> float:
        """Initialise with the first measurement; the first command."""
        self.k = 0
        self.start(values)
        return self.read(["u"])[0]

    def sample(self, values: Mapping[str, float]) -> float:
        """The command for a new measurement."""
        self.step(self.k * self.h, self.h, values)
        self.k += 1
        return self.read(["u"])[0]

    def run(self, columns: Mapping[str, Array]) -> Array:
        rows = [dict(zip(columns, row, strict=True)) for row in np.column_stack(list(columns.values())).tolist()]
        return np.array([self.command(rows[0]), *map(self.sample, rows[1:])])


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
    called.free()
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
