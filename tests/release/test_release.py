"""The files of `make release` in dist/: what wheels hold and need, and their cores by vectors on other systems.

The core of Windows runs under wine, that of arm64 Linux under qemu-user; those of macOS are inspected, not run.
"""

import base64
import hashlib
import importlib.util
import json
import os
import re
import struct
import sys
import tarfile
import tomllib
import zipfile
from datetime import datetime
from email.parser import Parser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from other_platforms import RUNNERS, loads_on_macos_11, needs_glibc_2_17, needs_windows_alone, run, runner

import hystfmu
from hystfmu.base.arrays import Array
from hystfmu.fmu.write.platforms import PLATFORMS
from hystfmu.graph import Graph, Node

pytestmark = pytest.mark.stress
ROOT = Path(__file__).parents[2]
DIST = ROOT / "dist"
WHEELS = {
    "x86_64-windows": ("win_amd64", "dll"),
    "x86_64-linux": ("manylinux2014_x86_64.manylinux_2_17_x86_64", "so"),
    "aarch64-linux": ("manylinux2014_aarch64.manylinux_2_17_aarch64", "so"),
    "x86_64-darwin": ("macosx_11_0_x86_64", "dylib"),
    "aarch64-darwin": ("macosx_11_0_arm64", "dylib"),
}


def wheel(name: str) -> Path:
    """The wheel of a platform."""
    path = DIST / f"hystfmu-{hystfmu.__version__}-py3-none-{WHEELS[name][0]}.whl"
    if not path.exists():
        pytest.skip(f"no {path.name} in dist: 'make release' makes it")
    commit = os.environ.get("SOURCE_DATE_EPOCH") or run("git", "-C", ROOT, "log", "-1", "--format=%ct").strip()
    made = json.loads(sbom_file().read_text())["metadata"]["timestamp"]
    if datetime.fromisoformat(made).timestamp() != int(commit):
        pytest.skip(f"dist is of another commit, of {made}: 'make release' makes it anew")
    return path


def core(name: str, folder: Path) -> Path:
    """The core out of a wheel."""
    with zipfile.ZipFile(wheel(name)) as archive:
        return Path(archive.extract(f"hystfmu/_core.{WHEELS[name][1]}", folder))


@pytest.mark.parametrize("name", WHEELS)
def test_a_wheel_holds_all_that_it_needs(name: str) -> None:
    with zipfile.ZipFile(wheel(name)) as archive:
        names = archive.namelist()
        times = {e.date_time for e in archive.infolist()}
        info = f"hystfmu-{hystfmu.__version__}.dist-info"
        record = dict(line.split(",", 1) for line in archive.read(f"{info}/RECORD").decode().splitlines())
        assert sorted(record) == sorted(names)
        for file in names:
            digest = base64.urlsafe_b64encode(hashlib.sha256(archive.read(file)).digest()).decode().rstrip("=")
            assert record[file].startswith(f"sha256={digest},") or file == f"{info}/RECORD"
        tags = re.findall(r"^Tag: (.*)$", archive.read(f"{info}/WHEEL").decode(), re.MULTILINE)
        assert sorted(tags) == sorted(f"py3-none-{t}" for t in WHEELS[name][0].split("."))
        assert archive.read(f"{info}/sboms/hystfmu-{hystfmu.__version__}.cdx.json") == sbom_file().read_bytes()
    assert len(times) == 1  # that of the commit
    own = [n for n in names if re.match(r"hystfmu/_(container|core|fmu)\.", n)]
    assert sorted(own) == [f"hystfmu/_container.{WHEELS[name][1]}", f"hystfmu/_core.{WHEELS[name][1]}"]
    binaries = {f"hystfmu/_platforms/{p.tuple3}.{p.suffix}" for p in PLATFORMS.values()}
    binaries.add("hystfmu/_platforms/darwin64.dylib")
    assert binaries | {f"{b}.deflate" for b in binaries} <= set(names)
    trees = {"python/hystfmu": ("hystfmu", ".py"), "modelica/HystFMU": ("hystfmu/_modelica/HystFMU", "")}
    trees["scenarios"] = ("hystfmu/_scenarios", ".toml")
    listed = run("git", "-C", ROOT, "ls-files", *trees).splitlines()
    assert len(listed) > 500
    for path in map(Path, listed):
        top = next(t for t in trees if path.is_relative_to(t))
        to, suffix = trees[top]
        assert not path.name.endswith(suffix) or f"{to}/{path.relative_to(top).as_posix()}" in names


def sbom_file() -> Path:
    return DIST / f"hystfmu-{hystfmu.__version__}.cdx.json"


