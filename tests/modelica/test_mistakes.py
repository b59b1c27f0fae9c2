"""Mistakes seeded into sound classes: each must be caught by the second parser, the lint, or the compiler.

Each case changes one text in one class of the library; the unchanged classes are quiet (test_library.py).
"""

from __future__ import annotations

import shutil
from pathlib import Path

import library
import lint
import pymoca.parser
import pytest
import simulate

PLAYS, PI = "Operators/Sampled/PlayBank", "Operators/Sampled/PrandtlIshlinskii"
BASE, PID, RUN = "Operators/BaseClasses/PlayBank", "Control/Pid", "Validation/Sampled/PlayBank"
EVENTS, SUM = "Operators/Events/PlayBank", "Dynamics/Sum"

# kind of mistake: file, what stands there, what is put there, who finds it
MISTAKES = {
    "semicolon left out": (SUM, '"Constant term";', '"Constant term"', "parser"),
    "end of a when left out": (PLAYS, "  end when;\n", "", "parser"),
    "bracket not closed": (SUM, "offset + k*u", "(offset + k*u", "parser"),
    "another name at the end": (SUM, "end Sum;", "end Total;", "compiler"),
    "unknown variable": (SUM, "offset + k*u", "offset + kk*u", "compiler"),
    "unknown type": (SUM, "parameter Real offset", "parameter Reel offset", "compiler"),
    "unknown function": (PLAYS, "Functions.play(", "Functions.plays(", "compiler"),
    "unknown base class": (SUM, "extends Icons.Block;", "extends Icons.Blok;", "compiler"),
    "equation left out": (SUM, "  y = offset + k*u;\n", "", "compiler"),
    "one equation too many": (SUM, "  y = offset", "  y = 1;\n  y = offset", "compiler"),
    "argument left out": (PLAYS, "Functions.play(u, r, pre(z))", "Functions.play(u, r)", "compiler"),
    "one argument too many": (PLAYS, "Functions.play(u, r, pre(z))", "Functions.play(u, r, pre(z), 1)", "compiler"),
    "array of another size": (SUM, "k[n] = fill(1.0, n)", "k[n] = fill(1.0, n + 1)", "compiler"),
    "sum of a vector and a scalar": (SUM, "offset + k*u", "offset + k", "compiler"),
    "two components of one name": (
        SUM,
        "  parameter Real offset",
        "  parameter Real k = 1;\n  parameter Real offset",
        "compiler",
    ),
    "parameter assigned": (SUM, "  y = offset", "  offset = 1;\n  y = offset", "compiler"),
    "modifier of what does not exist": (RUN, "tested(n = 3,", "tested(m = 3,", "compiler"),
    "connection to what does not exist": (
        RUN,
        "connect(signal.r, tested.u)",
        "connect(signal.q, tested.u)",
        "compiler",
    ),
    "input left open": (RUN, "  connect(signal.r, tested.u);\n", "", "compiler"),
    "derivative of a discrete variable": (PLAYS, "  when sample", "  der(z[1]) = u;\n  when sample", "compiler"),
    "each left out": (BASE, "r[n](each min = 0)", "r[n](min = 0)", "lint"),
    "number for an array": (BASE, "r[n](each min = 0) = fill(0.1, n)", "r[n](each min = 0) = 0.1", "lint"),
    "discrete variable outside when": (
        EVENTS,
        "  when {initial(), change(rising)} then\n    z_turn = Functions.play(u, r, pre(z_turn));\n  end when;\n",
        "  z_turn = Functions.play(u, r, z_turn);\n",
        "lint",
    ),
    "discrete variable never assigned": (
        EVENTS,
        "    z_turn = Functions.play(u, r, pre(z_turn));\n",
        '    assert(true, "x");\n',
        "lint",
    ),
    "input assigned": (PID, "    e = y_d - y;", "    y_d = 0;\n    e = y_d - y;", "lint"),
    "protected variable used": (RUN, "equation\n", "  Real a;\nequation\n  a = signal.pi;\n", "lint"),
    "member that does not exist": (RUN, "equation\n", "  Real a;\nequation\n  a = tested.nothing;\n", "lint"),
    "default below its min": (PID, 'Real tau(unit = "s", min = 0) = 0', 'Real tau(unit = "s", min = 0) = -1', "lint"),
    "default above its max": (
        "Operators/BaseClasses/BoucWen",
        "alpha(min = 0, max = 1) = 0.5",
        "alpha(min = 0, max = 1) = 1.5",
        "lint",
    ),
    "unlike units joined": (
        "Examples/Pid",
        "connect(reference.dr_lead, feedforward.dr)",
        "connect(reference.dr_lead, feedforward.ddr)",
        "lint",
    ),
    "Reals compared by ==": (SUM, "y = offset + k*u", "y = if offset == 1 then 0 else offset + k*u", "lint"),
    "description left out": (SUM, 'block Sum "Weighted sum of signals"', "block Sum", "lint"),
    "documentation left out": (SUM, "Documentation(info", "Text(info", "lint"),
    "source left out": (SUM, "<p><b>Source", "<p><b>Origin", "lint"),
    "limits left out": (SUM, "<p><b>Limitation", "<p><b>Note", "lint"),
    "example left out": (SUM, "<p><b>Example", "<p><b>Note", "lint"),
    "link to what does not exist": (SUM, "modelica://HystFMU.", "modelica://HystFMU.No", "lint"),
}


