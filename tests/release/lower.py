"""Use HystFMU on the lowest versions that pyproject.toml allows, then on the newest: lower.py FOLDER.

Each set has an environment of its own in FOLDER, with the wheel that its own build tools make.  What runs there: the
tests of `USED`, which cover the face, the reader of measured files and `hystfmu start`, then the use of a wheel with
scenarios.  torch is left out: only modules that a user builds need it, and it is as large as all the rest.
"""

import os
import re
import subprocess
import sys
import tomllib
import venv
from pathlib import Path

ROOT = Path(__file__).parents[2]
EXTRAS = ("control", "files", "notebook", "study")
TOOLS = ("pytest", "hypothesis")
USED = (
    "tests/face/test_face.py", "tests/face/test_face_program.py", "tests/face/test_notebook.py",
    "tests/data/test_data.py", "tests/data/test_lab_files.py", "tests/data/test_reader.py", "tests/start/test_start.py",
    "tests/study/test_study.py",
)  # fmt: skip
_BOUND = re.compile(r"([\w.-]+)(?:\[[\w,]+\])?>=([\w.]+)")


def bounds() -> list[str]:
    """Return the lower bounds of pyproject.toml as exact versions, one requirement each."""
    told = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project = told["project"]
    stated = [*told["build-system"]["requires"], *project["dependencies"]]
    stated += [r for extra in EXTRAS for r in project["optional-dependencies"][extra]]
    found = {r: _BOUND.match(r) for r in stated}
    if open_ended := [r for r, m in found.items() if m is None]:
        sys.exit(f"pyproject.toml: state the lowest version, as in name>=1.2: {', '.join(open_ended)}")
    return sorted({f"{m[1]}=={m[2]}" for m in found.values() if m})


def use(folder: Path, exact: list[str]) -> None:
    """Install the wheel with the extras, in the versions of `exact`, and use it.

    Raises
    ------
    subprocess.CalledProcessError
        Something does not install, or fails on these versions.
    """
    venv.create(folder, clear=True, with_pip=True)
    programs = folder / ("Scripts" if sys.platform == "win32" else "bin")
    constraints = folder / "constraints.txt"
    constraints.write_text("".join(f"{line}\n" for line in exact), encoding="utf-8")
    # pip takes the second name for what the build needs; before its version 25.3 it took the first for both
    pinned = {"PIP_CONSTRAINT": str(constraints), "PIP_BUILD_CONSTRAINT": str(constraints)}
    hidden = ("PYTHONPATH", "PYTHONHOME")  # the wheel is used, not the working copy
    environment = {k: v for k, v in os.environ.items() if k not in hidden} | pinned
    python, pip = programs / "python", ["-m", "pip", "--quiet", "--disable-pip-version-check", "install"]
    package = f"{ROOT}[{','.join(EXTRAS)}]"
    subprocess.run([python, *pip, package, *TOOLS], env=environment, check=True, cwd=folder)
    listed = subprocess.run(
        [python, "-m", "pip", "freeze"], env=environment, check=True, capture_output=True, text=True
    )
    names = {line.partition("==")[0].lower().replace("_", "-") for line in bounds()}
    shown = [r for r in listed.stdout.split() if r.partition("==")[0].lower().replace("_", "-") in names]
    print(f"{folder.name}: {', '.join(shown)}", flush=True)
    cache = ["-p", "no:cacheprovider", "-o", "addopts="]
    subprocess.run([python, "-m", "pytest", "-q", *cache, *USED], env=environment, check=True, cwd=ROOT)
    subprocess.run([python, ROOT / "tests" / "release" / "wheel.py"], env=environment, check=True, cwd=folder)


def main() -> int:
    """Use the lowest versions, then the newest."""
    (folder,) = map(Path, sys.argv[1:])
    folder.mkdir(parents=True, exist_ok=True)
    for name, exact in (("lowest", bounds()), ("newest", [])):
        use(folder.resolve() / name, exact)
    return 0


if __name__ == "__main__":
    sys.exit(main())
