"""One word for one thing: spellings that the project has replaced do not come back."""

import functools
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EVERYWHERE = ("python", "tests", "fmu_build", "modelica", "scenarios", "README.md", "CONTRIBUTING.md")
MODEL_ROOMS = tuple(
    f"python/hystfmu/{room}"
    for room in (
        *("base", "core", "graph", "data", "model", "identify", "inverse", "design", "papers"),
        *("unit.py", "demo", "face"),
    )
)
TESTS = tuple(
    f"tests/{room}"
    for room in ("blocks", "c", "contract", "data", "design", "face", "graph", "house", "identify", "oracles", "papers")
)
FMU_ROOMS = (
    *(f"python/hystfmu/{room}" for room in ("fmu", "studies", "report", "cli", "scenario/report")),
    *(f"tests/{room}" for room in ("fmu", "study", "stress", "benchmarks")),
    *("fmu_build", "CMakeLists.txt"),
)
SUFFIXES = {".py", ".c", ".h", ".mo", ".toml", ".md", ".txt"}

# pattern -> the word to use, and where; a place joins as soon as it is clean
WORDS: dict[str, tuple[str, tuple[str, ...]]] = {
    r"\bstrangers?\b": ("untrusted file, foreign FMU", EVERYWHERE),
    r"\bguests?\b": ("foreign FMU", EVERYWHERE),
    r"\btorment|\btortur": ("stress tests", EVERYWHERE),
    r"\brows held back\b|\bheld-back rows\b": ("validation split", EVERYWHERE),
    r"\b(input|signal|data) (tells|says) little\b": ("not informative enough", EVERYWHERE),
    r"\bhalf-written\b": ("atomic write", EVERYWHERE),
    r"\b(some|any|no)body\b": ("name the subject, e.g. foreign FMU, importer", EVERYWHERE),
    r"\bjudged\b": ("tested; scored on the validation split", EVERYWHERE),
    r"\bdirectional\b": ("tangent", (*MODEL_ROOMS, *(t for t in TESTS if t != "tests/c"))),
    r"\bas ever\b": ("nominal value", EVERYWHERE[:-1]),
    r"\btakes? the blame\b|\bblames?\b": ("compensates for", EVERYWHERE),
    r"\bdear\b": ("expensive; cheapest first", EVERYWHERE),
    r"\bunits? of (u|x|y)\b|\bin (its|their) units?\b(?! of measure)": ("unit of measure", ("python", "tests")),
    r"; got\b": ("'... must be RULE. Got VALUE instead.'", (*MODEL_ROOMS, *FMU_ROOMS)),
}


@functools.cache
def files(place: str) -> list[Path]:
    """Tracked text files below a place; generated tables and this list are left out."""
    listed = subprocess.run(["git", "ls-files", "-z", place], cwd=ROOT, capture_output=True, text=True, check=True)
    paths = [ROOT / name for name in listed.stdout.split("\0") if name]
    return [p for p in paths if p.suffix in SUFFIXES and p.is_file() and p != Path(__file__)]


@functools.cache
def text(path: Path) -> str:
    return path.read_text(encoding="utf-8").lower()


@pytest.mark.parametrize("pattern", WORDS)
def test_a_replaced_word_does_not_come_back(pattern: str):
    use, places = WORDS[pattern]
    found, word = [], re.compile(pattern)
    for path in {p for place in places for p in files(place) if word.search(text(p))}:
        for k, line in enumerate(text(path).splitlines(), 1):
            if m := word.search(line):
                found.append(f"{path.relative_to(ROOT)}:{k}: {m[0]!r}")
    assert not found, f"say {use!r} instead: {sorted(found)}"


def test_every_place_has_files():
    """A place that was renamed would pass unseen."""
    for place in {place for _, places in WORDS.values() for place in places}:
        assert files(place), f"{place} has no text files: correct the list of places"
