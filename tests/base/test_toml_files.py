"""TOML files: what is written, what is refused, and what a message says of wrong keys."""

import tomllib

import pytest
from pydantic import BaseModel

from hystfmu.base.errors import InputError, meant
from hystfmu.base.files import check, load_toml, write_toml
from hystfmu.base.printable import escape, printable, with_unit, xml_text


class Inner(BaseModel, extra="forbid"):
    gain: float


class Middle(BaseModel, extra="forbid"):
    inner: Inner


class Outer(BaseModel, extra="forbid"):
    name: str
    inner: Inner
    deep: Middle | None = None
    size: float | Inner = 1.0
    many: list[float | str] = []
    pair: tuple[int, int] | int = 1


def said(table):
    with pytest.raises(InputError) as caught:
        check(table, Outer, "a.toml")
    return str(caught.value)


@pytest.mark.parametrize(("wrong", "end"), [(20, "There is no such key."), (21, "Further wrong keys: 1.")])
def test_twenty_wrong_keys_are_listed_and_the_others_counted(wrong, end):
    told = said({"name": "a", "inner": {"gain": 1.0}} | {f"key_{k}": k for k in range(wrong)})
    assert told.count("There is no such key.") == 20
    assert told.endswith(end)


NO_KEY, LACKS, VALID = "There is no such key.", "The key is required.", "The value must be a valid"
PARSED = "number, unable to parse string as a number"


@pytest.mark.parametrize(("wrong", "told"), [
    ({"inner": {"gian": 1.0}}, f"inner.gian: {NO_KEY} Did you mean 'gain'? inner.gain: {LACKS}"),
    ({"inner": {"nmae": 2.0, "gain": 1.0}}, f"inner.nmae: {NO_KEY}"),
    ({"deep": {"inner": {"gian": 1.0}}}, f"deep.inner.gian: {NO_KEY} Did you mean 'gain'? "
     f"deep.inner.gain: {LACKS}"),
    ({"naem": "a"}, f"naem: {NO_KEY} Did you mean 'name'?"),
    ({"size": {"gian": 1.0}}, f"size.gian: {NO_KEY} Did you mean 'gain'? size.gain: {LACKS}"),
    ({"size": "x", "many": [1, {}]}, f"size: {VALID} {PARSED} or dictionary or instance of Inner. Got 'x' instead. "
     f"many.1: {VALID} number or string. Got {{}} instead."),
    ({"size": {"gain": "x"}, "many": [{}]}, f"size.gain: {VALID} {PARSED}. Got 'x' instead. "
     f"many.0: {VALID} number or string. Got {{}} instead."),
    ({"pair": [1, "x"]}, f"pair.1: {VALID} integer, unable to parse string as an integer. Got 'x' instead."),
    ({"pair": 1.5}, f"pair: {VALID} tuple or integer, got a number with a fractional part. Got 1.5 instead."),
])  # fmt: skip
def test_a_message_names_each_wrong_value_once_and_a_key_that_is_missing_beside_it(wrong, told):
    assert said({"name": "a", "inner": {"gain": 1.0}} | wrong) == f"a.toml: {told}"


def wide(n):
    """A table that takes n columns."""
    return {"x": "a" * (n - 10)}, f'{{ x = "{"a" * (n - 10)}" }}'


