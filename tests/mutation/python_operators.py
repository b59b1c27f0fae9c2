"""Mutants of a Python file: every place where an operator of the list below applies, by the syntax tree.

Texts, checks, annotations and imports stay: a message is a matter of taste, and the rest is checked by mypy.
"""

import ast
from collections.abc import Iterator
from types import CodeType

from mutation.mutant import Mutant

COMPARE = {
    ast.Lt: ["<=", ">="], ast.LtE: ["<", ">"], ast.Gt: [">=", "<="], ast.GtE: [">", "<"], ast.Eq: ["!="],
    ast.NotEq: ["=="], ast.Is: ["is not"], ast.IsNot: ["is"], ast.In: ["not in"], ast.NotIn: ["in"],
}  # fmt: skip
BINARY = {
    ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.FloorDiv: "*", ast.Mod: "*", ast.Pow: "*",
    ast.BitAnd: "|", ast.BitOr: "&",
}  # fmt: skip
NAMES = {"min": "max", "max": "min", "any": "all", "all": "any"}


class Places(ast.NodeVisitor):
    """Collects the mutants of one file."""

    def __init__(self, file: str, text: str) -> None:
        self.file, self.text, self.found = file, text, []  # type: ignore[var-annotated]
        self.lines = [0]
        for line in text.encode().splitlines(keepends=True):
            self.lines.append(self.lines[-1] + len(line))
        self.bytes = text.encode()

    def at(self, line: int, column: int) -> int:
        """Return the place in characters of a place in bytes."""
        return len(self.bytes[: self.lines[line - 1] + column].decode())

    def span(self, node: ast.expr | ast.stmt) -> tuple[int, int]:
        return self.at(node.lineno, node.col_offset), self.at(node.end_lineno or 0, node.end_col_offset or 0)

    def add(self, start: int, end: int, new: str, kind: str) -> None:
        self.found.append(Mutant(self.file, start, end, new, kind))

    def between(self, a: ast.expr, b: ast.expr, words: str) -> tuple[int, int] | None:
        """Return the place of an operator between two operands, past brackets and line ends."""
        start, end = self.span(a)[1], self.span(b)[0]
        at = self.text.find(words, start, end)
        return (at, at + len(words)) if at >= 0 else None

    def swap(self, a: ast.expr, b: ast.expr, old: str, new: str, kind: str) -> None:
        if place := self.between(a, b, old):
            self.add(*place, new, kind)

    def negate(self, test: ast.expr) -> None:
        if not isinstance(test, (ast.Compare, ast.Constant, ast.UnaryOp)):  # those have operators of their own
            start, end = self.span(test)
            self.add(start, end, f"(not ({self.text[start:end]}))", "condition")

    def visit_Compare(self, node: ast.Compare) -> None:
        operands = [node.left, *node.comparators]
        for a, operator, b in zip(operands, node.ops, node.comparators, strict=False):
            old = {ast.IsNot: "is not", ast.NotIn: "not in"}.get(type(operator)) or _sign(operator)
            for new in COMPARE[type(operator)]:
                self.swap(a, b, old, new, "comparison")
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if type(node.op) in BINARY and not any(
            isinstance(n, (ast.JoinedStr, ast.Constant)) and not isinstance(getattr(n, "value", 0), (int, float))
            for n in (node.left, node.right)
        ):
            self.swap(node.left, node.right, _sign(node.op), BINARY[type(node.op)], "arithmetic")
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        for a, b in zip(node.values, node.values[1:], strict=False):
            self.swap(a, b, old, new, "logic")
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, (ast.Not, ast.USub)):
            start, inner = self.span(node)[0], self.span(node.operand)[0]
            self.add(start, inner, self.text[start:inner].replace("not", "", 1).replace("-", "", 1).lstrip(), "sign")
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        start, end = self.span(node)
        if isinstance(node.value, bool):
            self.add(start, end, str(not node.value), "constant")
        elif isinstance(node.value, (int, float)):
            self.add(start, end, repr(node.value + 1), "constant")

    def visit_If(self, node: ast.If) -> None:
        self.negate(node.test)
        self.generic_visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> None:
        self.negate(node.test)
        self.generic_visit(node)

    def visit_comprehension(self, node: ast.comprehension) -> None:
        for test in node.ifs:
            self.negate(test)
        self.generic_visit(node)

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Constant):
            return  # a docstring
        if isinstance(node.value, ast.Call):
            self.add(*self.span(node), "pass", "call removed")
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        sign = _sign(node.op)
        start, end = self.span(node.target)[1], self.span(node.value)[0]
        at = self.text.find(sign + "=", start, end)
        self.add(at, at + len(sign) + 1, "=", "assignment")
        self.generic_visit(node)

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is not None and not (isinstance(node.value, ast.Constant) and node.value.value is None):
            self.add(*self.span(node.value), "None", "return")
        self.generic_visit(node)

    def visit_Continue(self, node: ast.Continue) -> None:
        self.add(*self.span(node), "break", "loop")

    def visit_Break(self, node: ast.Break) -> None:
        self.add(*self.span(node), "continue", "loop")

    def visit_Call(self, node: ast.Call) -> None:
        if isinstance(node.func, ast.Name) and node.func.id in NAMES:
            self.add(*self.span(node.func), NAMES[node.func.id], "name")
        node.keywords = [k for k in node.keywords if k.arg != "strict"]  # of zip: a check, like `assert`
        self.generic_visit(node)

    def visit_Assert(self, node: ast.Assert) -> None:
        """Leave checks: they fail or have no effect."""

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_arg(self, node: ast.arg) -> None:
        """Leave annotations."""

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        for part in [*node.args.defaults, *filter(None, node.args.kw_defaults), *node.decorator_list, *node.body]:
            self.visit(part)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Leave texts."""

    def visit_Raise(self, node: ast.Raise) -> None:
        """Leave messages; whether the statement is reached is decided by its condition."""


SIGNS = {
    "Add": "+", "Sub": "-", "Mult": "*", "Div": "/", "FloorDiv": "//", "Mod": "%", "Pow": "**", "MatMult": "@",
    "BitAnd": "&", "BitOr": "|", "BitXor": "^", "LShift": "<<", "RShift": ">>", "Lt": "<", "LtE": "<=", "Gt": ">",
    "GtE": ">=", "Eq": "==", "NotEq": "!=", "Is": "is", "In": "in",
}  # fmt: skip


def _sign(operator: ast.AST) -> str:
    return SIGNS[type(operator).__name__]


def mutants(file: str, text: str) -> list[Mutant]:
    """Return all mutants of a file, in the order of their places."""
    places = Places(file, text)
    places.visit(ast.parse(text))
    return sorted(places.found, key=lambda m: (m.start, m.end, m.new))


def same(a: str, b: str) -> bool:
    """Whether two texts compile to the same code, apart from places in the text."""
    return _meaning(compile(a, "file", "exec")) == _meaning(compile(b, "file", "exec"))


def _meaning(code: CodeType) -> tuple[object, ...]:
    constants = [_meaning(k) if isinstance(k, CodeType) else repr(k) for k in code.co_consts]
    return code.co_code, constants, code.co_names, code.co_varnames, code.co_freevars, code.co_flags, code.co_name


def valid(text: str) -> bool:
    """Whether a text compiles."""
    try:
        compile(text, "file", "exec")
    except (SyntaxError, ValueError):
        return False
    return True


def functions(text: str) -> Iterator[tuple[int, int]]:
    """Yield the first and last line of every function body."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            yield node.body[0].lineno, node.end_lineno or 0
