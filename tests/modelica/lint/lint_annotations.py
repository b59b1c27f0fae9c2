"""Rules of the lint on what stands in strings and annotations: units, HTML, experiments, versions."""

import re
from collections.abc import Iterator
from html.parser import HTMLParser

import library
import measures
from source import elements, own_annotation
from syntax_tree import text_of

from hystfmu import __version__

_SYMBOL = r"(?:1|[A-Za-z]+|'[^']+')"
_FACTOR = rf"{_SYMBOL}(?:[+-]?\d+)?"
_FACTORS = rf"{_FACTOR}(?:\.{_FACTOR})*"
_EXPRESSION = re.compile(rf"(?:{_FACTORS}|\({_FACTORS}\))(?:/(?:{_FACTOR}|\({_FACTORS}\)))?")
_PREFIXES = ("da", *"YZEPTGMkhdcmunpfazy")
_UNITS = {
    "m", "g", "s", "A", "K", "mol", "cd", "rad", "sr", "Hz", "N", "Pa", "W", "J", "C", "V", "F", "Ohm", "S", "Wb", "T",
    "H", "lm", "lx", "Bq", "Gy", "Sv", "kat", "min", "h", "d", "l", "L", "eV", "u", "t", "deg", "degC", "bar", "rev",
}  # fmt: skip
QUANTITIES = {
    "Time": "s", "Frequency": "Hz", "Angle": "rad", "ElectricPotential": "V", "ElectricCurrent": "A",
    "Resistance": "Ohm", "Capacitance": "F", "Length": "m", "Velocity": "m/s", "Force": "N", "Mass": "kg",
    "TranslationalSpringConstant": "N/m", "TranslationalDampingConstant": "N.s/m", "ElectricCharge": "C", "Power": "W",
    "Energy": "J", "Pressure": "Pa", "ThermodynamicTemperature": "K",
}  # fmt: skip  # as Modelica.Units.SI has them
_VOID = {"br", "hr", "img"}


def unit_syntax(c: library.Class) -> Iterator[str]:
    """A unit of measure has the form of the specification, and symbols of the SI."""
    for unit in re.findall(r'\b(?:unit|displayUnit)\s*=\s*"([^"]*)"', _code(c)):
        unknown = [s for s in re.findall(r"[A-Za-z]+", unit) if not _is_unit(s)]
        if unit and (unknown or not _EXPRESSION.fullmatch(unit)):
            yield f'the unit "{unit}" has not the form of a unit{", and no symbol " + unknown[0] if unknown else ""}'


def quantity_unit(c: library.Class) -> Iterator[str]:
    """A quantity has the unit that Modelica.Units.SI gives it."""
    for quantity, unit in re.findall(r'\bquantity\s*=\s*"(\w+)"[^;]*?\bunit\s*=\s*"([^"]*)"', _code(c)):
        if quantity not in QUANTITIES:
            yield f'the quantity "{quantity}" is not in the table of lint_annotations.py'
        elif measures.parsed(unit) != measures.parsed(QUANTITIES[quantity]):
            yield f'the quantity "{quantity}" has the unit "{unit}", not "{QUANTITIES[quantity]}"'


def evaluate(c: library.Class) -> Iterator[str]:
    """Evaluate is true or false, and of a parameter or constant."""
    for e in elements(c):
        for value in re.findall(r"\bEvaluate\s*=\s*([^,)]*)", e.annotation):
            if value.strip() not in ("true", "false"):
                yield f"Evaluate is {value.strip()}, not true or false"
            if not re.search(r"\b(?:parameter|constant|type|replaceable)\b", e.text):
                yield "Evaluate stands at what is neither a parameter nor a constant"


def experiment_values(c: library.Class) -> Iterator[str]:
    """An experiment ends after it starts, in steps shorter than it, with a tolerance between 0 and 1."""
    m = re.search(r"\bexperiment\(([^)]*)\)", own_annotation(c))
    given = dict(re.findall(r"(\w+)\s*=\s*([-+.\deE]+)", m[1])) if m else {}
    value = {"StartTime": 0.0} | {k: float(v) for k, v in given.items()}
    length = value.get("StopTime", value["StartTime"] + 1) - value["StartTime"]
    if length <= 0:
        yield "its experiment ends before it starts"
    elif not 0 < value.get("Interval", length) <= length:
        yield f"its experiment has the interval {value['Interval']:g}"
    if not 0 < value.get("Tolerance", 1e-6) < 1:
        yield f"its experiment has the tolerance {value['Tolerance']:g}"


