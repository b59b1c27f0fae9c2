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
SOURCE = Path(__file__).with_suffix(".c").read_text()
# the other functions of Co-Simulation do nothing
_EXCHANGE = r"Functions for FMI2 for Model Exchange.*?Functions for FMI2 for Co-Simulation"
_DECLARED = re.sub(_EXCHANGE, "", (HEADERS / "fmi2Functions.h").read_text(), flags=re.DOTALL)
_NAMES = set(re.findall(r"FMI2_Export \w+\s+(\w+);", _DECLARED)) - set(re.findall(r"\b(fmi2\w+)\(", SOURCE))
SOURCE += "".join(f"int {name}(void) {{ return 0; }}\n" for name in sorted(_NAMES))
SLEEPS, SPINS = "for (;;) sleep(1)", "for (;;)"
# the scenario of a folder with bad.fmu
LOOP: dict[str, Any] = {
    "name": "bad", "step": 1e-3, "stop": 0.01, "order": ["command", "bad"],
    "units": {"command": {"block": "disturbance"}, "bad": {"fmu": "bad.fmu"}}, "connections": {"bad.u": "command.d"},
    "metrics": {"last": {"kind": "final", "signal": "bad.y"}},
}  # fmt: skip
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
    path: Path, defect: str = "", limit: float = 0.5, extra: str = "", *options: str, description: str = DESCRIPTION
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
    source.write_text(SOURCE.replace("/* EXTRA */", extra, 1))
    flags = ["-shared", "-fPIC", f"-DDEFECT={defect}", f"-DLIMIT={limit}", f"-I{HEADERS}", *options]
    subprocess.run([compiler, *flags, str(source), "-o", str(library)], check=True)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(library, f"binaries/{fmpy.platform}/bad.so")
