"""Printable text for terminals, XML files and pages: other characters become visible escapes.

Control characters, also U+0080 to U+009F, control a terminal. Bidirectional overrides display a name as a different
name. XML 1.0 allows few control characters, and UTF-8 allows no surrogates.
"""

from __future__ import annotations

import html
import re
import unicodedata
from functools import cache

_JOINERS = "\u200c\u200d"  # scripts and pictures need them; they move nothing
_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def printable(text: str, lines: bool = False) -> str:
    r"""Return text in which an escape such as ``\x1b`` or ``\u202e`` replaces each unprintable character.

    Parameters
    ----------
    text : str
    lines : bool
        Whether line ends are kept, for texts of several lines.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if _is_printable(c) or (lines and c == "\n") else _escaped(c) for c in text)


def unprintable(text: str) -> bool:
    """Return whether a text has a character that `printable` would replace, except line ends and tabs."""
    return not text.isprintable() and any(not _is_printable(c) and c not in "\n\t" for c in text)


def escape(text: str, quote: bool = True) -> str:
    """Return text as a part of HTML, printable and without markup; line ends are kept."""
    return html.escape(printable(text, lines=True), quote)


def xml_text(text: str) -> str:
    """Return text that is valid in XML 1.0; valid names do not change, so that other tools find them."""
    return _NO_XML.sub(lambda m: _escaped(m[0]), text)


@cache
def _is_printable(c: str) -> bool:
    return c.isprintable() or c in _JOINERS or unicodedata.category(c) == "Zs"


def _escaped(c: str) -> str:
    return c.encode("unicode_escape").decode()
