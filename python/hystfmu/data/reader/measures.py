"""Units of measure in headings: ``Zeit [ms]``, ``u (V)``, ``t / ms``, ``Weg in µm``, ``time_ms``; time in s."""

from __future__ import annotations

import re

TIME = {  # unit of time: counts of it in a second, or seconds in a count
    "s": (1.0, 1.0),
    "ms": (1e3, 1.0),
    "us": (1e6, 1.0),
    "ns": (1e9, 1.0),
    "min": (1.0, 60.0),
    "h": (1.0, 3600.0),
}
DRIVES = ("V", "mV", "kV", "A", "mA", "A/m", "kA/m", "Oe", "V/m", "kV/mm", "kV/cm")
LENGTHS = ("m", "mm", "um", "nm", "pm", "cm")
OTHERS = (
    "N",
    "mN",
    "kN",
    "Pa",
    "MPa",
    "T",
    "mT",
    "rad",
    "mrad",
    "urad",
    "deg",
    "K",
    "degC",
    "%",
    "Hz",
    "kHz",
    "C",
    "1",
)
KNOWN = frozenset((*TIME, *DRIVES, *LENGTHS, *OTHERS))
_WORDS = {  # other spellings, in small letters
    **dict.fromkeys(("sec", "secs", "second", "seconds", "sek", "sekunde", "sekunden", "seconde", "secondes"), "s"),
    **dict.fromkeys(("msec", "millisecond", "milliseconds", "millisekunden"), "ms"),
    **dict.fromkeys(("usec", "microsecond", "microseconds", "mikrosekunden"), "us"),
    **dict.fromkeys(("minute", "minutes", "minuten"), "min"),
    **dict.fromkeys(("hour", "hours", "stunden"), "h"),
    **dict.fromkeys(("volt", "volts"), "V"),
    **dict.fromkeys(("millivolt", "millivolts"), "mV"),
    **dict.fromkeys(("ampere", "amperes", "amps", "amp"), "A"),
    **dict.fromkeys(
        ("micron", "microns", "micrometer", "micrometers", "micrometre", "micrometres", "mikrometer"), "um"
    ),
    **dict.fromkeys(("nanometer", "nanometers", "nanometre", "nanometres"), "nm"),
    **dict.fromkeys(("millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    **dict.fromkeys(("meter", "meters", "metre", "metres"), "m"),
    "newton": "N",
    "hertz": "Hz",
}
_BRACKETS = re.compile(r"(.*?)[\s,_]*(?:\[([^\[\]]*)\]|\(([^()]*)\))")
_BEHIND = re.compile(r"(.*?\S)(\s*/\s*|\s+in\s+|\s*,\s*|_|\s+)([^\s/,_]+)")
_TIMES = ("t", "time", "zeit")  # names before a unit of measure of one letter, t_s


def spelling(unit: str) -> str:
    """Return the notation of this package for a unit of measure, ``um`` for ``µm``; other units unchanged."""
    unit = unit.strip().replace("\u00b5", "u").replace("\u03bc", "u").replace("°C", "degC").replace("²", "2")
    if unit in KNOWN:
        return unit
    return _WORDS.get(unit.lower().rstrip("."), unit)


def is_unit(text: str) -> bool:
    """Return whether a cell of a heading is a unit of measure, with or without brackets."""
    bare = text.strip()
    if bare[:1] + bare[-1:] in ("[]", "()"):
        bare = bare[1:-1]
    return spelling(bare) in KNOWN


def split_name(label: str) -> tuple[str, str]:
    """Split a heading into the name and the unit of measure after it.

    Any text in square brackets is a unit of measure. After a round bracket, a slash, ``in`` or a comma only known units
    count. After an underscore or a blank a unit counts unless it may be an index, as in ``u_min``, ``y_m`` or ``Channel
    A``.
    """
    if m := _BRACKETS.fullmatch(label):
        unit = m[2] if m[2] is not None else m[3]
        if m[2] is not None or spelling(unit) in KNOWN:
            return m[1].strip(), spelling(unit)
    if label.startswith("in ") and is_unit(label[3:]):  # the time of an oscilloscope, "in s"
        return label, spelling(label[3:])
    if (m := _BEHIND.fullmatch(label)) and spelling(m[3]) in KNOWN and m[3] != "1":
        name, unit = m[1].strip(), m[3]
        loose = m[2] == "_" or m[2].isspace()
        if not loose or name.lower() in _TIMES or unit == "V" or (len(unit) > 1 and unit != "min"):
            return name, spelling(unit)
    return label.strip(), ""
