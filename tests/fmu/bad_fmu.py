"""A small foreign FMU of FMI 2.0, compiled in a test, that does what an FMU must not do."""

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
#include "fmi2Functions.h"
static double u, y;
static fmi2Status got = fmi2OK; /* what reading returns */
EXTRA
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
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
#define STUB(name, ...) fmi2Status name(__VA_ARGS__) { return fmi2OK; }
STUB(fmi2SetupExperiment, fmi2Component c, fmi2Boolean a, fmi2Real b, fmi2Real d, fmi2Boolean e, fmi2Real f)
STUB(fmi2EnterInitializationMode, fmi2Component c)
STUB(fmi2ExitInitializationMode, fmi2Component c)
STUB(fmi2Terminate, fmi2Component c)
STUB(fmi2Reset, fmi2Component c)
STUB(fmi2SetDebugLogging, fmi2Component c, fmi2Boolean a, size_t n, const fmi2String s[])
STUB(fmi2GetInteger, fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2Integer x[])
STUB(fmi2GetBoolean, fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2Boolean x[])
STUB(fmi2GetString, fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2String x[])
STUB(fmi2SetInteger, fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Integer x[])
STUB(fmi2SetBoolean, fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Boolean x[])
STUB(fmi2SetString, fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2String x[])
STUB(fmi2GetFMUstate, fmi2Component c, fmi2FMUstate *s)
STUB(fmi2SetFMUstate, fmi2Component c, fmi2FMUstate s)
STUB(fmi2FreeFMUstate, fmi2Component c, fmi2FMUstate *s)
STUB(fmi2SerializedFMUstateSize, fmi2Component c, fmi2FMUstate s, size_t *n)
STUB(fmi2SerializeFMUstate, fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n)
STUB(fmi2DeSerializeFMUstate, fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s)
STUB(fmi2GetDirectionalDerivative, fmi2Component c, const fmi2ValueReference a[], size_t n,
     const fmi2ValueReference b[], size_t m, const fmi2Real x[], fmi2Real y[])
STUB(fmi2SetRealInputDerivatives, fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Integer o[],
     const fmi2Real x[])
STUB(fmi2GetRealOutputDerivatives, fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Integer o[],
     fmi2Real x[])
STUB(fmi2CancelStep, fmi2Component c)
STUB(fmi2GetStatus, fmi2Component c, const fmi2StatusKind k, fmi2Status *s)
STUB(fmi2GetRealStatus, fmi2Component c, const fmi2StatusKind k, fmi2Real *s)
STUB(fmi2GetIntegerStatus, fmi2Component c, const fmi2StatusKind k, fmi2Integer *s)
STUB(fmi2GetBooleanStatus, fmi2Component c, const fmi2StatusKind k, fmi2Boolean *s)
STUB(fmi2GetStringStatus, fmi2Component c, const fmi2StatusKind k, fmi2String *s)
"""
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
    include = next(HEADERS.rglob("fmi2Functions.h")).parent
    source, library = path.with_suffix(".c"), path.with_suffix(".so")
    source.write_text(SOURCE.replace("EXTRA", extra, 1))
    flags = ["-shared", "-fPIC", f"-DDEFECT={defect}", f"-DLIMIT={limit}", f"-I{include}", *options]
    subprocess.run([compiler, *flags, str(source), "-o", str(library)], check=True)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(library, f"binaries/{fmpy.platform}/bad.so")
