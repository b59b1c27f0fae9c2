"""Condition coverage (MC/DC) of the C core and the FMI layer by the tests that call them: contract, drivers, FMUs.

Both are compiled with counters.  Python uses a copy of the package with these libraries.  Programs that tests compile
get the counters from a `cc` script that comes first on the path.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from embedded import write_source
from targets import CORE, CORE_SOURCES, FMI, FMI_SOURCES, MEANING, ROOT, Target, fmi_headers, run

import hystfmu

# ---- coverage from llvm-cov ------------------------------------------------------------------------------------------
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


# ---- conditions that no call of the public functions covers ----------------------------------------------------------
# (file, condition, words of the line) -> reason; a condition that is not listed, or listed and covered, is a failure
GUARD = "bound of a loop that converges earlier; it prevents an endless loop for wrong numbers"
CONSTANT = "a constant in each of the two blocks"
NO_TIME = "no block has the time together with continuous states or samples, though the tables allow it"
UNREACHABLE: dict[tuple[str, str, str], str] = {
    ("core/blocks/operators/bouc_wen.c", "condition 1 of 2", "k < 64"): GUARD,
    ("core/blocks/operators/bouc_wen.c", "never false", "i < 20"): GUARD,
    ("core/blocks/inverses/zhao_tan_inverse.c", "never false", "i < 5"): GUARD,
    ("core/elementary/root.h", "never false", "i < MOST"): GUARD,
    ("core/elementary/root.h", "condition 1 of 2", "i < MOST && more"): GUARD,
    ("core/graph/continuous.c", "never true", "n->time >= 0 ? n->u[n->time] : 0"): NO_TIME,
    ("core/graph/continuous.c", "never true", "if (n->time >= 0)"): NO_TIME,
    ("core/block_file/graph_file.c", "never true", "switch (b->vars[v].kind)"): "the cases are all kinds",
    ("core/graph/layout.h", "condition 2 of 2", "own <= HYST_TIME"): "no table lists an input after the time",
    ("core/memory/piecewise.h", "condition 1 of 2", "if (invert && !(w0 > 0))"): CONSTANT,
    ("core/memory/piecewise.h", "condition 1 of 4", "if (invert && !(segment"): CONSTANT,
    ("core/graph/tangent.c", "never true", "ddx[k] = 0"): "every block with continuous states has a tangent",
    ("fmi/values.c", "never true", "type == BOOLEAN"): "no table has a bool, though the format and both standards do",
    ("fmi/values.c", "condition 2 of 2", "p->kind == HYST_INPUT"): "no table bounds an input",
}


# ---- the tests -------------------------------------------------------------------------------------------------------
HERE = Path(__file__).parent
COUNT = ["-fprofile-instr-generate", "-fcoverage-mapping", "-fcoverage-mcdc"]
MASTER = sorted((ROOT / "fmu_build" / "master").glob("*.c"))
LAYER = "derivatives events exchange phases structure"
SUITES = [
    "contract", "c", "blocks", "graph", "identify/test_dead_band.py", "identify/test_rate.py", "fmu/calls",
    "fmu/check/test_fmu_binary.py", *(f"fmu/test_fmu_{n}.py" for n in LAYER.split()),
]  # fmt: skip
NOT_WITH_COUNTERS = ["outside_symbol", "exports_the_standard", "needs_libc_only"]  # they inspect a library


def test_the_suites_are_there() -> None:
    """Detect a renamed suite here rather than in the long run."""
    assert [s for s in SUITES if not (ROOT / "tests" / s).exists()] == []


@pytest.mark.stress
def test_conditions_of_the_core(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    compiler = clang()
    if compiler is None:
        pytest.skip("no clang with -fcoverage-mcdc (18 or newer) with its llvm-cov")
    counting = Target(compiler, [compiler, "-O1", "-g", *COUNT])
    flags = [*MEANING, "-fPIC", f"-I{CORE.parent}", f"-I{HERE}"]
    files = write_source(tmp_path / "files.c")
    hashes = counting.build(tmp_path / "hash_outputs", [*CORE_SOURCES, HERE / "hash_outputs.c", files], flags)

    package = tmp_path / "package" / "hystfmu"
    shutil.copytree(Path(hystfmu.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    libraries = [
        counting.build(tmp_path / "_core", [*CORE_SOURCES, *MASTER], [*flags, "-shared"]),
        counting.build(
            tmp_path / "_fmu", [*CORE_SOURCES, *FMI_SOURCES], [*flags, f"-isystem{fmi_headers()}", "-shared"]
        ),
    ]
    for made in libraries:
        shutil.copy(made, package / f"{made.name}.so")
    # an editable installation goes before PYTHONPATH
    (package.parent / "sitecustomize.py").write_text(
        "import sys\nsys.meta_path[:] = [f for f in sys.meta_path if 'ScikitBuild' not in type(f).__name__]\n"
    )

    shim = tmp_path / "bin" / "cc"
    shim.parent.mkdir()
    # the counters need libc: without -nostdlib
    each = 'for a; do shift; [ "$a" = -nostdlib ] || set -- "$@" "$a"; done'
    shim.write_text(f'#!/bin/sh\n{each}\nexec {shutil.which(compiler)} "$@" {" ".join(COUNT)}\n')
    shim.chmod(0o755)

    environment = {
        **os.environ,
        "LLVM_PROFILE_FILE": str(tmp_path / "profiles" / "%p-%m.profraw"),
        "PYTHONPATH": str(package.parent),
        "PATH": f"{shim.parent}{os.pathsep}{os.environ['PATH']}",
    }
    subprocess.run([str(hashes), "20000"], env=environment, check=True, capture_output=True, timeout=300)
    suites = [str(ROOT / "tests" / s) for s in SUITES]
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", f"--basetemp={tmp_path / 'run'}"]
    command += ["-k", " and ".join(f"not {name}" for name in NOT_WITH_COUNTERS), *suites]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=1800)
    assert done.returncode == 0, done.stdout[-3000:]

    copies = {made.read_bytes() for made in libraries}  # FMUs contain them
    built = [p for p in (tmp_path / "run").rglob("*") if p.suffix == ".so" or (p.name[:6] == "drive_" and not p.suffix)]
    drivers = list({c: p for p in built if p.is_file() and (c := p.read_bytes()) not in copies}.values())
    profiles = sorted((tmp_path / "profiles").glob("*"))
    problems = []
    for title, folder in (("C core", CORE), ("FMI layer", FMI)):
        found = read(compiler, [hashes, *libraries, *drivers], profiles, folder)
        lines, wrong = judge(found, folder)
        problems += wrong
        with capsys.disabled():
            print(f"\nMC/DC of the {title}: conditions shown to decide independently\n" + "\n".join(lines))
    assert problems == []


def judge(found: dict[Path, FileCoverage], folder: Path) -> tuple[list[str], list[str]]:
    """Return the lines of the report, and conditions without a reason and reasons without a condition."""
    lines, wrong, used = [], [], set()
    total = missing = 0
    for path, coverage in sorted(found.items()):
        text = path.read_text().splitlines()
        name = str(path.relative_to(folder.parent))
        open_ones = coverage.missing()
        total, missing = total + coverage.total(), missing + len(open_ones)
        lines.append(f"{name:40s} {coverage.total() - len(open_ones):4d} of {coverage.total():4d}")
        for line, what in open_ones:
            place = f"{name}:{line} {what}: {re.sub(' +', ' ', text[line - 1].strip())[:90]}"
            keys = [k for k in UNREACHABLE if k[:2] == (name, what) and k[2] in text[line - 1]]
            used.update(keys)
            lines += [f"    {place}", *(f"         {UNREACHABLE[k]}" for k in keys)]
            wrong += [] if keys else [place]
    wrong += [
        f"{' '.join(k)}: not found, or covered"
        for k in UNREACHABLE
        if k[0].split("/")[0] == folder.name and k not in used
    ]
    percent = 100 * (total - missing) / total
    lines.append(
        f"{total - missing} of {total} conditions: {percent:.1f} %; of the other {missing}, {len(wrong)} lack a reason"
    )
    return lines, wrong
