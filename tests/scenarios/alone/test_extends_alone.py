"""Tables on top of tables: how they merge, what their paths become, and which file an error names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from hystfmu.base.errors import InputError
from hystfmu.scenario.system.extends import _are_same, _merge, _merge_cases, _names_once, _origin, _rebased


def test_tables_merge_and_all_else_replaces() -> None:
    below = {"a": 1, "t": {"x": 1, "y": {"p": 1}}, "l": [1, 2], "k": {"z": 1}}
    own = {"a": 2, "t": {"y": {"q": 2}}, "l": [3], "k": 5, "new": {"n": 1}}
    assert _merge(below, own) == {
        "a": 2, "t": {"x": 1, "y": {"p": 1, "q": 2}}, "l": [3], "k": 5, "new": {"n": 1},
    }  # fmt: skip
    assert below["t"] == {"x": 1, "y": {"p": 1}}, "the table below stays as it is"
    assert _merge({"t": 1}, {"t": {"x": 1}}) == {"t": {"x": 1}}


@pytest.mark.parametrize("source", ["model", "block", "graph", "inverse_of", "fmu"])
def test_a_unit_that_names_its_source_replaces_the_other(source: str) -> None:
    below = {"units": {"a": {"block": "pid", "values": {"Kp": 1}, "every": 2}}}
    assert _merge(below, {"units": {"a": {source: "x"}}}) == {"units": {"a": {source: "x"}}}
    kept = _merge(below, {"units": {"a": {"every": 3}}})
    assert kept == {"units": {"a": {"block": "pid", "values": {"Kp": 1}, "every": 3}}}


def test_cases_merge_by_name() -> None:
    below = [{"name": "a", "stop": 1, "set": {"x": 1}}, {"name": "b", "stop": 2}, {"name": "c"}]
    own: list[Any] = [{"name": "c", "stop": 3}, {"name": "a", "set": {"y": 2}}, {"name": "d"}, {"stop": 9}, 7]
    assert _merge_cases(below, own) == [
        {"name": "c", "stop": 3}, {"name": "a", "stop": 1, "set": {"x": 1, "y": 2}}, {"name": "d"}, {"stop": 9}, 7,
        {"name": "b", "stop": 2},
    ]  # fmt: skip
    assert _merge({"case": below}, {"case": own})["case"][0] == {"name": "c", "stop": 3}
    assert _merge({"case": below}, {"case": 3}) == {"case": 3}
    assert _merge({"case": {"x": 1}}, {"case": own}) == {"case": own}
    assert _merge({"other": [{"name": "a"}]}, {"other": [{"name": "b"}]}) == {"other": [{"name": "b"}]}
    assert _merge_cases([{"name": 3}, {"name": "a"}, 4], []) == [{"name": "a"}]


def test_a_name_stands_once() -> None:
    _names_once([{"name": "a"}, {"name": "b"}, 3, {"x": "a"}], Path("f"))
    _names_once(None, Path("f"))
    with pytest.raises(InputError, match=r"^f: extends: two cases have the name 'a'$"):
        _names_once([{"name": "a"}, {"name": "b"}, {"name": "a"}], Path("f"))


def test_paths_become_relative_to_the_first_file() -> None:
    def table() -> dict[str, Any]:
        return {
            "units": {
                "a": {"model": "m.toml"}, "b": {"inverse_of": "../x/m.toml"}, "c": {"fmu": "f.fmu", "block": "n"},
                "d": {"block": "m.toml"}, "e": {"model": "/abs"}, "f": {"model": 3}, "g": 4,
            },
            "case": [{"units": {"a": {"model": "n.toml"}}}, {"units": 3}, 5],
            "conditions": {"hot": {"units": {"a": {"fmu": "h.fmu"}}}, "cold": 2},
            "model": "m.toml",
        }  # fmt: skip

    assert _rebased(table(), Path("/s/one"), Path("/s/one")) == table()
    found = _rebased(table(), Path("/s/base"), Path("/s/one"))
    assert found["units"] == {
        "a": {"model": "../base/m.toml"}, "b": {"inverse_of": "../x/m.toml"},
        "c": {"fmu": "../base/f.fmu", "block": "n"}, "d": {"block": "m.toml"}, "e": {"model": "/abs"},
        "f": {"model": 3}, "g": 4,
    }  # fmt: skip
    assert found["case"][0] == {"units": {"a": {"model": "../base/n.toml"}}}
    assert found["conditions"]["hot"] == {"units": {"a": {"fmu": "../base/h.fmu"}}}
    assert found["model"] == "m.toml"
    for odd in ({"units": 3}, {"case": 3}, {"conditions": [1]}, {}):
        assert _rebased(dict(odd), Path("/s/base"), Path("/s/one")) == odd


def test_an_error_names_the_file_that_states_most_of_its_key() -> None:
    own = {"a": {"x": 1}, "case": [{"name": "p", "stop": 1}]}
    below = {"a": {"x": 1, "y": 2}, "b": 1, "case": [{"name": "q", "set": {"k": 1}}, {"name": "p", "step": 2}]}
    layers = [(Path("own"), own), (Path("below"), below)]
    merged = _merge(dict(below), own)
    assert [c["name"] for c in merged["case"]] == ["p", "q"]
    for key, file in [
        (["a", "x"], "own"), (["a", "y"], "below"), (["b"], "below"), (["none"], "own"), (["a", "none"], "own"),
        (["case", 0, "stop"], "own"), (["case", 0, "step"], "below"), (["case", 1, "set", "k"], "below"),
        (["case", 1, "none"], "below"), (["a", "x", "deep"], "own"),
    ]:  # fmt: skip
        assert _origin(layers, merged, key) == Path(file), key


def test_a_case_is_itself_or_has_its_name() -> None:
    one: dict[str, Any] = {"stop": 1}
    assert _are_same(one, one)
    assert not _are_same(one, {"stop": 1})
    assert _are_same({"name": "a"}, {"name": "a", "stop": 1})
    assert not _are_same({"name": "a"}, {"name": "b"})
    assert not _are_same({"name": "a"}, 3)
