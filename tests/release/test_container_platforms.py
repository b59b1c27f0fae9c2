"""The container binary of other platforms: what it needs; a loop with a foreign FMU has the bits of this machine."""

import importlib.util
import sys
from pathlib import Path
from typing import Any

import fmpy
import pytest
import tomli_w
from other_platforms import RUNNERS, loads_on_macos_11, needs_glibc_2_17, needs_windows_alone, run, runner

from hystfmu.fmu import export_fmu
from hystfmu.fmu.write.platforms import PLATFORMS, host
from hystfmu.graph import Graph, Node
from hystfmu.scenario import Cases
from hystfmu.scenario.ssp.write import write_loop

pytestmark = pytest.mark.stress
ROOT = Path(__file__).parents[2]
HOST = ROOT / "tests" / "fmu" / "importers" / "step_host.c"
HEADERS = Path(fmpy.__file__).parent / "c-code"
BUILT = [name for name in PLATFORMS if name != "x86-windows"]
STEP = 1e-3


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The container and the FMU binary of a platform, built once."""
    if importlib.util.find_spec("ziglang") is None:
        pytest.skip("ziglang is not installed: no compiler for the other platforms")
    out, made = tmp_path_factory.mktemp("containers"), dict[str, tuple[Path, Path]]()
    sys.path.insert(0, str(ROOT / "fmu_build" / "platforms"))
    import build
    import cores

    def of(name: str, with_fmu: bool = False) -> tuple[Path, Path]:
        suffix = PLATFORMS[name].suffix
        if name not in made:
            made[name] = cores.build(ROOT / "fmu_build", out, name, "_container"), out / f"{name}.{suffix}"
        if with_fmu and not made[name][1].exists():
            build.build(ROOT / "fmu_build", out, name)
        return made[name]

    return of


@pytest.fixture
def box(tmp_path: Path) -> Path:
    """A loop with a foreign FMU, of which an unpacked container is made."""
    plays = Node("plays", "backlash_sum", {}, {"w0": 0.3, "r": [0.1, 0.2, 0.3], "w": [0.3, 0.2, 0.1]})
    export_fmu(Graph.single(plays), tmp_path / "plays.fmu")
    data = {
        "name": "box",
        "step": STEP,
        "stop": 5.0,
        "order": ["reference", "pid", "fmu", "lag"],
        "units": {
            "reference": {"block": "reference", "values": {"amplitude": 1.0, "frequency": 5.0}},
            "pid": {"block": "pid", "values": {"Kp": 0.5, "Ki": 20.0}, "inputs": {"u_ff": 0.0}},
            "fmu": {"fmu": "plays.fmu"},
            "lag": {"block": "transfer_function", "dims": {"na": 1, "nb": 0}, "values": {"b": [1.0], "a": [1e-2, 1.0]}},
        },
        "connections": {"pid.y_d": "reference.r", "pid.y": "lag.y", "fmu.u": "pid.u", "lag.u": "fmu.y"},
        "record": ["reference.r", "lag.y"],
        "metrics": {"worst": {"kind": "max_percent", "signal": "lag.y", "against": "reference.r", "limit": 100.0}},
        "coupling": {"events": "grid"},
    }
    (tmp_path / "scenario.toml").write_text(tomli_w.dumps(data))
    fmu = write_loop(Cases(tmp_path).cases[0], tmp_path / "box.fmu", 2)
    return Path(fmpy.extract(str(fmu), str(tmp_path / "a box")))  # a path that a URI escapes


def steps(box: Path, program: Path, before: list[str]) -> str:
    """The hash of lag.y over 5000 steps."""
    description = fmpy.read_model_description(str(box), validate=False)
    (output,) = (v.valueReference for v in description.modelVariables if v.name == "lag_y")
    library = next((box / "binaries").rglob("box.*"))
    location = ("file:///Z:" if before[:1] == ["wine"] else "file://") + str(box / "resources").replace(" ", "%20")
    return run(*before, program, library, location, description.guid, "-", output).split()[-1]


@pytest.mark.parametrize("name", [n for n in RUNNERS if n in BUILT])
def test_it_gives_the_bits_of_this_machine(
    built: Any, box: Path, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target, before = runner(name, tmp_path / "wine", monkeypatch)
    flags = ["-std=c99", "-O1", "-ffp-contract=off", f"-I{HEADERS}", str(HOST)]
    run("cc", *flags, "-ldl", "-o", tmp_path / "own")
    want = steps(box, tmp_path / "own", [])
    loads = [] if "windows" in name else ["-ldl"]
    run(sys.executable, "-m", "ziglang", "cc", "-target", target, *flags, *loads, "-o", tmp_path / "host.exe")
    container, fmu = built(name, with_fmu=True)
    old, new = f".{host().suffix}", f".{PLATFORMS[name].suffix}"
    for library in [p for p in box.rglob(f"*{old}") if p.is_file()]:
        library.unlink()
        library.with_suffix(new).write_bytes((container if library.stem == "box" else fmu).read_bytes())
    file = box / "resources" / "system.txt"
    file.write_text(file.read_text().replace(f"{old} ", f"{new} "), newline="\n")
    assert steps(box, tmp_path / "host.exe", before) == want


@pytest.mark.parametrize("name", BUILT)
def test_it_needs_what_every_such_system_has(built: Any, name: str) -> None:
    container, _ = built(name)
    assert container.stat().st_size < 120_000
    if name.endswith("linux"):
        assert needs_glibc_2_17(container) <= {"libc.so.6", "libdl.so.2"}
    elif name.endswith("windows"):
        needs_windows_alone(container)
    else:
        loads_on_macos_11(container, name.startswith("aarch64"))
