"""Mutants of a C file: every place where an operator of the list below applies, token by token.

Texts, comments, directives and `static_assert` stay.  A token has no type: `double *x` also gives `double /x`, which
no compiler takes; such mutants are invalid and do not count.  The sizes of local texts and of allocations stay: a
program does not observe that they are larger.
"""

import re
from collections.abc import Iterator
from typing import NamedTuple

from mutation.mutant import Mutant

TOKEN = re.compile(
    r"""(?P<skip>\s+|/\*.*?\*/|//[^\n]*|\\\n)
    |(?P<directive>^[ \t]*\#[ \t]*(?:include|if|ifdef|ifndef|elif|else|endif|error|pragma|undef)[^\n]*)
    |(?P<text>"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*')
    |(?P<number>0[xX][0-9a-fA-F.]+(?:[pP][+-]?\d+)?\w*|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?[uUlLfF]*)
    |(?P<word>[A-Za-z_]\w*)
    |(?P<sign><<=|>>=|\.\.\.|->|\+\+|--|&&|\|\||[<>=!+\-*/%&|^]=|<<|>>|\#\#|.)""",
    re.VERBOSE | re.DOTALL | re.MULTILINE,
)
BINARY = {
    "<": ["<=", ">="], "<=": ["<", ">"], ">": [">=", "<="], ">=": [">", "<"], "==": ["!="], "!=": ["=="], "&&": ["||"],
    "||": ["&&"], "+": ["-"], "-": ["+"], "*": ["/"], "/": ["*"], "%": ["*"], "+=": ["="], "-=": ["="], "*=": ["="],
    "/=": ["="], "|=": ["="], "&=": ["="],
}  # fmt: skip
KINDS = {"<": "comparison", ">": "comparison", "=": "comparison", "!": "comparison", "&": "logic", "|": "logic"}
NOT_OPERANDS = {"return", "case", "else", "in"}
LEAVE = {"static_assert", "_Static_assert", "typedef", "sizeof"}


class Token(NamedTuple):
    """A piece of the text that means something."""

    kind: str
    text: str
    start: int
    end: int


def tokens(text: str) -> Iterator[Token]:
    """Yield the tokens without space, comments and directives."""
    for m in TOKEN.finditer(text):
        if m.lastgroup not in ("skip", "directive"):
            yield Token(str(m.lastgroup), m[0], m.start(), m.end())


def mutants(file: str, text: str) -> list[Mutant]:
    """Return all mutants of a file, in the order of their places."""
    found: list[Mutant] = []
    all_ = list(tokens(text))
    sizes = _sizes(all_)

    def add(start: int, end: int, new: str, kind: str) -> None:
        found.append(Mutant(file, start, end, new, kind))

    for i, t in enumerate(all_):
        before = all_[i - 1] if i else Token("sign", ";", 0, 0)
        after = all_[i + 1] if i + 1 < len(all_) else before
        operand = before.text in (")", "]") or (before.kind in ("word", "number") and before.text not in NOT_OPERANDS)
        if t.text in BINARY and operand:
            assigns = t.text.endswith("=") and t.text[0] in "+-*/|&"
            kind = "assignment" if assigns else KINDS.get(t.text[0], "arithmetic")
            for new in BINARY[t.text]:
                add(t.start, t.end, new, kind)
        elif t.text in ("!", "-") and not operand:
            add(t.start, t.end, "", "sign")
        elif t.text in ("++", "--"):
            add(t.start, t.end, "--" if t.text == "++" else "++", "arithmetic")
        elif t.kind == "number" and i not in sizes and before.text not in LEAVE and not t.text.lower().startswith("0x"):
            add(t.start, t.end, _next(t.text), "constant")
        elif t.text in ("break", "continue") and after.text == ";":
            add(t.start, t.end, "continue" if t.text == "break" else "break", "loop")
        elif t.text in ("if", "while") and after.text == "(":
            if end := _close(all_, i + 1):
                add(after.start, end, f"(!{text[after.start : end]})", "condition")
        elif t.text == "return" and after.text not in (";", "0"):
            if end := _end(all_, i):
                add(after.start, end, "0", "return")
        elif before.text in (";", "{", "}") and _statement(all_, i):
            add(t.start, _end(all_, i), "", "statement removed")
    return found


def _next(number: str) -> str:
    digits = number.rstrip("uUlLfF")
    new = repr(float(digits) + 1) if re.search(r"[.eE]", digits) else str(int(digits) + 1)
    return new + number[len(digits) :]


def _sizes(all_: list[Token]) -> set[int]:
    """Return the places of numbers that state the size of a local text without a value, or of an allocation."""
    found: set[int] = set()
    code = [False]  # whether a pair of braces holds statements, from the outermost to the present one
    for i, t in enumerate(all_):
        before = all_[i - 1].text if i else ";"
        if t.text == "{":
            code.append(before in (")", "else", "do", ":") or (code[-1] and before in ";{}"))
        elif t.text == "}":
            code = code[:-1] or [False]
        elif t.text == "char" and code[-1] and before in ";{}":
            end = _end(all_, i)
            row = [k for k in range(i, len(all_)) if all_[k].start < end]
            if all(all_[k].text != "=" for k in row):
                found |= {k for k in row if (all_[k - 1].text, all_[k + 1].text) == ("[", "]")}
        elif t.text in ("malloc", "calloc"):
            end = _close(all_, i + 1)
            found |= {k for k in range(i, len(all_)) if all_[k].end <= end and all_[k - 1].text in "(,+*?:"}
    return found


def _close(all_: list[Token], opening: int) -> int:
    """Return the place after the closing bracket; 0 if it stays open, as in a macro."""
    depth = 0
    for t in all_[opening:]:
        depth += {"(": 1, ")": -1}.get(t.text, 0)
        if depth == 0:
            return t.end
    return 0


def _end(all_: list[Token], first: int) -> int:
    """Return the place of the next `;`; 0 if there is none, as in a macro."""
    return next((t.start for t in all_[first:] if t.text == ";"), 0)


def _statement(all_: list[Token], first: int) -> bool:
    """Whether a call or an assignment begins here: a name, then no other name (a declaration), then `;`."""
    for k in range(first, len(all_)):
        if all_[k].text in ("{", "}"):
            return False
        if all_[k].text == ";":
            words = all_[first:k]
            starts = words[:1] and (words[0].kind == "word" or words[0].text in ("*", "("))
            declares = len(words) > 1 and words[0].kind == "word" and words[1].kind == "word"
            pointer = len(words) > 2 and words[0].kind == "word" and words[1].text == "*" and words[2].kind == "word"
            leaves = words and words[0].text in {"return", "break", "continue", "goto", "case", "do", *LEAVE}
            acts = any(w.text in ("=", "(", "+=", "-=", "*=", "/=", "|=", "&=", "++", "--") for w in words)
            control = words and words[0].text in ("if", "for", "while", "switch", "else")
            return bool(starts and acts and not (declares or pointer or leaves or control))
    return False
