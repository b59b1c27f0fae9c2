"""Every compiler, optimisation level, processor and operating system gives the same bits.

Each block has one hash over its outputs, tangents and memory, for every target that this machine can build and run.
"""

import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from embedded import graphs, write_source
from targets import CORE, CORE_SOURCES, MEANING, TARGETS, Target

HERE = Path(__file__).parent
FLAGS = [f"-I{CORE.parent}", f"-I{HERE}"]


def hashes(target: Target, folder: Path, steps: int, meaning: list[str] = MEANING) -> dict[str, str]:
    """Return the hash of every graph by name."""
    folder.mkdir(parents=True, exist_ok=True)
    sources = [*CORE_SOURCES, HERE / "hash_outputs.c", write_source(folder / "files.c")]
    program = target.build(folder / "hash_outputs", sources, [*meaning, *FLAGS])
    lines = target.run(program, str(steps)).splitlines()
    found = dict(line.split() for line in lines)
    assert list(found) == list(graphs())
    return found


def differences(a: dict[str, str], b: dict[str, str]) -> list[str]:
    return [name for name in a if a[name] != b[name]]


@pytest.mark.stress
def test_two_compilers_give_the_same_bits(tmp_path: Path) -> None:
    """Compare two fast targets that differ most; `make stress` compares all."""
    first, second = (next(t for t in TARGETS if t.name == name) for name in ("gcc -O0", "clang -O3 -march=native"))
    for t in (first, second):
        if why := t.missing():
            pytest.skip(f"{t.name}: {why}")
    a, b = hashes(first, tmp_path / "a", 4000), hashes(second, tmp_path / "b", 4000)
    assert differences(a, b) == []
    assert len(set(a.values())) > 0.7 * len(a)  # the hash includes the outputs: few graphs have equal ones


@pytest.mark.stress
def test_every_target_gives_the_same_bits(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    skipped = [f"{t.name}: {why}" for t in TARGETS if (why := t.missing())]
    there = [t for t in TARGETS if not t.missing()]
    seconds = {}

    def one(t: Target) -> dict[str, str]:
        begin = time.monotonic()
        made = hashes(t, tmp_path / str(TARGETS.index(t)), 20000)
        seconds[t.name] = time.monotonic() - begin
        return made

    with ThreadPoolExecutor(2) as pool:  # most targets use one of the two processors
        found = dict(zip([t.name for t in there], pool.map(one, there), strict=True))
    reference = found[next(iter(found))]
    with capsys.disabled():
        print(f"\n20 000 steps, hash per graph on {len(found)} targets")
        for name, value in reference.items():
            others = [t for t in found if found[t][name] != value]
            print(f"  {name:34s} {value}  {'equal' if not others else 'DIFFERS: ' + '; '.join(others)}")
        print("\n".join(f"  {seconds[t]:5.1f} s  {t}" for t in found))
        print("\n".join(["skipped: " + s for s in skipped]))
    assert {t: differences(reference, h) for t, h in found.items() if h != reference} == {}
    assert len(found) >= 8, skipped


@pytest.mark.stress
def test_the_hash_detects_fused_operations(tmp_path: Path) -> None:
    """Check the test itself: fused multiply-add, which CMakeLists.txt forbids, changes the hashes."""
    target = next(t for t in TARGETS if t.name == "gcc -O3 -march=native")
    if (why := target.missing()) or "fma" not in Path("/proc/cpuinfo").read_text():
        pytest.skip(why or "the processor has no fused multiply-add")
    good = hashes(target, tmp_path / "off", 2000)
    fused = hashes(target, tmp_path / "fast", 2000, ["-std=gnu99", "-ffp-contract=fast", "-fno-math-errno"])
    assert len(differences(good, fused)) > 20
