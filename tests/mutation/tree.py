"""A copy of the repository in which one file at a time is changed; the core is built there."""

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

from mutation.mutant import Mutant

LIBRARIES = {"core": "_core", "fmi": "_fmu", "container": "_container"}  # that the tests of a room load
# an editable installation would find the package of the repository first
SITE = """import sys
sys.meta_path[:] = [f for f in sys.meta_path if "editable" not in type(f).__module__]
"""


class Tree:
    """The copy, built and compiled; leaving it (`close`) restores the last changed file."""

    def __init__(self, root: Path, folder: Path) -> None:
        self.root, self.folder = root, folder
        self.changed: str | None = None
        listed = subprocess.check_output(["git", "ls-files", "-co", "--exclude-standard", "-z"], cwd=root, text=True)
        names = {n for n in listed.split("\0") if n and (root / n).is_file()}
        for stale in [p for p in folder.rglob("*") if p.suffix in (".py", ".c", ".h", ".toml", ".csv")]:
            name = stale.relative_to(folder)
            if name.parts[0] != "build" and name.parts[0] != ".venv" and str(name) not in names:
                stale.unlink()
        for name in sorted(names):
            target = folder / name
            if not target.exists() or target.read_bytes() != (root / name).read_bytes():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(root / name, target)
        # what is mutated stays as it is now, whatever happens to the repository meanwhile
        self.texts = {n: (folder / n).read_text() for n in names if n.startswith(("fmu_build/", "python/"))}
        if not (folder / ".venv").exists():
            (folder / ".venv").symlink_to(root / ".venv")
        site = folder / "build" / "site"
        site.mkdir(parents=True, exist_ok=True)
        (folder / "build" / "tmp").mkdir(exist_ok=True)
        (site / "sitecustomize.py").write_text(SITE)
        self.environment = {
            "PYTHONPATH": f"{site}{os.pathsep}{folder / 'python'}",
            "PYTHONDONTWRITEBYTECODE": "1",
            "TMPDIR": str(folder / "build" / "tmp"),
        }
        self._configure()
        if not all(self.build(name) for name in LIBRARIES.values()):
            raise RuntimeError(f"the core does not build in {folder}")
        self.original = {name: self.hash(name) for name in LIBRARIES.values()}
        subprocess.run([sys.executable, "-m", "compileall", "-q", "python", "tests"], cwd=folder, check=True)

    def _configure(self) -> None:
        build = self.folder / "build" / "dev"
        if not (build / "build.ninja").exists():
            tools = self.root / ".venv" / "bin"
            options = [
                "-DCMAKE_C_FLAGS=-O1",  # half the time of a release for the compiler, the same bits
                f"-DCMAKE_INSTALL_PREFIX={self.folder / 'python'}",
                "-DCMAKE_INSTALL_MESSAGE=NEVER",
                f"-DCMAKE_MAKE_PROGRAM={tools / 'ninja'}",
                f"-DPython_EXECUTABLE={tools / 'python'}",
                "--log-level=WARNING",
            ]
            command = [str(tools / "cmake"), "-S", ".", "-B", str(build), "-G", "Ninja", *options]
            subprocess.run(command, cwd=self.folder, check=True, stdout=subprocess.DEVNULL)
            command = [str(tools / "cmake"), "--build", str(build), "--target", "install", "--", "--quiet"]
            subprocess.run(command, check=True)  # texts and licence as well

    def code(self, file: str) -> str:
        """Return a short hash of a file without mutants."""
        return hashlib.sha256(self.texts.get(file, "").encode()).hexdigest()[:8]

    def build(self, library: str) -> bool:
        """Compile what has changed and link it into the package; False if it does not compile."""
        command = [str(self.root / ".venv/bin/ninja"), "-C", "build/dev", "--quiet", library]
        if subprocess.run(command, cwd=self.folder, capture_output=True).returncode:
            return False
        target = self.library(library)
        target.unlink(missing_ok=True)  # a process may have loaded it
        shutil.copyfile(self.folder / "build" / "dev" / target.name, target)
        return True

    def library(self, name: str) -> Path:
        return self.folder / "python" / "hystfmu" / f"{name}.so"

    def hash(self, library: str) -> str:
        return hashlib.sha256(self.library(library).read_bytes()).hexdigest()

    def apply(self, mutant: Mutant) -> None:
        """Change one file; a file that was changed before is restored."""
        if self.changed not in (None, mutant.file):
            self.restore()
        self.changed = mutant.file
        target = self.folder / mutant.file
        stat = target.stat()
        target.write_text(mutant.apply(self.texts[mutant.file]))
        if mutant.file.endswith(".py"):  # by its time a stored bytecode is known to be stale
            os.utime(target, (stat.st_atime, stat.st_mtime + 3600))

    def restore(self) -> None:
        """Restore the changed file."""
        if self.changed is not None:
            target = self.folder / self.changed
            target.write_text(self.texts[self.changed])
            if self.changed.endswith(".py"):
                subprocess.run([sys.executable, "-m", "compileall", "-q", str(target)], check=True)
            self.changed = None
