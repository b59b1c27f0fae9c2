"""Mistakes to seed into sound classes: what is changed, who finds it, and in which words."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Mistake:
    """`old` in a file of the library becomes `new`; `finder` says so in a line with the words `says`.

    Finders: "parser" (pymoca), "compiler" (rumoca 0.10.2), "lint" (`says` begins with the rule), "table" (the C table).
    """

    file: str
    old: str
    new: str
    finder: str
    says: str


SUM = "Dynamics/Sum"
PLAYS = "Operators/Sampled/PlayBank"
BASE = "Operators/BaseClasses/PlayBank"
PID = "Control/Pid"
RUN = "Validation/Sampled/PlayBank"
EVENTS = "Operators/Events/PlayBank"
CREEP = "Operators/Sampled/Creep"
FILTER = "Dynamics/RateFilter"
DIFF = "Dynamics/Differentiator"
MLP = "Networks/Mlp"

MISTAKES = {
    "semicolon left out": Mistake(SUM, '"Constant term";', '"Constant term"', "parser", "missing ';' at"),
    "end of a when left out": Mistake(PLAYS, "  end when;\n", "", "parser", "mismatched input 'annotation'"),
    "bracket not closed": Mistake(
        SUM, "offset + k*u", "(offset + k*u", "parser", "no viable alternative at input '(offset+k*u;'"
    ),
    "another name at the end": Mistake(SUM, "end Sum;", "end Total;", "compiler", "parse source-root files"),
    "unknown variable": Mistake(
        SUM, "offset + k*u", "offset + kk*u", "compiler", "unresolved component reference: 'kk'"
    ),
    "unknown type": Mistake(
        SUM, "parameter Real offset", "parameter Reel offset", "compiler", "unresolved type reference: 'Reel'"
    ),
    "unknown function": Mistake(
        PLAYS, "Functions.play(", "Functions.plays(", "compiler", "unresolved function call: 'Functions.plays'"
    ),
    "unknown base class": Mistake(
        SUM,
        "extends Icons.Block;",
        "extends Icons.Blok;",
        "compiler",
        "base class not found: `Icons.Blok` does not exist",
    ),
    "equation left out": Mistake(
        SUM, "  y = offset + k*u;\n", "", "compiler", "unbalanced model: 0 equations, 1 unknowns"
    ),
    "one equation too many": Mistake(
        SUM, "  y = offset", "  y = 1;\n  y = offset", "compiler", "unbalanced model: 2 equations, 1 unknowns"
    ),
    "argument left out": Mistake(
        PLAYS,
        "Functions.play(u, r, pre(z))",
        "Functions.play(u, r)",
        "compiler",
        "input `z` has no argument and no default",
    ),
    "one argument too many": Mistake(
        PLAYS,
        "Functions.play(u, r, pre(z))",
        "Functions.play(u, r, pre(z), 1)",
        "compiler",
        "4 positional argument(s) for 3 input slot(s)",
    ),
    "array of another size": Mistake(
        SUM, "k[n] = fill(1.0, n)", "k[n] = fill(1.0, n + 1)", "compiler", "expression shape mismatch"
    ),
    "sum of a vector and a scalar": Mistake(
        SUM, "offset + k*u", "offset + k", "compiler", "array dimension mismatch: expected `scalar`, found `[2]`"
    ),
    "two components of one name": Mistake(
        SUM,
        "  parameter Real offset",
        "  parameter Real k = 1;\n  parameter Real offset",
        "compiler",
        "parse source-root files",
    ),
    "parameter assigned": Mistake(
        SUM, "  y = offset", "  offset = 1;\n  y = offset", "compiler", "unbalanced model: 2 equations, 1 unknowns"
    ),
    "modifier of what does not exist": Mistake(
        RUN, "tested(n = 3,", "tested(m = 3,", "compiler", "unknown modifier `m` for component `tested`"
    ),
    "connection to what does not exist": Mistake(
        RUN,
        "connect(signal.r, tested.u)",
        "connect(signal.q, tested.u)",
        "compiler",
        "unresolved component reference: 'signal.q'",
    ),
    "input left open": Mistake(
        RUN, "  connect(signal.r, tested.u);\n", "", "compiler", "unbalanced model: 5 equations, 6 unknowns"
    ),
    "derivative of a discrete variable": Mistake(
        PLAYS, "  when sample", "  der(z[1]) = u;\n  when sample", "compiler", "`z` is not a discrete coordinate"
    ),
    "each left out": Mistake(
        BASE, "r[n](each min = 0)", "r[n](min = 0)", "lint", "missing_each: r[...](min = ...) needs 'each'"
    ),
    "number for an array": Mistake(
        BASE,
        "r[n](each min = 0) = fill(0.1, n)",
        "r[n](each min = 0) = 0.1",
        "lint",
        "missing_each: the array r has a scalar value",
    ),
    "discrete variable outside when": Mistake(
        EVENTS,
        "  when {initial(), change(rising)} then\n    z_turn = Functions.play(u, r, pre(z_turn));\n  end when;\n",
        "  z_turn = Functions.play(u, r, z_turn);\n",
        "lint",
        "outside_when: z_turn is discrete and assigned outside 'when'",
    ),
    "discrete variable never assigned": Mistake(
        EVENTS,
        "    z_turn = Functions.play(u, r, pre(z_turn));\n",
        '    assert(true, "x");\n',
        "lint",
        "outside_when: z_turn is discrete and never assigned",
    ),
    "input assigned": Mistake(
        PID, "    e = y_d - y;", "    y_d = 0;\n    e = y_d - y;", "lint", "assigned_input: the input y_d is assigned"
    ),
    "protected variable used": Mistake(
        RUN, "equation\n", "  Real a;\nequation\n  a = signal.pi;\n", "lint", "protected_access: signal.pi is protected"
    ),
    "member that does not exist": Mistake(
        RUN,
        "equation\n",
        "  Real a;\nequation\n  a = tested.nothing;\n",
        "lint",
        "protected_access: tested.nothing does not exist",
    ),
    "default below its min": Mistake(
        PID, 'Real tau(unit = "s", min = 0) = 0', 'Real tau(unit = "s", min = 0) = -1', "lint", "below_min: tau = -1"
    ),
    "default above its max": Mistake(
        "Operators/BaseClasses/BoucWen",
        "alpha(min = 0, max = 1) = 0.5",
        "alpha(min = 0, max = 1) = 1.5",
        "lint",
        "below_min: alpha = 1.5 is beyond its max 1",
    ),
    "unlike units joined": Mistake(
        "Examples/Pid",
        "connect(reference.dr_lead, feedforward.dr)",
        "connect(reference.dr_lead, feedforward.ddr)",
        "lint",
        "unlike_units: connect(reference.dr_lead, feedforward.ddr) joins 1/s and 1/s2",
    ),
    "Reals compared by ==": Mistake(
        SUM,
        "y = offset + k*u",
        "y = if offset == 1 then 0 else offset + k*u",
        "lint",
        "equal_reals: offset is a Real and compared with ==",
    ),
    "description left out": Mistake(
        SUM, 'block Sum "Weighted sum of signals"', "block Sum", "lint", "undocumented: has no description"
    ),
    "documentation left out": Mistake(
        SUM, "Documentation(info", "Text(info", "lint", "undocumented: has no documentation"
    ),
    "source left out": Mistake(
        SUM, "<p><b>Source", "<p><b>Origin", "lint", "undocumented: its documentation has no Source"
    ),
    "limits left out": Mistake(
        SUM, "<p><b>Limitation", "<p><b>Note", "lint", "undocumented: its documentation has no Limitation"
    ),
    "example left out": Mistake(
        SUM, "<p><b>Example", "<p><b>Note", "lint", "undocumented: its documentation has no Example"
    ),
    "link to what does not exist": Mistake(
        SUM, "modelica://HystFMU.", "modelica://HystFMU.No", "lint", "dead_link: its documentation links to HystFMU.No"
    ),
    "index beyond the end": Mistake(
        SUM, "offset + k*u", "offset + k[3]*u[1]", "compiler", "subscript 3 for `k` is out of bounds"
    ),
    "fraction for a number of elements": Mistake(
        SUM, '= 2 "Number', '= 2.5 "Number', "compiler", "dimension expression could not be evaluated"
    ),
    "Boolean in a sum": Mistake(
        SUM, "offset + k*u", "offset + k*u + true", "compiler", "expects Real or Integer operand(s), found `Boolean`"
    ),
    "word that does not exist": Mistake(
        MLP,
        'Types.Activation.sigmoid "Activation of the hidden',
        'Types.Activation.gauss "Activation of the hidden',
        "compiler",
        "unresolved component reference: 'Types.Activation.gauss'",
    ),
    "class that extends itself": Mistake(
        SUM, "extends Icons.Block;", "extends Dynamics.Sum;", "compiler", "circular inheritance"
    ),
    "wrong within": Mistake(
        SUM,
        "within HystFMU.Dynamics;",
        "within HystFMU.Networks;",
        "compiler",
        "has `within HystFMU.Networks;` but expected `within HystFMU.Dynamics;`",
    ),
    "derivative of an input": Mistake(
        FILTER,
        "  T*dr = u - r;",
        "  dr = der(u);",
        "compiler",
        "der(...) must name a coordinate classified as a continuous state",
    ),
    "pre of a continuous variable": Mistake(
        FILTER, "T*dr = u - r", "T*dr = u - pre(r)", "compiler", "names a continuous coordinate"
    ),
    "two sources for one input": Mistake(
        "Examples/Pid",
        "  connect(reference.r, controller.y_d);\n",
        "  connect(reference.r, controller.y_d);\n  connect(plant.y, controller.y_d);\n",
        "compiler",
        "unbalanced model",
    ),
    "modifier twice": Mistake(RUN, "tested(n = 3,", "tested(n = 3, n = 4,", "compiler", "parse source-root files"),
    "connected twice": Mistake(
        RUN,
        "  connect(signal.r, tested.u);\n",
        "  connect(signal.r, tested.u);\n  connect(tested.u, signal.r);\n",
        "lint",
        "connected_twice: signal.r and tested.u",
    ),
    "no start of a discrete state": Mistake(
        CREEP,
        "discrete Real q[n](each start = 0, each fixed = true)",
        "discrete Real q[n]",
        "lint",
        "without_start: pre(q) is read, and q has no start value that is fixed",
    ),
    "start that is not fixed": Mistake(
        CREEP, "(each start = 0, each fixed = true)", "(each start = 0)", "lint", "without_start: pre(q) is read"
    ),
    "pre left out": Mistake(
        PLAYS,
        "Functions.play(u, r, pre(z))",
        "Functions.play(u, r, z)",
        "lint",
        "own_value: z is computed from itself; its old value is pre(z)",
    ),
    "events at every sign of the rate": Mistake(
        "Operators/Smooth/PlayBank",
        "der(z[i]) = Functions.playRate(u, rate, r[i], z[i], width)",
        "der(z[i]) = if u - z[i] >= r[i] and rate > 0 then rate else 0",
        "lint",
        "event_storm: der(z) depends on a relation that is an event",
    ),
    "branches of an if-equation": Mistake(
        FILTER,
        "  der(r) = dr;",
        "  if u > r then\n    der(r) = dr;\n  else\n    der(r) = 0;\n  end if;",
        "lint",
        "event_storm: der(r) depends on a relation",
    ),
    "noEvent left out": Mistake(
        "Plants/BoucWenOscillator", "noEvent(", "(", "lint", "event_storm: der(z) depends on a relation"
    ),
    "word of another enumeration": Mistake(
        MLP,
        'Types.Activation.sigmoid "Activation of the hidden',
        'Types.Memory.last "Activation of the hidden',
        "lint",
        "other_choice: activation: value is Types.Memory.last, not of Types.Activation",
    ),
    "icon left out": Mistake(SUM, "  extends Icons.Block;\n", "", "lint", "without_icon: has no icon"),
    "name that differs from the block": Mistake(
        SUM, "offset", "bias", "table", "the parameter offset of the block is missing"
    ),
    "default that differs from the block": Mistake(
        PID, 'Ki(unit = "1/s") = 0', 'Ki(unit = "1/s") = 1', "table", "Ki = 1 by default, 0.0 in the block"
    ),
    "unit that differs from the block": Mistake(
        DIFF, 'du(unit = "1/s"', 'du(unit = "1/s2"', "table", "du: unit '1/s2', '1/s' in the block"
    ),
    "range that differs from the block": Mistake(
        SUM, "Integer n(min = 1)", "Integer n(min = 0)", "table", "n: another min than in the block"
    ),
    "port left out": Mistake(SUM, "Interfaces.RealOutput y", "Real y", "table", "outputs [], ['y'] in the block"),
}
