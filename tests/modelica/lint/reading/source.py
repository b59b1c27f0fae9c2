"""The source of a class as a list of its elements: the second parser leaves the annotations of components out."""

import functools
import re
from collections.abc import Iterator
from dataclasses import dataclass

import library
from syntax_tree import text_of

_STRING = re.compile(r'"(?:[^"\\]|\\.)*"')
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.S)
_SECTION = re.compile(r"\s*(initial equation|initial algorithm|equation|algorithm|protected|public)\b")
_PREFIX = r"final|inner|outer|replaceable|redeclare|flow|stream|discrete|parameter|constant|input|output|each"
_COMPONENT = re.compile(rf"\s*((?:(?:{_PREFIX})\s+)*)([\w.]+)\s*(?:\[[^\]]*\])?\s+(\w+)\s*(?=[\[(=;\s]|$)")
_NO_COMPONENT = re.compile(r"\s*(?:extends|import|annotation|end|within|partial|type|connector|function|package)\b")


@dataclass(frozen=True)
class Element:
    """One declaration, equation or statement.

    Attributes
    ----------
    text : str
        Its source; strings are empty, comments left out.
    annotation : str
        Its annotation, strings kept.
    section : str
        "public", "protected", "equation", "initial equation", "algorithm" or "initial algorithm".
    """

    text: str
    annotation: str
    section: str


def elements(c: library.Class) -> tuple[Element, ...]:
    """The elements of a class in their order; the annotation of the class itself is the last."""
    return _elements_of(text_of(c))


@functools.cache  # most rules of the lint ask for them
def _elements_of(text: str) -> tuple[Element, ...]:
    return tuple(_elements(_body(text)))


def own_annotation(c: library.Class) -> str:
    """The annotation of the class itself, strings kept; "" if it has none."""
    found = [e.annotation for e in elements(c) if not e.text.strip() and e.annotation]
    return found[-1] if found else ""


def declared(c: library.Class) -> dict[str, Element]:
    """The elements that declare the components of a class, by name."""
    found = {}
    for e in elements(c):
        m = _COMPONENT.match(e.text)
        if e.section in ("public", "protected") and m and not _NO_COMPONENT.match(e.text) and m[3] in c.tree.symbols:
            found[m[3]] = e
    return found


def has(text: str, name: str) -> bool:
    """Is there an annotation `name` with arguments or a value?"""
    return re.search(rf"\b{name}\s*[(=]", _STRING.sub('""', text)) is not None


def extents(text: str, name: str) -> list[tuple[float, float, float, float]]:
    """Corners (x1, y1, x2, y2) of the extents in each `name`(...) of an annotation, x1 <= x2 and y1 <= y2."""
    number = r"\s*(-?[\d.]+)\s*"
    corners = rf"{{\s*{{{number},{number}}}\s*,\s*{{{number},{number}}}\s*}}"
    found = []
    for m in re.finditer(rf"\b{name}\([^{{]*?extent\s*=\s*{corners}", _STRING.sub('""', text)):
        a, b, c, d = map(float, m.groups())
        found.append((min(a, c), min(b, d), max(a, c), max(b, d)))
    return found


def overlap(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    """Do two extents share more than an edge?"""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _body(text: str) -> str:
    """The text between the head of a class and its end."""
    head = re.match(r'\w+ (?:extends )?\w+(?:\s*"(?:[^"\\]|\\.)*")?', text)
    return re.sub(r"\bend \w+;\s*\Z", "", text[head.end() if head else 0 :])


def _elements(body: str) -> Iterator[Element]:
    section = "public"
    for part in _parts(body):
        text = part
        while m := _SECTION.match(text):
            section, text = m[1], text[m.end() :]
        plain = _STRING.sub('""', text)
        at = re.search(r"\bannotation\s*\(", plain)
        if at is None:
            yield Element(plain, "", section)
            continue
        # strings are shortened in `plain`: look for the same place in the text by the number of annotations before it
        place = _places(text)[0]
        yield Element(plain[: at.start()], text[place:], section)


def _places(text: str) -> list[int]:
    """Where `annotation(` begins, outside strings."""
    inside = [m.span() for m in _STRING.finditer(text)]
    found = [m.start() for m in re.finditer(r"\bannotation\s*\(", text)]
    return [k for k in found if not any(a <= k < b for a, b in inside)]


def _parts(body: str) -> Iterator[str]:
    """Pieces between semicolons outside strings, brackets and comments; comments are left out."""
    token = re.compile(rf"({_STRING.pattern})|({_COMMENT.pattern})|(;)|([(\[{{])|([)\]}}])", re.S)
    piece, last, depth = "", 0, 0
    for m in token.finditer(body):
        piece += body[last : m.start()] + (m[1] or m[4] or m[5] or "")
        last = m.end()
        depth += bool(m[4]) - bool(m[5])
        if m[3] and depth:  # between the rows of a matrix
            piece += ";"
        elif m[3]:
            yield piece
            piece = ""
    if piece.strip() or body[last:].strip():
        yield piece + body[last:]