@pytest.mark.parametrize(("table", "text"), [
    ({"a": 1.5, "t": {"x": 1, "s": "q", "u": {}}, "b": [1, 2], "c": []},
     'a = 1.5\nb = [1, 2]\nc = []\n\n[t]\nx = 1\ns = "q"\nu = {}\n'),
    ({"t": {"u": {"v": {"x": 1}}, "w": 2}}, "\n[t]\nw = 2\n\n[t.u]\nv = { x = 1 }\n"),
    ({"t": {"u": {"v": {"x": 1}}}, "e": {}}, "\n[t.u]\nv = { x = 1 }\n\n[e]\n"),
    ({"t": {"c": [{"x": 1}, {"y": 2}], "k": {"x": 1}}}, "\n[t]\nc = [{ x = 1 }, { y = 2 }]\nk = { x = 1 }\n"),
    ({"c": [wide(115)[0], {"y": 2}]}, f"c = [\n    {wide(115)[1]},\n    {{ y = 2 }},\n]\n"),
    ({"c": [wide(116)[0], {"y": 2}]}, f"\n[[c]]\n{wide(116)[1][2:-2]}\n\n[[c]]\ny = 2\n"),
    ({"c": [wide(103)[0], {"y": 2}]}, f"c = [{wide(103)[1]}, {{ y = 2 }}]\n"),
    ({"c": [wide(104)[0], {"y": 2}]}, f"c = [\n    {wide(104)[1]}, {{ y = 2 }},\n]\n"),
    ({"c": [wide(105)[0], {"y": 2}]}, f"c = [\n    {wide(105)[1]},\n    {{ y = 2 }},\n]\n"),
    ({"t": {"u": wide(116)[0]}}, f"\n[t]\nu = {wide(116)[1]}\n"),
    ({"t": {"u": wide(117)[0], "b": 1, "d": {"x": 1}, "l": [{"x": 1}]}},
     f"\n[t]\nb = 1\n\n[t.u]\n{wide(117)[1][2:-2]}\n\n[t.d]\nx = 1\n\n[[t.l]]\nx = 1\n"),
    ({"c": [wide(103)[0], 2000]}, f"c = [{wide(103)[1]}, 2000]\n"),
    ({"c": [wide(116)[0], 2]}, f"c = [\n    {wide(116)[1]},\n    2,\n]\n"),
    ({"n": [1000] * 40}, f"n = [{', '.join(['1000'] * 40)}]\n"),  # numbers are not packed
    ({"a b": {'c"d': [1]}, "e-1": {"é": True}}, '\n["a b"]\n"c\\"d" = [1]\n\n[e-1]\n"é" = true\n'),
], ids=range(15))  # fmt: skip
def test_a_table_is_written_in_few_lines(table, text, tmp_path):
    write_toml(tmp_path / "a.toml", table, "two\nlines")
    assert (tmp_path / "a.toml").read_text() == f"# two\n# lines\n{text}"
    assert tomllib.loads(text) == table


@pytest.mark.parametrize(("table", "place"), [
    ({"a": "x\x1b", "b": [1]}, "a: The text"),
    ({"t": {"a": ["x", ["\u202e"]], "b": {}}}, "t.a.1.0: The text"),
    ({"t": [{"\x07": 1}, []]}, "t.0.\\x07: The key"),
    ({"t": {"a\n": 1}}, "t.a : The key"),
])  # fmt: skip
def test_no_character_of_a_file_controls_a_terminal(table, place, tmp_path):
    path = tmp_path / "a.toml"
    with pytest.raises(InputError, match="must hold printable characters") as refused:
        write_toml(path, table)
    assert str(refused.value).startswith(f"{path}: {place} must hold printable characters")
    assert not path.exists()
    write_toml(path, {"a": "tab\t, line\n, \u200d, \u00a0"})
    assert load_toml(path) == {"a": "tab\t, line\n, \u200d, \u00a0"}


def test_what_a_terminal_and_xml_do_not_take_is_escaped():
    assert printable("a\x1b\x85\u202e\n\u200d\u00a0é") == "a\\x1b\\x85\\u202e\\n\u200d\u00a0é"
    assert printable("a\n\t", lines=True) == "a\n\\t"
    assert escape('<a> & "b"\n\x1b') == "&lt;a&gt; &amp; &quot;b&quot;\n\\x1b"
    assert [with_unit("x", unit) for unit in ("um", "1", "")] == ["x (um)", "x", "x"]
    assert xml_text("a\x00\x1b\ud800\ufffe\t\n é\U0001f600") == "a\\x00\\x1b\\ud800\\ufffe\t\n é\U0001f600"


@pytest.mark.parametrize(("word", "known", "names"), [
    ("gian", ["offset", "gain"], ["gain"]),
    ("gain", ["gainx", "gainy", "gainz"], ["gainz", "gainy"]),  # at most two
    ("frq", ["from", "frequency"], ["frequency"]),  # the beginning of a long name
    ("fr", ["frequency"], ["frequency"]),
    ("fe", ["frequency"], []),
    ("", ["a"], []),
    ("x", ["ya", "xxxa", "xxxb", "xxxc"], ["xxxa", "xxxb"]),
])  # fmt: skip
def test_what_may_be_meant(word, known, names):
    assert meant(word, known) == (f" Did you mean {' or '.join(map(repr, names))}?" if names else "")
