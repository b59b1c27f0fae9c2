"""One word for one thing, and no riddles: replaced spellings and sentences do not come back."""

import functools
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EVERYWHERE = ("python", "tests", "fmu_build", "modelica", "scenarios", "README.md", "CONTRIBUTING.md")
MODEL_ROOMS = (
    *(f"python/hystfmu/{room}" for room in ("base", "core", "graph", "data", "model", "identify", "inverse", "design")),
    *(f"python/hystfmu/{room}" for room in ("unit.py", "demo", "face")),
    "scenarios/papers",
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

PROSE = (*(place for place in EVERYWHERE if place != "CONTRIBUTING.md"), "CHANGELOG.md")  # that page shows riddles
# pattern -> the words to use, and a sentence with the fault
RIDDLES: dict[str, tuple[str, str]] = {
    r"\bl(eaves?|eft|eaving) away\b": ("omits, ignores", "FMUs leave away the rounding of a clock."),
    r"\bhas none in front\b": ("name what is missing", "A model without an inverse has none in front."),
    r"\b(that|which) (took|takes?) part\b|\btakes part\.": ("tested; name the test", "Tools that took part"),
    r"\b(stop|stops|stopped|cease|ceases) to (matter|count)\b": ("is deleted", "An extremum stops to matter there."),
    r"\bwhat that (differs|gives|costs)\b": ("its difference, its cost", "A case and what that differs from the case."),
    r"\b(that|those|models|files) of before\b": ("of an older version", "It is empty for models of before."),
    r"\bh(eld|olds?|olding)( it| them| one \w+)? against\b": ("compares with", "The test holds it against the unit."),
    r"\bgives? way to\b": ("is replaced by", "A kind without an inverse gives way to the next."),
    r"\btells? nothing\b": ("is not informative", "A record of one speed tells nothing."),
    r"\b(a|an|the) \w+ that is none\b": ("invalid; no number", "A name that is none is refused."),
    r"\bso is the\b": ("repeat the verb", "If it is wrong, so is the set."),
}
READ = ("README.md", "CHANGELOG.md", "SECURITY.md", "python/docs", "tests/fmu/importers/matrix.py")
# private words of pages that users read: pattern -> the field term, and a sentence with the fault
PRIVATE: dict[str, tuple[str, str]] = {
    r"\b(the|same|equal|own) bits\b": ("bit-identical", "Both engines give the same bits."),
    r"\bplant over inverse\b": (
        "incremental gain (inverse and plant in series)",
        "The slope of plant over inverse is 1.",
    ),
    r"\bthe bend\b|\ba bend\b": ("static nonlinearity", "The plays are followed by a bend."),
    r"\bcounted rows\b": ("training rows without held-out rows", "y is the target on the counted rows."),
    r"\brate of the record\b": ("frequency of the cycles, sample rate", "A sine at the rate of the record."),
    r"\bdrawn (device|law|plant|stage)s?\b": (
        "random device; explain it once",
        "The loop is stable on all drawn devices.",
    ),
    r"\bclock stamps?\b": ("time stamp, time of day", "Date and clock stamps are read."),
}
ASKING = re.compile(r'"""(what|whether|where|why|how|which)\b')


@functools.cache
def files(place: str) -> list[Path]:
    """Tracked text files below a place; generated tables and this list are left out."""
    listed = subprocess.run(["git", "ls-files", "-z", place], cwd=ROOT, capture_output=True, text=True, check=True)
    paths = [ROOT / name for name in listed.stdout.split("\0") if name]
    return [p for p in paths if p.suffix in SUFFIXES and p.is_file() and p != Path(__file__)]


@functools.cache
def text(path: Path) -> str:
    return path.read_text(encoding="utf-8").lower()


def found(word: re.Pattern[str], paths: set[Path]) -> list[str]:
    """Return file, line and text of every match in files."""
    return [
        f"{path}:{k}: {m[0]!r}"
        for path in sorted(paths)
        if word.search(text(path))
        for k, line in enumerate(text(path).splitlines(), 1)
        if (m := word.search(line))
    ]


@pytest.mark.some(5)
@pytest.mark.parametrize("pattern", WORDS)
def test_a_replaced_word_does_not_come_back(pattern: str):
    use, places = WORDS[pattern]
    faults = found(re.compile(pattern), {p for place in places for p in files(place)})
    assert not faults, f"say {use!r} instead: {faults}"


@pytest.mark.some(6)
@pytest.mark.parametrize(("pattern", "places"), [*((p, PROSE) for p in RIDDLES), *((p, READ) for p in PRIVATE)])
def test_a_riddle_or_a_private_word_does_not_come_back(pattern: str, places: tuple[str, ...], tmp_path: Path):
    use, fault = (RIDDLES | PRIVATE)[pattern]
    planted = tmp_path / "planted.md"
    planted.write_text(f"# Page\n\n{fault}\n")
    assert len(found(re.compile(pattern), {planted})) == 1
    glossary = {ROOT / "python" / "docs" / "glossary.md"} if pattern in PRIVATE else set()
    faults = found(re.compile(pattern), {p for place in places for p in files(place)} - glossary)
    assert not faults, f"say {use!r} instead: {faults}"


def test_a_docstring_begins_with_its_subject(tmp_path: Path):
    """A verb or a noun comes first, not "What ..." or "Whether ..."."""
    planted = tmp_path / "planted.py"
    planted.write_text('def f():\n    """Whether it repeats itself."""\n')
    assert len(found(ASKING, {planted})) == 1
    faults = found(ASKING, set(files("python/hystfmu")))
    assert not faults, f"say 'Return whether ...', 'Result of ...': {faults}"


def test_every_place_has_files():
    """A place that was renamed would pass unseen."""
    for place in {*PROSE, *READ, *(place for _, places in WORDS.values() for place in places)}:
        assert files(place), f"{place} has no text files: correct the list of places"
