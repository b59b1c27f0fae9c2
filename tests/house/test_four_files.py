"""The worked example of CONTRIBUTING.md makes a block; without one of its four files a sentence names that file.

The example goes into a copy of the repository, which is compiled without optimisation.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FENCED = re.compile(r"^`([\w./]+)`\n\n```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PARTS = {path: (kind, text) for path, kind, text in FENCED.findall((ROOT / "CONTRIBUTING.md").read_text())}
C_FILE, REGISTRY, VECTORS, MODELICA = PARTS
BLOCK = Path(C_FILE).stem
CONTRACT = ("make", "-o", "core", "contract", "WORKERS=0")  # what compile() has compiled is enough
# an editable installation goes before PYTHONPATH
SITE = "import sys\nsys.meta_path[:] = [f for f in sys.meta_path if 'ScikitBuild' not in type(f).__name__]\n"


class Copy:
    """The files that git knows or would add, in a folder of their own, with the environment of these tests."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        ask = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
        listed = subprocess.run(ask, cwd=ROOT, capture_output=True, text=True, check=True).stdout
        for name in {n for n in listed.split("\0") if (ROOT / n).is_file()}:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
        for made in ("build/tmp", "build/site"):
            (folder / made).mkdir(parents=True)
        (folder / "build" / "site" / "sitecustomize.py").write_text(SITE)
        (folder / ".venv").symlink_to(sys.prefix)
        for stamp in ("tools", "installed", "installed-dev"):
            (folder / "build" / stamp).touch()
        kept = {k: v for k, v in os.environ.items() if not k.startswith(("PYTEST", "MAKE", "MFLAGS"))}
        self.environment = {**kept, "PYTHONPATH": f"{folder}/python{os.pathsep}{folder}/build/site"}

    def add(self, path: str) -> None:
        """Write a part of the example: a whole file, or lines that are marked with + between lines that are there."""
        kind, text = PARTS[path]
        file = self.folder / path
        if kind == "diff":
            lines = text.splitlines(keepends=True)
            old = "".join(line[1:] for line in lines if line[0] == " ")
            assert file.read_text().count(old) == 1, f"CONTRIBUTING.md: the lines of {path} are not there any more"
            text = file.read_text().replace(old, "".join(line[1:] for line in lines))
        else:
            assert not file.exists()
        file.write_text(text)

    def call(self, *command: str) -> tuple[bool, str]:
        """Whether a command succeeds, and all that it prints, in one line."""
        done = subprocess.run(
            command, cwd=self.folder, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        return done.returncode == 0, " ".join(done.stdout.split())

    def succeeds(self, *command: str) -> None:
        good, said = self.call(*command)
        assert good, said[-5000:]

    def says(self, sentence: str, *command: str) -> None:
        good, said = self.call(*command)
        assert not good, f"passes, but {sentence!r} was expected"
        assert re.search(sentence, said), said[-5000:]

    def compile(self) -> None:
        """Only the library of Python, without optimisation."""
        if not (self.folder / "build" / "dev" / "build.ninja").exists():
            self.succeeds("make", "build/dev/build.ninja")
            self.succeeds(".venv/bin/cmake", "-DCMAKE_BUILD_TYPE=Debug", "-DCMAKE_C_FLAGS_DEBUG=-O0", "build/dev")
        self.succeeds(".venv/bin/cmake", "--build", "build/dev", "--target", "_core")
        for made in (self.folder / "build" / "dev").glob("_core.*"):
            shutil.copy2(made, self.folder / "python" / "hystfmu")


def test_the_example_is_four_files() -> None:
    folders = [Path(path).parts[0] for path in PARTS]
    assert folders == ["fmu_build", "fmu_build", "tests", "modelica"]
    assert [kind for kind, _ in PARTS.values()] == ["c", "diff", "toml", "modelica"]
    assert not any((ROOT / path).exists() for path in (C_FILE, VECTORS, MODELICA))


def test_each_file_is_missed_by_name_and_all_four_make_a_block(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    copy.environment["PYTEST_ADDOPTS"] = f"-k '{BLOCK} or {Path(MODELICA).stem} or registry or equations'"
    copy.add(REGISTRY), copy.add(VECTORS), copy.add(MODELICA)
    copy.says(f"write fmu_build/core/blocks/<family>/{BLOCK}.c", "make", "core")

    shutil.copy2(ROOT / REGISTRY, copy.folder / REGISTRY)
    copy.add(C_FILE)
    copy.succeeds(".venv/bin/clang-format", "--dry-run", "--Werror", C_FILE)
    copy.compile()
    copy.says(rf"write B\({BLOCK}\) in {REGISTRY}: a block is", *CONTRACT)

    copy.add(REGISTRY)
    copy.compile()
    (copy.folder / VECTORS).unlink()
    copy.says(f"{BLOCK} has no vectors: write {VECTORS} with a `source`", *CONTRACT)

    copy.add(VECTORS)
    (copy.folder / MODELICA).unlink()
    copy.says(f"write {MODELICA}: the equations of the block {BLOCK}", *CONTRACT)

    copy.add(MODELICA)
    copy.succeeds("make", "-o", "core", "generate")
    copy.succeeds(*CONTRACT)


@pytest.mark.stress
def test_the_example_passes_the_checks_of_every_room(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    for path in PARTS:
        copy.add(path)
    copy.succeeds("git", "init", "--quiet")
    copy.succeeds("git", "add", "--all")  # some tests ask git for the files
    copy.succeeds("make", "generate")
    copy.succeeds("make", "contract")
    named = f"{BLOCK} or {Path(MODELICA).stem} or every or stale"
    rooms = [f"tests/{room}" for room in ("fmu", "blocks", "graph", "face", "modelica", "c")]
    copy.succeeds(".venv/bin/python", "-m", "pytest", "-q", *rooms, "-k", named)
