"""Condition coverage (MC/DC) of the C core and the FMI layer by the tests that call them: contract, drivers, FMUs.

Both are compiled with counters.  Python uses a copy of the package with these libraries.  Programs that tests compile
get the counters from a `cc` script that comes first on the path.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from embedded import write_source
from mcdc import FileCoverage, clang, read
from targets import CORE, CORE_SOURCES, FMI, FMI_SOURCES, MEANING, ROOT, Target, fmi_headers
from unreachable import UNREACHABLE

import hystfmu

HERE = Path(__file__).parent
COUNT = ["-fprofile-instr-generate", "-fcoverage-mapping", "-fcoverage-mcdc"]
MASTER = sorted((ROOT / "fmu_build" / "master").glob("*.c"))
LAYER = "derivatives events exchange phases structure"
SUITES = [
    "contract",
    "c",
    "blocks",
    "graph",
    "identify/test_dead_band.py",
    "identify/test_rate.py",
    "fmu/calls",
    "fmu/check/test_fmu_binary.py",
    *(f"fmu/test_fmu_{n}.py" for n in LAYER.split()),
]
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
