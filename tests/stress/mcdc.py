"""MC/DC of C files from llvm-cov: each condition is shown to affect its decision independently."""

import json
import re
import shutil
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

from targets import run

Place = tuple[int, int, int, int]  # first line and column, last line and column


@dataclass
class FileCoverage:
    """Coverage of one file, merged over all programs and all copies of inline functions."""

    conditions: dict[Place, tuple[bool, bool]] = field(default_factory=dict)  # was true, was false
    decisions: dict[Place, list[bool]] = field(default_factory=dict)  # with several conditions: which are covered

    def singles(self) -> dict[Place, tuple[bool, bool]]:
        """Return decisions with one condition, which are not part of a larger one."""
        large = list(self.decisions)
        return {c: v for c, v in self.conditions.items() if not any(d[:2] <= c[:2] and c[2:] <= d[2:] for d in large)}

    def total(self) -> int:
        return sum(map(len, self.decisions.values())) + len(self.singles())

    def missing(self) -> list[tuple[int, str]]:
        """Return (line, uncovered condition), sorted."""
        found = [
            (at[0], f"never {'false' if seen[0] else 'true' if seen[1] else 'reached'}")
            for at, seen in self.singles().items()
            if not all(seen)
        ]
        for at, shown in self.decisions.items():
            found += [(at[0], f"condition {k + 1} of {len(shown)}") for k, s in enumerate(shown) if not s]
        return sorted(found)


def clang() -> str | None:
    """Return a clang with -fcoverage-mcdc (18 or newer), or None."""
    for name in ("clang", *(f"clang-{v}" for v in range(30, 17, -1))):
        if shutil.which(name):
            m = re.search(r"version (\d+)", run([name, "--version"], 20))
            if m and int(m[1]) >= 18 and tool(name, "llvm-cov") and tool(name, "llvm-profdata"):
                return name
    return None


def tool(compiler: str, name: str) -> str | None:
    """Return the LLVM tool of the same version."""
    return shutil.which(compiler.replace("clang", name))


def read(compiler: str, programs: list[Path], profiles: list[Path], folder: Path) -> dict[Path, FileCoverage]:
    """Return the coverage of the files in `folder`."""
    merged = profiles[0].parent / "all.profdata"
    profdata, cov = tool(compiler, "llvm-profdata"), tool(compiler, "llvm-cov")
    assert profdata
    assert cov
    run([profdata, "merge", "-o", str(merged), *map(str, profiles)], 300)
    objects = [word for p in programs[1:] for word in ("-object", str(p))]
    text = run([cov, "export", str(programs[0]), *objects, f"-instr-profile={merged}", str(folder)], 300)
    found: dict[Path, FileCoverage] = defaultdict(FileCoverage)
    for f in json.loads(text)["data"][0]["files"]:
        one = found[Path(f["filename"])]
        for *place, true, false, _, _, _ in f["branches"]:
            old = one.conditions.get(tuple(place), (False, False))
            one.conditions[tuple(place)] = (old[0] or true > 0, old[1] or false > 0)
        for a, b, c, d, *_, shown in f["mcdc_records"]:
            before = one.decisions.get((a, b, c, d), [False] * len(shown))
            one.decisions[a, b, c, d] = [x or y for x, y in zip(before, shown, strict=True)]
    return found
