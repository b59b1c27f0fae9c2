"""Which tests call which function of a C library: an instrumented build, and the reading of what it wrote."""

import mmap
import os
import re
import struct
import subprocess
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import fmpy
import numpy as np

HEADERS = Path(fmpy.__file__).parent / "c-code"
# the first line of a function; its last one is a brace at the margin
FLAGS = [
    "-std=gnu99", "-O1", "-g1", "-fPIC", "-shared", "-ffp-contract=off", "-fno-math-errno", "-finstrument-functions",
]  # fmt: skip
SOURCES = {
    "_core": ["core", "fitting", "master"],
    "_fmu": ["core", "fmi"],
    "_container": ["core", "master", "container", "fmi/files"],
}


class Calls:
    """A folder for the calls of one library in a tree."""

    def __init__(self, tree: Path, library: str, folder: Path) -> None:
        self.tree, self.folder = tree, folder
        folder.mkdir(parents=True, exist_ok=True)
        self.library = folder / f"{library}.so"
        rooms = SOURCES[library]
        sources = [p for r in rooms for p in sorted((tree / "fmu_build" / r).rglob("*.c"))]
        own = ["-DHYST_UNDOCUMENTED"] if library == "_fmu" else []
        command = ["cc", *FLAGS, *own, f"-I{tree / 'fmu_build'}", f"-isystem{HEADERS}", "-o", str(self.library)]
        subprocess.run([*command, *map(str, sources), str(Path(__file__).with_name("calls.c"))], check=True)
        (folder / "test").write_bytes(struct.pack("i", -1))
        (folder / "calls").write_bytes(b"")
        with (folder / "test").open("r+b") as f:
            self._test = mmap.mmap(f.fileno(), 4)

    def begin(self, test: int) -> None:
        """Name the test whose calls follow."""
        os.environ["HYSTFMU_CALLS"] = str(self.folder)
        self._test[:] = struct.pack("i", test)

    def lines(self, tests: Sequence[str]) -> dict[str, dict[str, list[str]]]:
        """Return the tests by file and by every line of the functions that they call."""
        rows = np.fromfile(self.folder / "calls", dtype=np.int64).reshape(-1, 2)
        by_place: dict[int, set[str]] = defaultdict(set)
        for test, place in rows[rows[:, 0] >= 0].tolist():
            by_place[place].add(tests[test])
        found: dict[str, dict[int, set[str]]] = defaultdict(lambda: defaultdict(set))
        places = self._places()
        for place, (file, line) in places.items():
            for k in _extent(file, line):
                found[str(Path(file).relative_to(self.tree))][k] |= by_place.get(place, set())
        return {f: {str(k): sorted(t) for k, t in sorted(some.items())} for f, some in found.items()}

    def _places(self) -> dict[int, tuple[str, int]]:
        """Return file and line of every function by its place in the library."""
        symbols = subprocess.check_output(["nm", str(self.library)], text=True).splitlines()
        places = sorted({s.split()[0] for s in symbols if re.fullmatch(r"[0-9a-f]+ [tTwW] \S+", s)})
        command = ["addr2line", "-e", str(self.library)]
        told = subprocess.run(command, input="\n".join(places), capture_output=True, text=True, check=True).stdout
        found = {}
        for place, line in zip(places, told.splitlines(), strict=True):
            file, _, number = line.partition(":")
            number = number.partition(" ")[0]
            if file.startswith(str(self.tree)) and number.isdigit():
                found[int(place, 16)] = (os.path.normpath(file), int(number))
        return found


def _extent(file: str, line: int) -> range:
    """Return the lines of the function that begins at `line`: to the brace at the margin, or one line."""
    text = Path(file).read_text().splitlines()
    if line > len(text):  # the compiler takes it for a line of the header whose macro makes the function
        return range(0)
    first = text[line - 1]
    if "{" in first and first.rstrip().endswith("}"):
        return range(line, line + 1)
    last = next((k for k in range(line, len(text)) if text[k].startswith("}")), line - 1)
    return range(line, last + 2)
