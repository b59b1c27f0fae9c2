"""The way of the data through a fit: how many functions receive the record, and how often it returns to an upper room.

`sys.setprofile` notes each function of the package at its first call with a `Dataset` among its arguments: the record
itself or data made from it. Methods of `Dataset` and functions inside others do not count. A room is a folder. The way
climbs where the next function lies in another room, in a module that imports the module before, directly or not.
"""

import inspect
import sys
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from pathlib import Path

import plants
import pytest
from house.imported import MODULES, PACKAGE, imports

import hystfmu as hy
from hystfmu.data.signals import training


@cache
def below(module: str) -> frozenset[str]:
    """Return all modules that a module imports, directly or not."""
    found: set[str] = set()
    new = set(imports(module))
    while new:
        found |= new
        new = {m for other in new for m in imports(other)} - found
    return frozenset(found)


def room(module: str) -> str:
    return module if MODULES[module].name == "__init__.py" else module.rpartition(".")[0]


def walk(run: Callable[[], object]) -> list[tuple[str, str]]:
    """Return module and name of each function that receives data, in the order of the first calls."""
    seen: dict[tuple[str, str], None] = {}

    def note(frame, event, _):
        code = frame.f_code
        if event != "call" or not code.co_filename.startswith(str(PACKAGE)) or "<" in code.co_qualname:
            return
        count = code.co_argcount + code.co_kwonlyargcount
        names = code.co_varnames[: count + bool(code.co_flags & inspect.CO_VARARGS)]
        if code.co_qualname.startswith("Dataset.") or code.co_name == "checked":
            return
        if any(isinstance(frame.f_locals[n], hy.Dataset) for n in names):
            parts = Path(code.co_filename).relative_to(PACKAGE.parent).with_suffix("").parts
            seen.setdefault((".".join(p for p in parts if p != "__init__"), code.co_qualname))

    sys.setprofile(note)
    try:
        run()
    finally:
        sys.setprofile(None)
    return list(seen)


def climbs(way: list[tuple[str, str]]) -> list[str]:
    modules = [m for m, _ in way]
    steps = pairwise(modules)
    return [f"{a} -> {b}" for a, b in steps if room(a) != room(b) and a in below(b)]


@pytest.fixture
def record():
    u = training(30, 4, 0.03)
    return hy.Dataset.from_signal(u, plants.bouc_wen(u), 1e-3, "walk")


@pytest.mark.turn("the way of the data")
def test_a_kind_by_name(record):
    way = walk(lambda: hy.fit(record, "bouc_wen", starts=1))
    told = "\n".join(f"{m}.{f}" for m, f in way)
    assert len(way) <= 20, told
    assert len(climbs(way)) <= 2, "\n".join([*climbs(way), "", told])


@pytest.mark.turn("the way of the data")
def test_a_choice_that_ends_at_the_true_kind(record):
    """Two kinds are fitted; each kind that a noisy record asks for adds its own functions (61 in all, 7 climbs)."""
    way = walk(lambda: hy.fit(record))
    told = "\n".join(f"{m}.{f}" for m, f in way)
    assert len(way) <= 32, told
    assert len(climbs(way)) <= 2, "\n".join([*climbs(way), "", told])


@pytest.mark.turn("the way of the data")
def test_a_walk_is_seen(record):
    """The fit of the test above reaches the kind, and a step from a lower room to an upper one is a climb."""
    way = [("hystfmu.face.fit", "fit"), ("hystfmu.identify", "fit"), ("hystfmu.model", "run_along")]
    assert climbs(way) == []
    assert climbs([*way, ("hystfmu.identify.one", "finished")]) == ["hystfmu.model -> hystfmu.identify.one"]
    found = walk(lambda: hy.fit(record, "prandtl_ishlinskii", N=3))
    assert ("hystfmu.identify.methods.weighted_sums", "prandtl_ishlinskii") in found
    assert found[0] == ("hystfmu.face.fit", "fit")
