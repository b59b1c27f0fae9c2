"""Conditions that no call of the public functions can cover: (file, condition, words of the line) -> reason.

test_mcdc.py fails for an uncovered condition that is not listed here, and for a listed condition that is covered.
"""

GUARD = "bound of a loop that converges earlier; it prevents an endless loop for wrong numbers"
CONSTANT = "a constant in each of the two blocks"
NO_TIME = "no block has the time together with continuous states or samples, though the tables allow it"
UNREACHABLE: dict[tuple[str, str, str], str] = {
    ("core/blocks/operators/bouc_wen.c", "condition 1 of 2", "k < 64"): GUARD,
    ("core/blocks/operators/bouc_wen.c", "never false", "i < 20"): GUARD,
    ("core/blocks/inverses/zhao_tan_inverse.c", "never false", "i < 5"): GUARD,
    ("core/elementary/root.h", "never false", "i < MOST"): GUARD,
    ("core/elementary/root.h", "condition 1 of 2", "i < MOST && more"): GUARD,
    ("core/graph/continuous.c", "never true", "n->time >= 0 ? n->u[n->time] : 0"): NO_TIME,
    ("core/graph/continuous.c", "never true", "if (n->time >= 0)"): NO_TIME,
    ("core/block_file/graph_file.c", "never true", "switch (b->vars[v].kind)"): "the cases are all kinds",
    ("core/graph/layout.h", "condition 2 of 2", "own <= HYST_TIME"): "no table lists an input after the time",
    ("core/memory/piecewise.h", "condition 1 of 2", "if (invert && !(w0 > 0))"): CONSTANT,
    ("core/memory/piecewise.h", "condition 1 of 4", "if (invert && !(segment"): CONSTANT,
    ("core/graph/tangent.c", "never true", "ddx[k] = 0"): "every block with continuous states has a tangent",
    ("fmi/values.c", "never true", "type == BOOLEAN"): "no table has a bool, though the format and both standards do",
    ("fmi/values.c", "condition 2 of 2", "p->kind == HYST_INPUT"): "no table bounds an input",
}
