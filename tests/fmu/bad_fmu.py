"""A small foreign FMU of FMI 2.0, compiled in a test, that does what an FMU must not do."""

import re
import shutil
import subprocess
import zipfile
from pathlib import Path
from typing import Any

import fmpy
import pytest

HEADERS = Path(fmpy.__file__).parent / "c-code"
SOURCE = r"""
#include <stdlib.h>
#include <unistd.h>
#include "fmi2FunctionTypes.h"
#include "fmi2TypesPlatform.h"
static double u, y;
static fmi2Status got = fmi2OK; /* what reading returns */
EXTRA
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return "2.0"; }
fmi2Component fmi2Instantiate(fmi2String a, fmi2Type b, fmi2String c, fmi2String d, const fmi2CallbackFunctions *e,
                              fmi2Boolean f, fmi2Boolean g) {
  (void)a, (void)b, (void)c, (void)d, (void)e, (void)f, (void)g;
  return &u;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Real x[]) {
  (void)c, (void)v;
  if (n) u = x[0];
  return fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2Real x[]) {
  (void)c;
  if (n) x[0] = v[0] ? y : u;
  return got;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean b) {
  (void)c, (void)h, (void)b;
  if (t > 0.004 && u > LIMIT) DEFECT;
  y = u;
  return fmi2OK;
}
#ifndef FREE
#define FREE
#endif
void fmi2FreeInstance(fmi2Component c) {
  (void)c;
  FREE
}
"""
# the other functions of Co-Simulation do nothing
_EXCHANGE = r"Functions for FMI2 for Model Exchange.*?Functions for FMI2 for Co-Simulation"
_DECLARED = re.sub(_EXCHANGE, "", (HEADERS / "fmi2Functions.h").read_text(), flags=re.DOTALL)
_NAMES = set(re.findall(r"FMI2_Export \w+\s+(\w+);", _DECLARED)) - set(re.findall(r"\b(fmi2\w+)\(", SOURCE))
SOURCE += "".join(f"int {name}(void) {{ return 0; }}\n" for name in sorted(_NAMES))
SLEEPS, SPINS = "for (;;) sleep(1)", "for (;;)"
# the scenario of a folder with bad.fmu
LOOP: dict[str, Any] = {
    "name": "bad",
    "step": 1e-3,
    "stop": 0.01,
    "order": ["command", "bad"],
    "units": {"command": {"block": "disturbance"}, "bad": {"fmu": "bad.fmu"}},
    "connections": {"bad.u": "command.d"},
    "metrics": {"last": {"kind": "final", "signal": "bad.y"}},
}
DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="bad" guid="bad">
  <CoSimulation modelIdentifier="bad" canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="1" causality="output"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2"/></Outputs>
    <InitialUnknowns><Unknown index="2"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""


def bad_fmu(
    path: Path,
    defect: str = "",
    limit: float = 0.5,
    extra: str = "",
    *options: str,
    description: str = DESCRIPTION,
) -> None:
    """Compile an FMU that does something terrible after 4 ms when its input is above the limit; else y = u.

    Parameters
    ----------
    path : Path
        The FMU; its platform is that of this machine.
    defect : str
        A statement in C.
    limit : float
    extra : str
        Declarations and functions in C.
    *options : str
        Of the compiler.  `-DFREE=...` gives statements in C that freeing an instance executes.
    description : str
        The model description.
    """
    if fmpy.platform not in ("linux64", "darwin64"):
        pytest.skip("builds a shared library for Linux or macOS")
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("needs a C compiler")
    source, library = path.with_suffix(".c"), path.with_suffix(".so")
    source.write_text(SOURCE.replace("EXTRA", extra, 1))
    flags = ["-shared", "-fPIC", f"-DDEFECT={defect}", f"-DLIMIT={limit}", f"-I{HEADERS}", *options]
    subprocess.run([compiler, *flags, str(source), "-o", str(library)], check=True)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(library, f"binaries/{fmpy.platform}/bad.so")