def test_the_list_of_parts_is_that_of_the_files() -> None:
    wheel("x86_64-linux")
    found = json.loads(sbom_file().read_text())
    assert (found["bomFormat"], found["specVersion"]) == ("CycloneDX", "1.6")
    references = [c["bom-ref"] for c in found["components"]]
    assert len(set(references)) == len(references)
    assert found["dependencies"][0]["dependsOn"] == references
    hashes = {c["name"]: c["hashes"][0]["content"] for c in found["components"] if c["type"] == "file"}
    for name, (_, suffix) in WHEELS.items():
        with zipfile.ZipFile(wheel(name)) as archive:
            parts = {n: n for n in archive.namelist() if re.fullmatch(r"hystfmu/_platforms/.*\.(so|dll|dylib)", n)}
            for own in ("_container", "_core"):
                parts[f"hystfmu/{own}.{suffix} of {name}"] = f"hystfmu/{own}.{suffix}"
            for listed, file in parts.items():
                assert hashes[listed] == hashlib.sha256(archive.read(file)).hexdigest()
    needed = [p["value"] for c in found["components"] for p in c.get("properties", [])]
    with zipfile.ZipFile(wheel("x86_64-linux")) as archive:
        metadata = archive.read(f"hystfmu-{hystfmu.__version__}.dist-info/METADATA").decode()
    stated = [r for r in Parser().parsestr(metadata).get_all("Requires-Dist", []) if "extra" not in r]
    assert len(needed) == len(stated) > 5


def test_checksums_and_sdist() -> None:
    wheel("x86_64-linux")
    lines = (DIST / "SHA256SUMS").read_text().splitlines()
    sums = {name: digest for digest, name in (line.split("  ") for line in lines)}
    assert sums == {
        p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in DIST.iterdir() if p.name != "SHA256SUMS"
    }
    with tarfile.open(DIST / f"hystfmu-{hystfmu.__version__}.tar.gz") as archive:
        names = {"/".join(n.split("/")[1:]) for n in archive.getnames()}
    kept = ("fmu_build", "python", "modelica", "scenarios")
    assert set(run("git", "-C", ROOT, "ls-files", *kept).splitlines()) <= names
    assert {"CMakeLists.txt", "pyproject.toml", "LICENSE", "README.md", "PKG-INFO"} <= names


@pytest.mark.parametrize("name", [n for n in WHEELS if n.endswith("linux")])
def test_a_core_keeps_to_its_manylinux_tag(name: str, tmp_path: Path) -> None:
    """Symbols of glibc 2.17 or older, and libraries that every such system has."""
    assert needs_glibc_2_17(core(name, tmp_path)) == {"libc.so.6"}


def test_the_core_of_windows_needs_windows_alone(tmp_path: Path) -> None:
    needs_windows_alone(core("x86_64-windows", tmp_path))


@pytest.mark.parametrize("name", [n for n in WHEELS if n.endswith("darwin")])
def test_a_core_keeps_to_its_macos_tag(name: str, tmp_path: Path) -> None:
    arm = name.startswith("aarch64")
    assert ("ARM64" if arm else "X86_64") in loads_on_macos_11(core(name, tmp_path), arm)


def cases() -> list[tuple[str, Graph, dict[str, Any], Array]]:
    """All vectors: block, graph, case, inputs."""
    found = []
    for file in sorted((ROOT / "tests" / "vectors").glob("*/*.toml")):
        for case in tomllib.loads(file.read_text())["case"]:
            node = Node(file.stem, file.stem, case.get("dims", {}), case.get("values", {}))
            graph = Graph.single(node)
            u = np.asarray(case["u"], dtype=np.float64).reshape(len(case["y"]), graph.n_inputs)
            found.append((file.stem, graph, case, u))
    return found


@pytest.mark.parametrize("name", [n for n in RUNNERS if n in WHEELS])
def test_a_core_meets_the_vectors_with_the_bits_of_this_machine(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    library = core(name, tmp_path)
    target, before = runner(name, tmp_path / "wine", monkeypatch)
    if importlib.util.find_spec("ziglang") is None:
        pytest.skip("ziglang is not installed: no compiler for the other platforms")
    program = tmp_path / "host.exe"
    flags = ["-std=c99", "-O1", *([] if "windows" in name else ["-ldl"])]
    run(
        sys.executable, "-m", "ziglang", "cc", "-target", target, ROOT / "tests/release/core_host.c", *flags, "-o",
        program,
    )  # fmt: skip
    written = b""
    for _, graph, case, u in cases():
        file = graph.to_bytes()
        written += struct.pack(
            "<4q2d", len(file), len(u), u.shape[1], graph.n_outputs, case.get("t0", 0), case.get("h", 1)
        )
        written += u.tobytes() + file + bytes(-len(file) % 8)
    (tmp_path / "cases").write_bytes(written)
    run(*before, program, library, tmp_path / "cases", tmp_path / "results")
    results = np.fromfile(tmp_path / "results")
    at = 0
    for block, graph, case, u in cases():
        wanted = np.asarray(case["y"], dtype=np.float64)
        y = results[at : at + wanted.size].reshape(wanted.shape)
        at += wanted.size
        assert np.abs(y - wanted).max() <= case["tolerance"], block
        ours = graph.run(u, case.get("h", 1.0), case.get("t0", 0.0)).reshape(wanted.shape)
        assert y.tobytes() == ours.tobytes(), block
    assert at == len(results) > 1000
