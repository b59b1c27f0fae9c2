"""A container of foreign units under AddressSanitizer and UBSan: random calls, and damaged files of its system."""

import random
import subprocess
from pathlib import Path
from typing import Any

import compiled
import fmpy
import pytest
import tomli_w
from drawn_unit import LETTERS, Variable, drawn_fmu, library, value

from hystfmu.scenario import Cases
from hystfmu.scenario.ssp.write import write_loop

HERE = Path(__file__).parent
CONTAINER = [
    *sorted(compiled.CORE.rglob("*.c")),
    *sorted((compiled.FMU_BUILD / "master").glob("*.c")),
    *sorted((compiled.FMU_BUILD / "container").glob("*.c")),
    *(f for f in sorted((compiled.FMI / "files").glob("*.c")) if f.name != "open_file.c"),  # the driver has its own
]


def every_type(fmi: int, rng: random.Random) -> tuple[list[Variable], dict[str, Any]]:
    """An FMU with a parameter, an input and an output of each type, and what a scenario sets."""
    made, given = [], {}
    for kind in LETTERS[fmi]:
        made.append(Variable(f"p{kind}", kind, "parameter", (value(rng, kind, exact=False),)))
        given[f"p{kind}"] = value(rng, kind)
        made += [Variable(f"u{kind}", kind, "input", (value(rng, kind, exact=False),))]
        made += [Variable(f"v{kind}", kind, "input", (value(rng, kind, exact=False),))]
        made += [Variable(f"y{kind}", kind, "output", (value(rng, kind, exact=False),))]
    if fmi == 3:
        made.insert(0, Variable("n", "UInt64", "structuralParameter", (2,)))
        made += [Variable("pn", "Float32", "parameter", (0.5, 0.25), 0), Variable("un", "Int8", "input", (1, 2), 0)]
        given |= {"n": 3, "pn": [0.1, 0.2, 0.3]}
    return made, given


@pytest.fixture
def box(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An unpacked container of two units with variables of all types, whose binaries are sanitized as well."""
    monkeypatch.setenv("HYSTFMU_CACHE", str(tmp_path / "cache"))
    rng, folder = random.Random(1), tmp_path / "drawn"
    folder.mkdir()
    reference = {"shape": "sine", "amplitude": 3.0, "frequency": 60.0}
    units: dict[str, Any] = {"reference": {"block": "reference", "values": reference}}
    connections = {}
    for fmi in (2, 3):
        variables, given = every_type(fmi, rng)
        drawn_fmu(folder / f"x{fmi}.fmu", fmi, variables)
        units[f"x{fmi}"] = {"fmu": f"x{fmi}.fmu", "set": given}
        for kind in LETTERS[fmi]:
            if kind not in ("String", "Enumeration") and not kind.startswith("U"):
                connections[f"x{fmi}.u{kind}"] = "reference.r"
    connections |= {"x3.un_2": "reference.r", "x3.uUInt16": "x3.yUInt8", "x3.vBoolean": "x2.yBoolean"}
    data = {
        "name": "box",
        "step": 1e-3,
        "stop": 1.0,
        "order": list(units),
        "units": units,
        "connections": connections,
        "metrics": {"p": {"kind": "final", "signal": "x2.yReal"}},
    }
    (folder / "scenario.toml").write_text(tomli_w.dumps(data))
    fmu = write_loop(Cases(folder).cases[0], tmp_path / "box.fmu", 2)
    made = Path(fmpy.extract(str(fmu), str(tmp_path / "box")))
    for fmi in (2, 3):
        (unit,) = (made / "resources" / "units" / f"x{fmi}").rglob("drawn.*")
        unit.write_bytes(library(fmi, *compiled.SANITIZE).read_bytes())
    return made


@pytest.mark.parametrize("calls", [20_000, pytest.param(1_000_000, marks=pytest.mark.stress)])
def test_random_calls_and_damaged_files(box: Path, tmp_path: Path, calls: int) -> None:
    # cc also compiles the units that the program loads: a process can have the runtime of one compiler only
    sources = [*CONTAINER, HERE / "drive_container.c"]
    program = compiled.sanitized(tmp_path / "drive", sources, "-ldl", compilers=["cc"])
    description = fmpy.read_model_description(str(box), validate=False)
    outputs, resources = len(description.modelVariables), box / "resources"
    words = [resources.as_uri(), description.guid, str(resources / "system.txt"), str(outputs), str(calls), "1"]
    done = subprocess.run([str(program), *words], capture_output=True, text=True, timeout=3000)
    assert done.returncode == 0, f"exit {done.returncode}: {done.stderr[-3000:]}"
    instances, steps = (int(word) for word in done.stdout.split() if word.isdigit())
    assert instances > calls // 1000
    assert steps > calls // 10
