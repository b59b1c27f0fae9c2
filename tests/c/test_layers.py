"""The C files stand in layers: no circle of includes or calls, a header for every file, rooms of at most 20 files.

A header counts as its .c file: whoever includes `run.h` stands above `run.c`.
"""

import functools
import re
from collections import Counter
from pathlib import Path

from amalgamate import blank, top_level
from house.imported import circle

ROOT = Path(__file__).parents[2] / "fmu_build"
FILES = sorted(p for room in ("core", "fmi", "master") for p in (ROOT / room).rglob("*.[ch]"))
# their headers are those of the standards; a block is seen by its descriptor alone
STANDARDS, BLOCKS = ROOT / "fmi" / "standards", ROOT / "core" / "blocks"


def unit(path: Path) -> str:
    """The name that a header and its .c file share."""
    return path.relative_to(ROOT).with_suffix("").as_posix()


def functions(text: str) -> tuple[set[str], set[str]]:
    """Functions that a file declares for others, and those that it defines for others; words in capitals are macros."""
    declared, defined = set(), set()
    for end in re.finditer(r"[^;}]*[;}]", top_level(text)):
        words = end[0]
        name = re.search(r"^[^(=]*?\b([a-z]\w+)\s*\(", words, re.S)
        if name and not re.search(r"\b(?:static|typedef)\b", words):
            (defined if words.endswith("}") else declared).add(name[1])
    return declared, defined


TEXTS = {p: p.read_text() for p in FILES}
DEFINED = {name: unit(p) for p in FILES if p.suffix == ".c" for name in functions(TEXTS[p])[1]}


@functools.cache
def edges() -> dict[str, set[str]]:
    """For every unit the units that it includes or calls."""
    found: dict[str, set[str]] = {unit(p): set() for p in FILES}
    for path, text in TEXTS.items():
        included = {unit(ROOT / name) for name in re.findall(r'^#include "([^"]+/[^"]+)"', text, re.M)}
        bodies = text if path.is_relative_to(STANDARDS) else blank(text)  # there macros make the functions
        called = {DEFINED[w] for w in set(re.findall(r"\w+", bodies)) & set(DEFINED)}
        found[unit(path)] |= (included | called) - {unit(path)}
    return found


def test_the_files_form_no_circle() -> None:
    found = edges()
    assert sum(map(len, found.values())) > 150, "the parser sees too little"
    assert "core/graph/run" in found["fmi/life"]
    assert circle(found) == []


def test_what_a_file_gives_to_others_is_declared_in_its_own_header() -> None:
    declared = {(name, unit(p)) for p in FILES if p.suffix == ".h" for name in functions(TEXTS[p])[0]}
    wrong = []
    for path in FILES:
        if path.suffix != ".c" or STANDARDS in path.parents or BLOCKS in path.parents:
            continue
        own = functions(TEXTS[path])[1]
        assert own, f"{path}: the parser sees no function"
        wrong += [f"{unit(path)}.h lacks {name}" for name in own if (name, unit(path)) not in declared]
    assert wrong == []


def test_layers_of_the_fmi_functions() -> None:
    """instance < messages < values < event < state, derivative < life < the functions of the standards."""
    order = ["instance", "messages", "values", "event", "state", "derivative", "life"]
    found = edges()
    for k, name in enumerate(order):
        for below in order[k + 1 :]:
            assert f"fmi/{below}" not in found[f"fmi/{name}"]
        assert not {u for u in found[f"fmi/{name}"] if u.startswith("fmi/standards/")}


def test_the_core_includes_nothing_from_above() -> None:
    for name, below in edges().items():
        if name.startswith("core/"):
            assert not {u for u in below if not u.startswith("core/")}, name
        if name.startswith(("core/blocks/", "core/memory/", "core/elementary/")):
            assert not {u for u in below if u.startswith(("core/graph/", "core/block_file/"))}, name


def test_rooms_are_small_and_names_are_used_once() -> None:
    rooms = Counter(p.parent for p in FILES)
    assert {str(k): n for k, n in rooms.items() if n > 20} == {}
    stems = Counter(p.stem for p in FILES if p.suffix == ".c")  # one translation unit puts them in front of names
    assert [s for s, n in stems.items() if n > 1] == []
