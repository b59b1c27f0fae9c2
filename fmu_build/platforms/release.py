"""Write the files of a release: a wheel for each platform, the sdist, a list of parts, and checksums.

release.py PLATFORMS CORES DIST

The build backend of pyproject.toml makes the wheels. This program sets their tags, and it supplies the libraries of
core and container from CORES (cores.py), so that the backend does not compile them. The wheels contain the FMU binaries
in PLATFORMS (build.py), which must be the folder that CMakeLists.txt installs. The list of parts is a CycloneDX file in
DIST and in each wheel (PEP 770). Equal sources give bit-identical files, because all files have the time
SOURCE_DATE_EPOCH, by default the time of the last commit.
"""

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path

from build import TARGETS
from cores import CORES, LIBRARIES
from parts import parts, sha256

ROOT = Path(__file__).parents[2]
# platform tags of the wheels; their versions agree with TARGETS
TAGS = {
    "x86_64-windows": ["win_amd64"],
    "x86_64-linux": ["manylinux_2_17_x86_64", "manylinux2014_x86_64"],
    "aarch64-linux": ["manylinux_2_17_aarch64", "manylinux2014_aarch64"],
    "x86_64-darwin": ["macosx_11_0_x86_64"],
    "aarch64-darwin": ["macosx_11_0_arm64"],
}


def epoch() -> int:
    """Return the time of all files (s since 1970). It is SOURCE_DATE_EPOCH, or the time of the last commit."""
    if "SOURCE_DATE_EPOCH" not in os.environ:
        git = ["git", "-C", str(ROOT), "log", "-1", "--format=%ct"]
        os.environ["SOURCE_DATE_EPOCH"] = subprocess.check_output(git, text=True).strip()
    return int(os.environ["SOURCE_DATE_EPOCH"])


def main() -> None:
    """Write all files of the release to the empty folder DIST."""
    platforms, cores, dist = (Path(a).resolve() for a in sys.argv[1:])
    os.chdir(ROOT)
    from scikit_build_core.build import build_sdist, build_wheel

    seconds = epoch()  # the backend reads the time from the environment
    dist.mkdir(parents=True, exist_ok=True)
    if found := sorted(dist.iterdir()):
        raise SystemExit(f"release.py: {dist} must be empty. Got {found[0].name} and {len(found) - 1} more instead.")
    binaries = {f"hystfmu/_platforms/{p.name}": p for p in platforms.iterdir() if p.suffix != ".deflate"}
    lacking = [name for name, (_, suffix) in TARGETS.items() if not (platforms / f"{name}.{suffix}").exists()]
    if lacking:
        raise SystemExit(f"release.py: {platforms} must hold a binary for each platform. Got none for {lacking[0]}.")
    sdist = build_sdist(str(dist), {})
    name, version = sdist.removesuffix(".tar.gz").split("-")
    own = {t: [cores / t / f"{library}.{TARGETS[t][1]}" for library in LIBRARIES] for t in CORES}
    project = tomllib.loads(Path("pyproject.toml").read_text())["project"]
    compiled = binaries | {f"hystfmu/{p.name} of {target}": p for target, paths in own.items() for p in paths}
    listed = parts(project, version, compiled, seconds)
    sbom = dist / f"{name}-{version}.cdx.json"
    sbom.write_text(json.dumps(listed, indent=1) + "\n")
    for target, paths in own.items():
        settings = {
            "wheel.tags": [f"py3-none-{tag}" for tag in TAGS[target]],
            "wheel.reproducible": "true",
            "build-dir": "build/release",
            "build.targets": ["sources"],
            "install.components": ["files"],
            "install.strip": "false",
            "cmake.define.HYSTFMU_LIBRARIES": ";".join(map(str, paths)),
            "cmake.define.HYSTFMU_SBOM": str(sbom),
        }
        build_wheel(str(dist), settings)  # type: ignore[arg-type]
    files = sorted(dist.iterdir())
    (dist / "SHA256SUMS").write_text("".join(f"{sha256(p)}  {p.name}\n" for p in files))
    for path in files:
        print(f"{path.name}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
