"""Printable text for terminals, XML files and HTML pages. Visible escapes replace unprintable characters.

Control characters, including U+0080 to U+009F, can control a terminal. Bidirectional overrides can display a name as a
different name. XML 1.0 permits only few control characters, and UTF-8 permits no surrogates.
"""

import html
import re
import unicodedata
from functools import cache

_JOINERS = "\u200c\u200d"  # printable: some scripts and emoji need them, and they do not change the order of text
_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def printable(text: str, lines: bool = False) -> str:
    r"""Return text in which an escape such as ``\x1b`` or ``\u202e`` replaces each unprintable character.

    Parameters
    ----------
    text : str
    lines : bool
        Whether line ends stay unchanged, for texts of several lines.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if _is_printable(c) or (lines and c == "\n") else _escaped(c) for c in text)


def unprintable(text: str) -> bool:
    """Return whether a text contains a character, except line ends and tabs, that `printable` replaces."""
    return not text.isprintable() and any(not _is_printable(c) and c not in "\n\t" for c in text)


def escape(text: str, quote: bool = True) -> str:
    """Return printable text for HTML, in which markup characters are escaped; line ends stay unchanged."""
    return html.escape(printable(text, lines=True), quote)


def xml_text(text: str) -> str:
    """Return text in which escapes replace the characters that XML 1.0 does not permit."""
    return _NO_XML.sub(lambda m: _escaped(m[0]), text)


@cache
def _is_printable(c: str) -> bool:
    return c.isprintable() or c in _JOINERS or unicodedata.category(c) == "Zs"


def _escaped(c: str) -> str:
    return c.encode("unicode_escape").decode()


def with_unit(name: str, unit: str) -> str:
    """Return a name with its unit of measure in parentheses; the unit "1" is not shown."""
    return f"{name} ({unit})" if unit not in ("", "1") else name