def unbalanced_html(c: library.Class) -> Iterator[str]:
    """The documentation is HTML from <html> to </html>, and every tag in it is closed."""
    for text in re.findall(r'\b(?:info|revisions)\s*=\s*"((?:[^"\\]|\\.)*)"', own_annotation(c)):
        plain = text.replace('\\"', '"').strip()
        if not (plain.startswith("<html>") and plain.endswith("</html>")):
            yield "its documentation is not HTML from <html> to </html>"
        page = _Page()
        page.feed(plain)
        page.close()
        for fault in [*page.faults, *(f"<{tag}> is not closed" for tag in page.open)]:
            yield f"its documentation: {fault}"


def repeated_annotation(c: library.Class) -> Iterator[str]:
    """A declaration and a class have one annotation, and each key in it once."""
    own = [e for e in elements(c) if not e.text.strip() and e.annotation]
    if len(own) > 1:
        yield "has two annotations"
    for e in elements(c):
        keys = _keys(e.annotation)
        for key in sorted({k for k in keys if keys.count(k) > 1}):
            yield f"{key} stands twice in one annotation"


def conversion_order(c: library.Class) -> Iterator[str]:
    """A library converts from versions before its own."""
    note = own_annotation(c)
    version = re.search(r'\bversion\s*=\s*"([\d.]+)"', note)
    for old in re.findall(r'\bnoneFromVersion\s*=\s*"([\d.]+)"|\bfrom\(\s*version\s*=\s*"([\d.]+)"', note):
        number = next(filter(None, old))
        if version and _number(number) >= _number(version[1]):
            yield f"converts from {number}, and is {version[1]}"


def unlisted_use(c: library.Class) -> Iterator[str]:
    """A class of another library is used only where `uses` names that library, in the version that is here."""
    root = library.classes().get(c.name.split(".")[0])
    names = [str(e.component) for e in c.tree.extends] + [str(s.type) for s in c.tree.symbols.values()]
    others = {n.split(".")[0] for n in names if "." in n} & {"Modelica", "HystFMU", "ModelicaReference"}
    note = own_annotation(root) if root is not None else ""
    for other in sorted(others - {c.name.split(".")[0]}):
        m = re.search(rf'\buses\([^;]*?\b{other}\(version\s*=\s*"([\d.]+)"', note)
        if m is None:
            yield f"uses {other}, and its library does not say so"
        elif other == "HystFMU" and m[1] != __version__:
            yield f"uses HystFMU {m[1]}, and {__version__} is here"


class _Page(HTMLParser):
    """Tags that are open, and faults."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.faults: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in _VOID:
            self.open.append(tag)
        if tag == "img" and not dict(attrs).get("alt"):
            self.faults.append("<img> has no alt")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in _VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        if tag not in self.open:
            self.faults.append(f"</{tag}> closes nothing")
        elif self.open.pop() != tag:
            self.faults.append(f"</{tag}> closes another tag")
            self.open.clear()


def _code(c: library.Class) -> str:
    """The source of a class without the annotation that has its documentation."""
    return text_of(c).partition("Documentation(")[0]


def _is_unit(symbol: str) -> bool:
    return symbol in _UNITS or any(symbol.startswith(p) and symbol[len(p) :] in _UNITS for p in _PREFIXES)


def _keys(annotation: str) -> list[str]:
    """The names at the first level of an annotation."""
    plain = re.sub(r'"(?:[^"\\]|\\.)*"', '""', annotation).partition("(")[2]
    depth, level = 0, ""
    for letter in plain:
        depth += (letter in "({[") - (letter in ")}]")
        level += letter if depth == 0 else ""
    return re.findall(r"(\w+)", re.sub(r"=[^,]*", "", level))


def _number(version: str) -> list[int]:
    return [int(x) for x in version.split(".")]


# ---- Rules of the lint on a package as a whole: versions, guide, whom to ask, under which licence
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


def _is_library(c: library.Class) -> bool:
    """The package of a file package.mo that stands in no other."""
    return c.tree.type == "package" and "." not in c.name and c.file.name == "package.mo"


RULES = (
    unit_syntax, quantity_unit, evaluate, experiment_values, unbalanced_html, repeated_annotation, conversion_order,
    unlisted_use, without_version, without_view, without_contact,
)  # fmt: skip
