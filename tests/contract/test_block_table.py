"""Table of every block: legal unique names, complete rows in order, a registry without gaps."""

import keyword
import re
import tomllib
from pathlib import Path

import numpy as np
from excitation import default, every_block, perturbed, rows, run, some
from raw import Raw

from hystfmu.core.library import STEP, block_types
from hystfmu.graph.listing import FAMILIES

ROOT = Path(__file__).parents[2]
C_WORDS = set(
    re.findall(
        r"\w+",
        """auto break case char const continue default do double else enum extern float for goto if inline int long
    register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while
    and asm bool catch class delete explicit export false friend mutable namespace new not operator or private protected
    public template this throw true try typename using virtual xor""",
    )
)
MODELICA_WORDS = set(
    re.findall(
        r"\w+",
        """algorithm and annotation assert block break class connect connector constant constrainedby der discrete each
    else elseif elsewhen encapsulated end enumeration equation expandable extends external false final flow for function
    if import impure in initial inner input loop model not operator or outer output package parameter partial protected
    public pure record redeclare replaceable return stream then time true type when while within""",
    )
)


def legal(name: str) -> bool:
    return (
        re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*[A-Za-z0-9]|[A-Za-z]", name) is not None  # C, Python, Modelica, XML NCName
        and not keyword.iskeyword(name)
        and name not in C_WORDS
        and name not in MODELICA_WORDS
        and name != "dt"  # an argument of update() and prepare()
    )


@every_block
def test_names_are_legal_in_four_languages(name: str) -> None:
    block = block_types()[name]
    words = [c for v in block.vars for c in v.choices]
    names = [v.name for v in block.vars] + [d.name for d in block.dims]
    assert [n for n in [*names, *words, name, block.class_name] if not legal(n)] == []


@every_block
def test_no_name_is_used_twice(name: str) -> None:
    block = block_types()[name]
    names = [v.name for v in block.vars] + [d.name for d in block.dims]
    assert sorted(names) == sorted(set(names))
    visible = [s for p in default(name).ports for s in p.scalar_names]
    assert len(visible) == len(set(visible))


@every_block
def test_rows_come_in_the_order_that_the_layout_needs(name: str) -> None:
    kinds = [v.kind for v in block_types()[name].vars]
    for first, then in (("cstate", "state"), ("param", "derived"), ("fixed", "derived")):
        if first in kinds and then in kinds:
            assert max(i for i, k in enumerate(kinds) if k == first) < kinds.index(then), f"{first} after {then}"


@every_block
def test_every_row_is_complete(name: str) -> None:
    block = block_types()[name]
    for text in (
        block.text,
        block.equation,
        block.source,
        *(d.text for d in block.dims),
        *(v.text for v in block.vars),
    ):
        assert text.strip() == text
        assert text
        assert not text.endswith(".")
    assert block.of("output"), "no output"
    for d in block.dims:
        assert 0 <= d.lo <= d.start <= d.hi, d
    for v in block.vars:
        assert v.unit, v
        assert v.lo <= v.start <= v.hi, v
        assert np.isfinite(v.start), v
        assert v.type in ("real", "int", "bool") or len(v.choices) > 1, v
        if v.choices:
            assert (v.lo, v.hi) == (0, len(v.choices) - 1), v
        if v.type == "bool":
            assert (v.lo, v.hi) == (0, 1), v
    assert bool(block.of("cstate")) == bool(block.raw.deriv), "continuous states and deriv() go together"
    assert bool(block.of("derived")) <= bool(block.raw.prepare), "derived values need prepare()"


@every_block
def test_what_a_run_writes_starts_at_zero(name: str) -> None:
    """Loops read outputs before the first step, and init() begins with zeroed states: no row may say otherwise."""
    for v in block_types()[name].of("input", "time", "output", "cstate", "state"):
        learns = (name, v.name) == ("repetitive", "active")  # unless a wire says no
        assert v.start == (1 if learns else 0), v


@every_block
def test_trials_have_the_places_that_the_graph_expects(name: str) -> None:
    """`core/graph/implicit.h` names them: limits, wanted value, output, root and what it was found for."""
    block = block_types()[name]
    if not block.trial:
        assert block.tried is None
        return
    assert block.rate == "hysteretic"
    assert [v.name for v in block.of("param", "fixed", "derived")][:2] == ["lo", "hi"]
    inputs, outputs = block.of("input", "time"), block.of("output")
    assert {v.size for v in (*inputs, *outputs)} == {"1"}
    assert block.tried == inputs[block.trial - 1].name != inputs[0].name
    assert len(outputs) == 1
    assert [v.size for v in block.of("cstate", "state")] == ["1", "4", "2"]


@every_block
def test_rate_agrees_with_the_functions(name: str) -> None:
    block = block_types()[name]
    has_update, has_deriv = bool(block.raw.update), bool(block.raw.deriv)
    assert has_deriv == (block.rate == "continuous"), "deriv() and only deriv() makes a block continuous"
    assert has_update == (block.rate != "function"), "a function has no update(), every other block has one"


