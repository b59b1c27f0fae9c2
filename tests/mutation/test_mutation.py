"""The tools of `make mutants`: what they change, draw, run and count."""

import gc
import json
import os
import shutil
import signal
import types
from pathlib import Path

import pytest
from mutation import c_operators, choose, equivalents, line_map, python_operators, sample, summary
from mutation.judge import Outcome, judge
from mutation.swap import loaded_functions, swap_core, swap_python

from hystfmu.core.library import library

ROOT = Path(__file__).parents[2]

PYTHON = '''"""Text with 1 < 2."""
def f(x: int = 3):
    # a < b
    if x < 1 and not g(x):
        raise ValueError(f"{x + 1}")
    h(x)
    assert x != 9
    zip(x, x, strict=True)
    return -x
'''
PYTHON_LINES = [
    "def f(x: int = 4):", "if x <= 1 and not g(x):", "if x >= 1 and not g(x):", "if x < 2 and not g(x):",
    "if x < 1 or not g(x):", "if x < 1 and g(x):", "if (not (x < 1 and not g(x))):", "pass", "pass", "return None",
    "return x",
]  # fmt: skip
C = """#include "a-b.h" /* a < b */
static double f(const double *x, int n) {
  if (n > 0 && x[0] != 2.5) g("a + b", n);
  return -x[n] * n;
}
typedef struct { char magic[8]; } head;
static void g(int n) {
  char why[64];
  take(malloc(n + 1), calloc(4, n / 3));
}
"""
C_LINES = [
    "static double f(const double /x, int n) {",  # no C: the compiler refuses it
    'if (n >= 0 && x[0] != 2.5) g("a + b", n);',
    'if (n <= 0 && x[0] != 2.5) g("a + b", n);',
    'if (n > 1 && x[0] != 2.5) g("a + b", n);',
    'if (n > 0 || x[0] != 2.5) g("a + b", n);',
    'if (n > 0 && x[1] != 2.5) g("a + b", n);',
    'if (n > 0 && x[0] == 2.5) g("a + b", n);',
    'if (n > 0 && x[0] != 3.5) g("a + b", n);',
    'if (!(n > 0 && x[0] != 2.5)) g("a + b", n);',
    "return x[n] * n;",
    "return -x[n] / n;",
    "return 0;",
    "typedef struct { char magic[9]; } head;",  # the sizes in g() stay: with more memory it does the same
    "take(malloc(n - 1), calloc(4, n / 3));",
    "take(malloc(n + 1), calloc(4, n * 3));",
    "take(malloc(n + 1), calloc(4, n / 4));",
    ";",
]


@pytest.mark.parametrize(
    ("operators", "text", "lines"), [(python_operators, PYTHON, PYTHON_LINES), (c_operators, C, C_LINES)], ids="pc"
)
def test_every_operator_changes_what_it_names_and_nothing_else(operators, text, lines):
    assert sorted(m.change(text)[1] for m in operators.mutants("file", text)) == sorted(lines)


def test_texts_with_the_same_code_are_known():
    assert python_operators.same("x = 1  # a\n", "x = (1)\n")
    assert not python_operators.same("x = 1\n", "x = 2\n")
    assert not python_operators.valid("x = \n")


def test_a_sample_follows_from_its_seed_and_gives_each_file_its_share():
    texts = {str(p.relative_to(ROOT)): p.read_text() for p in (ROOT / "python/hystfmu/studies").glob("*.py")}
    first = sample.sequence(texts, "studies", 5)
    assert first == sample.sequence(texts, "studies", 5)
    assert first[:50] != sample.sequence(texts, "studies", 6)[:50]
    assert len(set(first)) == len(first) == sum(len(sample.mutants(f, t)) for f, t in texts.items())
    for file, text in texts.items():
        share = 100 * len(sample.mutants(file, text)) / len(first)
        assert abs(sum(m.file == file for m in first[:100]) - share) <= 2, file


def test_listed_equivalents_are_changes_of_todays_files():
    assert not equivalents.stale(ROOT)
    assert all(len(reason) > 20 for reason in equivalents.listed().values())


