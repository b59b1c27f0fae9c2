"""libFuzzer with AddressSanitizer and UBSan: random block files, and random sequences of FMI 2.0 and 3.0 calls."""

import os
import re
import subprocess
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import compiled
import pytest
from embedded import write_corpus, write_source
from targets import CORE_SOURCES, FMI_SOURCES, Target, run

HERE = Path(__file__).parent
SANITIZE = "-fsanitize=fuzzer,address,undefined,float-cast-overflow"
CLANG = Target("clang, libFuzzer", ["clang", "-g", "-O1", SANITIZE, "-fno-sanitize-recover=all"])
RUNS = int(os.environ.get("HYSTFMU_FUZZ_RUNS", "1000000"))  # per target in `make stress`


@pytest.fixture(scope="session")
def fuzzer(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Build a program by name: fuzz_core or fuzz_fmi."""
    folder = tmp_path_factory.mktemp("fuzz")
    probe = folder / "probe.c"
    probe.write_text("int LLVMFuzzerTestOneInput(const unsigned char *d, unsigned long n) { return d && n ? 0 : 0; }\n")
    why = CLANG.missing()
    if (
        why
        or subprocess.run([*CLANG.compiler, str(probe), "-o", str(folder / "probe")], capture_output=True).returncode
    ):
        pytest.skip(why or "clang has no libFuzzer runtime")

    def one(name: str) -> Path:
        if not (folder / name).exists():
            sources, own = CORE_SOURCES, [HERE / f"{name}.c"]
            if name == "fuzz_fmi":
                sources = [*sources, *(s for s in FMI_SOURCES if s.name != "open_file.c")]
                own.append(write_source(folder / "files.c"))  # instead of it, so that no file is opened
            flags = [*compiled.STRICT, *compiled.SANITIZERS["clang"], "-O1"]
            made = compiled.objects(sources, flags, "clang") + compiled.objects(own, [*flags, f"-I{HERE}"], "clang")
            run([*CLANG.compiler, *map(str, made), "-o", str(folder / name)], 300)
        return folder / name

    return one


def fuzz(program: Path, folder: Path, seconds: float, *options: str, seed: int = 1) -> str:
    """Fuzz a program with block files as initial corpus and return the report; inputs that fail are printed."""
    corpus = folder / "corpus"
    corpus.mkdir(parents=True)
    seeds = write_corpus(folder / "seeds")
    limits = ["-timeout=10", "-rss_limit_mb=2000", "-max_len=2048", f"-seed={seed}", "-print_final_stats=1"]
    command = [str(program), *options, *limits, f"-artifact_prefix={folder}/", str(corpus), str(seeds)]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=seconds)
    found = [f"{f.name}: {f.read_bytes().hex()}" for f in folder.glob("*-*") if f.is_file()]
    assert done.returncode == 0, done.stderr[-5000:] + "\n".join(found)
    return done.stderr


def statistic(report: str, name: str) -> int:
    m = re.search(rf"stat::{name}:\s*(\d+)", report)
    assert m, report[-2000:]
    return int(m[1])


@pytest.mark.stress
@pytest.mark.parametrize("name", ["fuzz_core", "fuzz_fmi"])
def test_a_million(fuzzer: Callable[..., Path], tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    program = fuzzer(name)

    def half(seed: int) -> str:
        return fuzz(program, tmp_path / str(seed), 3600, f"-runs={(RUNS + 1) // 2}", seed=seed)

    with ThreadPoolExecutor(2) as pool:
        reports = list(pool.map(half, (1, 2)))
    n, rate = (sum(statistic(r, s) for r in reports) for s in ("number_of_executed_units", "average_exec_per_sec"))
    edges = max(int(re.findall(r"cov: (\d+)", r)[-1]) for r in reports)
    with capsys.disabled():
        print(f"\n{name}: {n} executions, {rate} a second, {edges} edges: no crash, hang or leak")
    assert n >= RUNS
