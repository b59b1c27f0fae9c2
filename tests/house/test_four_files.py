"""The worked example of CONTRIBUTING.md makes a block; without one of its four files a sentence names that file.

The example goes into a copy of the repository, which is compiled without optimisation, under a name drawn anew in each
run: a block may stand at any place of the alphabet.
"""

import os
import random
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
EXAMPLE, CLASS = Path(C_FILE).stem, Path(MODELICA).stem
WORD = re.compile(r"^  B\((\w+)\) \\$", re.MULTILINE)  # a line of the registry
CONTRACT = (".venv/bin/python", "-m", "pytest", "-q", "--no-header", "--tb=short", "tests/contract")
# the core for pages takes longer to compile than all else; a test below of the long runs makes it
GENERATE = ("make", "-o", "core", "-o", "core-page", "generate")
# an editable installation goes before PYTHONPATH
SITE = "import sys\nsys.meta_path[:] = [f for f in sys.meta_path if 'ScikitBuild' not in type(f).__name__]\n"


def words(registry: str) -> list[str]:
    """The words of a registry in their order."""
    return WORD.findall(registry)


def inserted(registry: str, diff: str) -> str:
    """A registry with the lines of a diff that are marked with +, each at its place in the alphabet."""
    lines = registry.splitlines(keepends=True)
    for new in [line[1:] for line in diff.splitlines(keepends=True) if line[0] == "+"]:
        at = [k for k, line in enumerate(lines) if WORD.match(line)]
        before = sum(lines[k] < new for k in at)
        lines.insert(at[before] if before < len(at) else at[-1] + 1, new)
    return "".join(lines)


def named(text: str, name: str) -> str:
    """A text of the example, for a block of another name."""
    return text.replace(EXAMPLE, name).replace(CLASS, class_of(name))


def class_of(name: str) -> str:
    return "".join(part.capitalize() for part in name.split("_"))


def drawn_name() -> str:
    """A name at the first place of the alphabet, at the last one, or behind a block of the registry."""
    stems = ["aa", "zz", *(word.replace("_", "") for word in words((ROOT / REGISTRY).read_text()))]
    return f"{random.choice(stems)}_slip"


class Copy:
    """The files that git knows or would add, in a folder of their own, with the environment of these tests."""

    def __init__(self, folder: Path, name: str) -> None:
        self.folder, self.name = folder, name
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
        """Write a part of the example: a whole file, or a word of the registry."""
        kind, text = PARTS[path]
        file, text = self.folder / named(path, self.name), named(text, self.name)
        if kind == "diff":
            text = inserted(file.read_text(), text)
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
    assert [Path(path).parts[0] for path in PARTS] == ["fmu_build", "fmu_build", "tests", "modelica"]
    assert [kind for kind, _ in PARTS.values()] == ["c", "diff", "toml", "modelica"]
    assert not any((ROOT / path).exists() for path in (C_FILE, VECTORS, MODELICA))


def test_the_diff_of_the_registry_adds_one_line_at_any_place() -> None:
    """Before every word, between any two and behind the last; no other line changes."""
    registry, (_, diff) = (ROOT / REGISTRY).read_text(), PARTS[REGISTRY]
    there = words(registry)
    assert there == sorted(there)
    for name in [EXAMPLE, "jiles", "a", "zzzz", *(f"{word}_x" for word in there), *(word[:-1] for word in there)]:
        if name in there:
            continue
        new = inserted(registry, named(diff, name))
        assert words(new) == sorted([*there, name])
        assert new.replace(f"  B({name}) \\\n", "") == registry


def test_a_drawn_name_is_no_block_and_at_any_place() -> None:
    there = words((ROOT / REGISTRY).read_text())
    drawn = {drawn_name() for _ in range(40 * len(there))}
    places = {sum(word < name for word in there) for name in drawn}
    assert {0, len(there)} < places
    assert len(places) > len(there) / 2
    assert not drawn & set(there)


@pytest.mark.turn("compiled C")
def test_all_four_files_make_a_block(tmp_path: Path) -> None:
    name = drawn_name()
    copy = Copy(tmp_path, name)
    copy.environment["PYTEST_ADDOPTS"] = f"-k '{name} or {class_of(name)}'"
    for path in PARTS:
        copy.add(path)
    copy.compile()
    copy.succeeds(*GENERATE)
    copy.succeeds(*CONTRACT)


@pytest.mark.stress
def test_each_file_that_is_missing_is_named(tmp_path: Path) -> None:
    name = drawn_name()
    copy = Copy(tmp_path, name)
    c_file, vectors, modelica = (named(path, name) for path in (C_FILE, VECTORS, MODELICA))
    copy.environment["PYTEST_ADDOPTS"] = f"-k '{name} or {class_of(name)} or registry or equations'"
    copy.add(REGISTRY), copy.add(VECTORS), copy.add(MODELICA)
    copy.says(f"write fmu_build/core/blocks/<family>/{name}.c", "make", "core")

    shutil.copy2(ROOT / REGISTRY, copy.folder / REGISTRY)
    copy.add(C_FILE)
    copy.succeeds(".venv/bin/clang-format", "--dry-run", "--Werror", c_file)
    copy.compile()
    copy.says(rf"write B\({name}\) in {REGISTRY}: a block is", *CONTRACT)

    copy.add(REGISTRY)
    copy.succeeds(".venv/bin/clang-format", "--dry-run", "--Werror", REGISTRY)
    copy.compile()
    (copy.folder / vectors).unlink(), (copy.folder / modelica).unlink()
    copy.says(
        rf"(?s)(?=.*{name} has no vectors: write {vectors} with a `source`)"
        f".*write {modelica}: the equations of the block {name}",
        *CONTRACT,
    )


@pytest.mark.stress
def test_the_example_passes_the_checks_of_every_room(tmp_path: Path) -> None:
    name = drawn_name()
    copy = Copy(tmp_path, name)
    for path in PARTS:
        copy.add(path)
    copy.succeeds("git", "init", "--quiet")
    copy.succeeds("git", "add", "--all")  # some tests ask git for the files
    copy.succeeds("make", "generate")
    copy.succeeds("make", "contract")
    chosen = f"{name} or {class_of(name)} or every or stale"
    rooms = [f"tests/{room}" for room in ("fmu", "blocks", "graph", "face", "modelica", "c")]
    copy.succeeds(".venv/bin/python", "-m", "pytest", "-q", *rooms, "-k", chosen)
