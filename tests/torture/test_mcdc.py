"""Condition coverage (MC/DC) of the C core by the tests that call it: the contract, the drivers in C, the graphs.

The core is compiled once more with counters.  Python gets a copy of the package with that library; what tests compile
themselves gets the counters by a `cc` of ours that stands first on the path."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from embedded import write_source
from mcdc import clang, read
from targets import CORE, CORE_SOURCES, MEANING, ROOT, Target

import hystfmu

HERE = Path(__file__).parent
COUNT = ["-fprofile-instr-generate", "-fcoverage-mapping", "-fcoverage-mcdc"]
MASTER = sorted((ROOT / "fmu_build" / "master").glob("*.c"))
SUITES = [
    "contract",
    "c",
    *(
        f"python/test_{n}.py"
        for n in ("continuous", "dynamics", "graph", "implicit", "operators", "operators_more", "tangent")
    ),
]

# What no call of the public functions can show, with the reason: (file, words of the line) -> why.
GUARD = "the bound of a loop that converges long before: it keeps a wrong number from making it endless"
UNREACHABLE: dict[tuple[str, str], str] = {
    ("blocks/bouc_wen.c", "k < 64"): GUARD,
    ("blocks/bouc_wen.c", "i < 60"): GUARD,
    ("blocks/zhao_tan_inverse.c", "i < 5"): GUARD,
    ("root.h", "i < MOST"): GUARD,
    ("odd_branch.h", "before <= 1e-16 * d"): GUARD,
    ("blocks/bouc_wen_oscillator.c", "hyst_isfinite(A - dA)"): "both numbers share a divisor and overflow together",
    ("blocks/disturbance_observer.c", "hyst_isfinite(M[0])"): "the three gains share a divisor and overflow together",
    ("continuous.c", "n->time >= 0"): "no block has both continuous states and the time",
    ("layout.h", "own <= HYST_TIME"): "in no table an input stands behind the time",
    ("node.h", "k < first || k > last"): "the last kind that is asked for is the last of all",
    ("piecewise.h", "invert &&"): "in each of the two blocks it is a constant",
    ("tangent.c", "ddx[k] = 0"): "every block with continuous states has a tangent",
    ("graph_file.c", "switch (b->vars[v].kind)"): "the cases are all kinds",
    ("graph_file.c", "(uint64_t)k.p_file"): "past the end the number is 0, and every block has parameters",
    ("graph_open.c", "s = hyst_read_nodes"): "the second reading of a header that was good in the first",
}
LEAST = 0.93  # of all conditions, shown or explained


@pytest.mark.torture
def test_conditions_of_the_core(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    compiler = clang()
    if compiler is None:
        pytest.skip("no clang with -fcoverage-mcdc (18 or newer) with its llvm-cov")
    counting = Target(compiler, [compiler, "-O1", "-g", *COUNT])
    flags = [*MEANING, "-fPIC", f"-I{CORE}", f"-I{HERE}"]
    files = write_source(tmp_path / "files.c")
    hashes = counting.build(tmp_path / "hash_outputs", [*CORE_SOURCES, HERE / "hash_outputs.c", files], flags)

    package = tmp_path / "package" / "hystfmu"
    shutil.copytree(Path(hystfmu.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    library = counting.build(tmp_path / "_core", [*CORE_SOURCES, *MASTER], [*flags, "-shared"])
    shutil.copy(library, package / "_core.so")

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
    command += ["-k", "not outside_symbol", *suites]  # the counters are outside symbols
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=1200)
    assert done.returncode == 0, done.stdout[-3000:]

    built = [p for p in (tmp_path / "run").rglob("*") if p.name == "drive_core" or p.suffix == ".so"]
    found = read(compiler, [hashes, library, *built], sorted((tmp_path / "profiles").glob("*")), CORE)
    total = missing = explained = 0
    lines = []
    for path, coverage in sorted(found.items()):
        text = path.read_text().splitlines()
        open_ones = coverage.missing()
        total, missing = total + coverage.total(), missing + len(open_ones)
        name = str(path.relative_to(CORE))
        lines.append(f"{name:40s} {coverage.total() - len(open_ones):4d} of {coverage.total():4d}")
        for line, what in open_ones:
            why = [w for (f, words), w in UNREACHABLE.items() if f == name and words in text[line - 1]]
            explained += bool(why)
            lines.append(
                f"    {line:4d} {what}: {re.sub(' +', ' ', text[line - 1].strip())[:90]}"
                + "".join(f"\n         {w}" for w in why)
            )
    with capsys.disabled():
        print("\nMC/DC of the C core: conditions shown to decide alone\n" + "\n".join(lines))
        percent = 100 * (total - missing) / total
        print(f"{total - missing} of {total} conditions: {percent:.1f} %; {explained} of the others cannot be shown")
    assert total - missing + explained >= LEAST * total