def test_a_loaded_function_gets_the_code_of_its_mutant(tmp_path):
    path, text = tmp_path / "some.py", "LIMIT = 3\ndef f(x):\n    return [g for g in x if g < LIMIT]\n"
    module = types.ModuleType("some")
    exec(compile(text, str(path), "exec"), vars(module))
    gc.freeze()  # as after the collection of tests
    loaded = loaded_functions(tmp_path)
    assert not swap_python(path, text, text.replace("3", "4"), loaded)  # the body of the module needs a new start
    assert swap_python(path, text, text.replace("<", ">"), loaded)
    assert module.f(range(6)) == [4, 5]


def test_the_map_replaces_the_tests_of_a_changed_module():
    table = {"seconds": {"a::x": 1.0, "b::x": 2.0}, "lines": {"f": {"1": ["a::x", "b::x"]}}, "codes": {"f": "k"}}
    part = {
        "seconds": {"b::y": 3.0},
        "lines": {"f": {"2": ["b::y"]}, "g": {"1": ["b::y"]}},
        "codes": {"f": "k", "g": "n"},
    }
    line_map.merge(table, part, {"b"})
    assert table["seconds"] == {"a::x": 1.0, "b::y": 3.0}
    assert table["lines"] == {"f": {"1": ["a::x"], "2": ["b::y"]}, "g": {"1": ["b::y"]}}
    assert table["codes"] == {"f": "k", "g": "n"}


@pytest.mark.parametrize(("modules", "sources", "stale"), [
    ({"a": "1", "b": "1"}, {"f": "1", "g": "1"}, []),
    ({"a": "2", "b": "1", "c": "1"}, {"f": "1", "g": "1"}, ["a", "c"]),
    ({"a": "1", "b": "1"}, {"f": "1", "g": "2"}, ["b"]),
    ({"a": "1", "b": "1"}, {"g": "1"}, ["a", "b"]),  # f is gone
])  # fmt: skip
def test_what_a_change_of_tests_or_sources_makes_run_again(modules, sources, stale):
    lines = {"f": {"1": ["a::x", "b::x"]}, "g": {"4": ["b::y"]}}
    table = {"lines": lines, "codes": {"f": "1", "g": "1"}, "modules": {"a": "1", "b": "1"}}
    assert line_map.out_of_date(table, modules, lambda file: sources.get(file, "")) == stale


@pytest.mark.parametrize(("operators", "file", "text", "read"), [
    (c_operators, "fmu_build/core/blocks/a/b.c", "#define VARS 1\nint f(int x) {\n  return x + 1;\n}\n",
     "tests/contract/test_block_table.py::test_rows[b]"),
    (python_operators, "python/hystfmu/identify/b.py", "N = 1\ndef f(x):\n    return x + 1\n",
     "tests/identify/choice/test_option_tables.py::test_rows[b]"),
], ids=["C", "Python"])  # fmt: skip
def test_tables_are_judged_by_those_that_read_them(operators, file, text, read, tmp_path):
    run = "tests/blocks/test_b.py::test_f"
    table = {
        "seconds": {read: 0.1, run: 0.1},
        "lines": {file: {"1": [run], "3": [run]}},
    }  # the compiler may take a row for code
    (tmp_path / "map.json").write_text(json.dumps(table))
    row, inside = operators.mutants(file, text)[0], operators.mutants(file, text)[-1]
    tests = choose.Tests(tmp_path / "map.json")
    assert [m.line(text) for m in (row, inside)] == [1, 3]
    assert sorted(tests.for_mutant(row, text)) == sorted([run, read])
    assert tests.for_mutant(inside, text) == [run]


def test_a_long_test_does_not_displace_short_ones(tmp_path):
    file, text = "python/hystfmu/identify/b.py", "def f(x):\n    return x + 1\n"
    long, short = "tests/identify/test_b.py::test_long", "tests/identify/test_x.py::test_short"
    table = {"seconds": {long: 9.0, short: 0.1}, "lines": {file: {"2": [long, short]}}}
    (tmp_path / "map.json").write_text(json.dumps(table))
    mutant, tests = python_operators.mutants(file, text)[0], choose.Tests(tmp_path / "map.json")
    assert tests.for_mutant(mutant, text) == [short]
    tests.killed(mutant, long)
    assert tests.for_mutant(mutant, text) == [long]
    table["lines"][file]["2"] = [long]
    (tmp_path / "map.json").write_text(json.dumps(table))
    assert choose.Tests(tmp_path / "map.json").for_mutant(mutant, text) == [long]