def mutated(kind: str, folder: Path) -> tuple[Path, str]:
    """A copy of a file with the mistake in it, and the qualified name of its class."""
    file, old, new, _ = MISTAKES[kind]
    body = library.text(library.ROOT / f"{file}.mo")
    assert old in body, "the text to change is not there any more"
    changed = folder / f"{file.rsplit('/', 1)[1]}.mo"
    changed.write_text(body.replace(old, new))
    return changed, f"HystFMU.{file.replace('/', '.')}"


@pytest.mark.parametrize("kind", [k for k, m in MISTAKES.items() if m[3] == "parser"])
def test_second_parser_finds(kind: str, tmp_path: Path) -> None:
    changed, _ = mutated(kind, tmp_path)
    with pytest.raises(pymoca.parser.ModelicaSyntaxError):
        pymoca.parser.parse(changed.read_text())


@pytest.mark.parametrize("kind", [k for k, m in MISTAKES.items() if m[3] == "lint"])
def test_lint_finds(kind: str, tmp_path: Path) -> None:
    changed, name = mutated(kind, tmp_path)
    tree = pymoca.parser.parse(changed.read_text())
    assert tree is not None
    for part in name.split("."):
        tree = tree.classes[part]
    assert list(lint.complaints(library.Class(name, changed, tree)))


def test_compiler_finds(tmp_path: Path) -> None:
    """All of them in one process: each file in turn takes the place of the sound one in a copy of the library."""
    copy = tmp_path / "HystFMU"
    shutil.copytree(library.ROOT, copy, ignore=shutil.ignore_patterns("Resources"))
    cases = {}
    for i, kind in enumerate(k for k, m in MISTAKES.items() if m[3] == "compiler"):
        folder = tmp_path / f"case{i}"
        folder.mkdir()
        cases[kind] = mutated(kind, folder)
    sound = simulate.load_changed(copy, [(library.ROOT / "Dynamics" / "Sum.mo", "HystFMU.Dynamics.Sum")])
    assert sound == [""]
    found = dict(zip(cases, simulate.load_changed(copy, list(cases.values())), strict=True))
    for kind, complaint in found.items():
        print(f"{kind}: {complaint[:160]}")
    assert [kind for kind, complaint in found.items() if not complaint] == []


def test_there_are_kinds_enough() -> None:
    assert len(MISTAKES) >= 30