@every_block
def test_what_is_not_rate_independent_looks_at_the_time(name: str) -> None:
    """The counterpart of test_rate_independence: no hysteretic block is declared as sampled."""
    block = block_types()[name]
    if block.rate != "sampled":
        return
    differs = []
    real = {v.name for v in block.parameters if v.type == "real"}
    for n in (perturbed(n, real) for n in some(block)):
        u = rows(block, dict(n.dims))
        fast, slow = (run(n, np.repeat(u, k, axis=0))[k - 1 :: k] for k in (1, 2))
        differs.append(not np.array_equal(fast, slow, equal_nan=True))
    assert any(differs), "declared as sampled, but a repeated input changes nothing: declare it as hysteretic"


@every_block
def test_family_inverse_and_tolerance(name: str) -> None:
    block, types = block_types()[name], block_types()
    assert block.family in FAMILIES
    assert bool(block.inverts) == bool(block.invert_condition)
    assert 0 <= block.rule_error <= 1e-3
    assert 0 <= block.rule_step <= 1e-3
    assert 0 < block.smooth <= 1e-3
    if block.inverts:
        of = types[block.inverts]
        assert of.inverse == name, "two blocks invert the same one"
        assert [len(b.of(kind)) for b in (block, of) for kind in ("input", "output")] == [1, 1, 1, 1]
        assert of.inverse_condition == block.inverse_condition == block.invert_condition
    assert block.tolerance in ("rounding", "iteration", "integration")
    assert (block.rule_error > 0) == (block.tolerance == "integration")
    assert bool(block.rule_step) <= (block.tolerance == "integration" and block.rate == "continuous")
    assert block.hold in ("zoh", "foh")
    assert block.hold == "zoh" or not any(v.name == "hold" for v in block.vars), "the parameter says it"


def test_vectors_meet_the_tolerance_of_their_block() -> None:
    """A vector of a block without rule or iteration holds to rounding; in `published`, to the digits printed there."""
    files = {f.stem: f for f in (ROOT / "tests" / "vectors" / "derived").glob("*.toml")}
    for name in files.keys() & block_types().keys():
        file, block = files[name], block_types()[name]
        for case in tomllib.loads(file.read_text())["case"]:
            assert block.tolerance != "rounding" or case["tolerance"] <= 1e-12 * max(1, np.abs(case["y"]).max()), file


@every_block
def test_derived_values_that_depend_on_the_step_are_flagged(name: str) -> None:
    block = block_types()[name]
    for n in some(block):
        a, b = Raw(n), Raw(n)
        a.prepare(0.01), b.prepare(0.02)
        assert np.array_equal(a.p, b.p) or block.flags & STEP


def test_registry_is_the_folders_of_the_families() -> None:
    files = {(f.parent.name, f.stem) for f in (ROOT / "fmu_build" / "core" / "blocks").rglob("*.c")}
    registered = {(b.family, b.name) for b in block_types().values()}
    missing = [f"B({name}) in fmu_build/core/blocks.c" for _, name in sorted(files - registered)]
    missing += [f"fmu_build/core/blocks/{family}/{name}.c" for family, name in sorted(registered - files)]
    assert not missing, f"write {', '.join(missing)}: a block is a file in the folder of its family and a registry word"


def test_registry_is_sorted() -> None:
    assert list(block_types()) == sorted(block_types())


@every_block
def test_at_least_one_sourced_vector(name: str) -> None:
    files = [ROOT / "tests" / "vectors" / kind / f"{name}.toml" for kind in ("published", "derived")]
    assert any(f.exists() for f in files), f"{name} has no vectors: write {files[1].relative_to(ROOT)} with a `source`"


@every_block
def test_every_element_of_a_row_is_written(name: str) -> None:
    """prepare() writes all derived values and a run changes every state: a row longer than that would be waste.

    Turning points fill with the reversals of an input; what a search for a root keeps needs a model around it.
    """
    block, moved, written = block_types()[name], [], []
    real = {v.name for v in block.parameters if v.type == "real"}
    for n in [p for s in some(block) for p in (s, perturbed(s, real))]:
        raw = Raw(n)
        for v in block.of("derived"):
            raw.p[raw.places[v.name]] = 1.2345e77
        assert raw.prepare(0.0) is None
        assert raw.prepare(0.05) is None
        written.append(raw.p != 1.2345e77)
        raw.init()
        for k, row in enumerate(rows(block, dict(n.dims), 200)):
            raw.set_inputs(row, k * 0.05)
            raw.update(0.05 if k else 0.0)
            moved.append(raw.x != 0)
    for v in block.of("derived"):
        assert np.any(written, axis=0)[raw.places[v.name]].all(), v
    for v in block.of("cstate", "state"):
        if not block.trial and "TURNING_POINTS" not in v.size:
            assert np.any(moved, axis=0)[raw.places[v.name]].all(), v


@every_block
def test_derived_values_lie_within_their_rows(name: str) -> None:
    block = block_types()[name]
    real = {v.name for v in block.parameters if v.type == "real"}
    for n in [p for s in some(block) for p in (s, perturbed(s, real))]:
        raw = Raw(n)
        for dt in (0.0, 0.05):
            assert raw.prepare(dt) is None
            for v in block.of("derived"):
                found = raw.p[raw.places[v.name]]
                assert ((found >= v.lo) & (found <= v.hi)).all(), v