def test_a_function_that_was_not_seen_to_run_is_judged_by_all_tests_of_its_file(tmp_path):
    file, text = "python/hystfmu/studies/b.py", "def f(x):\n    return x + 1\ndef g(x):\n    return x - 1\n"
    table = {"seconds": {"a::f": 0.1, "a::h": 0.1}, "lines": {file: {"2": ["a::f"], "9": ["a::h"]}}}
    (tmp_path / "map.json").write_text(json.dumps(table))
    tests, (in_f, *_, in_g) = choose.Tests(tmp_path / "map.json"), python_operators.mutants(file, text)
    assert tests.for_mutant(in_f, text) == ["a::f"]
    assert sorted(tests.for_mutant(in_g, text)) == ["a::f", "a::h"]


def test_tests_of_the_room_come_before_those_that_only_run_it(tmp_path):
    file, text = "python/hystfmu/studies/b.py", "def f(x):\n    return x + 1\n"
    own, others = "tests/study/test_y.py::test_own", [f"tests/face/test_x.py::test_{k}" for k in range(20)]
    table = {"seconds": {own: 0.9} | dict.fromkeys(others, 0.5), "lines": {file: {"2": [own, *others]}}}
    (tmp_path / "map.json").write_text(json.dumps(table))
    chosen = choose.Tests(tmp_path / "map.json").for_mutant(python_operators.mutants(file, text)[0], text)
    assert chosen[0] == own
    assert len(chosen) < 20


def test_a_header_is_judged_by_the_module_that_compiles_it(tmp_path):
    file, text = "fmu_build/core/elementary/e.h", "static double f(double x) {\n  return x + 1;\n}\n"
    own, run = "tests/c/test_elementary.py::test_bound", "tests/blocks/test_b.py::test_f"
    table = {"seconds": {own: 0.1, run: 0.1}, "lines": {file: {"2": [run]}}}
    (tmp_path / "map.json").write_text(json.dumps(table))
    tests = choose.Tests(tmp_path / "map.json")
    assert all(sorted(tests.for_mutant(m, text)) == [run, own] for m in c_operators.mutants(file, text))


def test_a_fork_runs_the_core_of_a_mutant(tmp_path):
    (tmp_path / "build").mkdir()
    copy = Path(shutil.copy(library()._name, tmp_path))

    def work():
        swap_core(copy)
        return Outcome(library()._name)

    assert judge(work, tmp_path, 5).failed == str(tmp_path / "swapped" / copy.name)


def fault():
    raise OSError("disk")


@pytest.mark.parametrize(("work", "said"), [
    (lambda: Outcome("tests/a.py::b"), "tests/a.py::b"),
    (lambda: Outcome(), ""),
    (lambda: os.kill(os.getpid(), signal.SIGKILL), "crash or CPU limit"),
], ids=["fails", "passes", "crashes"])  # fmt: skip
def test_a_fork_answers_or_crashes(work, said, tmp_path):
    (tmp_path / "build").mkdir()
    assert judge(work, tmp_path, 5).failed == said


def test_an_error_of_the_runner_is_no_verdict(tmp_path):
    (tmp_path / "build").mkdir()
    with pytest.raises(RuntimeError, match="disk"):
        judge(fault, tmp_path, 5)


def test_the_score_counts_decided_mutants_and_names_survivors(tmp_path):
    journal = tmp_path / "seed-1.jsonl"
    verdicts = ["killed"] * 9 + ["survived", "invalid", "equivalent", "listed"]
    lines = [{"room": "fmi", "verdict": v, "file": "a.c", "line": 7, "old": "a < b", "new": "a > b"} for v in verdicts]
    journal.write_text("\n".join(map(json.dumps, lines)) + '\n{"room": "fm')  # the last line was interrupted
    rows = summary.rows(journal)
    assert summary.score(rows) == (9, 10)
    assert "90.0%" in summary.table(rows)
    assert summary.survivors(rows) == "a.c:7\n  - a < b\n  + a > b"
