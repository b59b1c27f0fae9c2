"""Rules of the lint on a package as a whole: versions, guide, whom to ask, under which licence."""

from __future__ import annotations

import re
from collections.abc import Iterator

import library
from source import own_annotation

FIRST = ("0.1.0", "1.0.0")  # of the library, of an export: there is nothing before them
_VERSION = {
    "version": r"\bversion\s*=\s*\"\d+\.\d+\.\d+\"",
    "versionDate": r"\bversionDate\s*=\s*\"\d{4}-\d\d-\d\d\"",
    "uses": r"\buses\(",
}


def without_version(c: library.Class) -> Iterator[str]:
    """A library says its version and day, what it uses, and, after its first version, from which it converts."""
    if _is_library(c):
        for name, form in _VERSION.items():
            if not re.search(form, own_annotation(c)):
                yield f"has no {name}"
        version = re.search(r"\bversion\s*=\s*\"([^\"]*)", own_annotation(c))
        converts = re.search(r"\bconversion\(\s*(?:noneFromVersion|from)\b", own_annotation(c))
        if version and version[1] not in FIRST and not converts:
            yield "has no conversion"


def without_view(c: library.Class) -> Iterator[str]:
    """A page of the guide, and a library, open as text; the guide is a class of documentation."""
    page = any("Information" in str(e.component) for e in c.tree.extends)
    if page or _is_library(c):
        if not re.search(r"\bpreferredView\s*=\s*\"info\"", own_annotation(c)):
            yield 'has no preferredView = "info"'
        if page and not re.search(r"\bDocumentationClass\s*=\s*true", own_annotation(c)):
            yield "has no DocumentationClass = true"


def without_contact(c: library.Class) -> Iterator[str]:
    """The guide of a library names whom to ask, and the licence."""
    if c.short_name == "UsersGuide":
        for page in ("Contact", "License"):
            if f"{c.name}.{page}" not in library.classes():
                yield f"has no page {page}"


RULES = (without_version, without_view, without_contact)


def _is_library(c: library.Class) -> bool:
    """The package of a file package.mo that stands in no other."""
    return c.tree.type == "package" and "." not in c.name and c.file.name == "package.mo"
