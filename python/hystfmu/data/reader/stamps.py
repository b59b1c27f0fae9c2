"""Date and clock in text, ``2026-11-22T10:15:00.125Z``, ``22.11.2026 10:15:00,125``, ``10:15:00 PM``, as times in s.

The date is used only if it changes. Day and month are distinguished by the separator, by a number above 12, or by AM
and PM; ambiguous dates are refused.
"""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable, Sequence

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.data.reader.table import Stamps

_DATE = r"(\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[-/.]\d{1,2}[-/.]\d{2,4})[T,; ]\s*"
_CLOCK = r"(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d*)?)"
_STAMP = re.compile(rf"^(?:{_DATE})?{_CLOCK}\s*([AaPp]\.?[Mm]\.?)?\s*(Z|UTC|GMT|[+-]\d{{2}}:?\d{{2}})?$", re.MULTILINE)
_DAY = 86400.0


def is_stamp(cell: str) -> bool:
    """Return whether a cell is a time of day, with or without a date."""
    return _STAMP.fullmatch(cell) is not None


def stamps(cells: Sequence[str], place: Callable[[int], str]) -> Stamps:
    """Convert a column of clocks.

    Parameters
    ----------
    cells : sequence of str
    place : function
        Names a row for a message.

    Raises
    ------
    InputError
        A cell that is not a time; ambiguous dates.
    """
    found = _STAMP.findall("\n".join(cells))
    if len(found) != len(cells):
        k = next(k for k, c in enumerate(cells) if not is_stamp(c))
        raise InputError(f"{place(k)}: The time must be a clock, e.g. 10:15:00.125. Got {cells[k][:40]!r} instead.")
    dates, hours, minutes, seconds, halves, zones = zip(*found, strict=True)
    h = np.array(hours, dtype=np.float64)
    if any(halves):
        h = h % 12 + np.array([12.0 if half[:1] in "pP" and half else 0.0 for half in halves])
    s = [text.replace(",", ".") for text in seconds]
    t = 3600 * h + 60 * np.array(minutes, dtype=np.float64)
    if len(set(zones)) > 1:
        t -= np.array([_offset(zone) for zone in zones])
    day = _days(dates, any(halves), place) if len(set(dates)) > 1 else np.zeros(len(t))
    if not dates[0]:
        day = np.cumsum(np.diff(t, prepend=t[0]) < -_DAY / 2).astype(np.float64)  # past midnight
    whole = _DAY * day + t
    return Stamps(
        whole - whole[0] + (np.array(s, dtype=np.float64) - float(s[0])),
        np.array([10.0 ** -len(text.partition(".")[2]) for text in s]),
        cells[0],
    )


def _offset(zone: str) -> float:
    """Seconds by which a zone is ahead of UTC."""
    if zone[:1] not in ("+", "-"):
        return 0.0
    return float(f"{zone[0]}1") * (3600 * int(zone[1:3]) + 60 * int(zone[-2:]))


def _days(dates: Sequence[str], american: bool, place: Callable[[int], str]) -> np.ndarray:
    """Number the days."""
    different = dict.fromkeys(dates)
    parts = {d: [int(p) for p in re.split(r"[-/.]", d)] for d in different if d}
    if len(parts) < len(different):
        k = next(k for k, d in enumerate(dates) if not d)
        raise InputError(f"{place(k)}: The time must have a date, as the other rows. Got none.")
    iso = all(len(d.partition(d[4])[0]) == 4 for d in parts)
    german = all("." in d for d in parts) or any(p[0] > 12 for p in parts.values())
    american |= any(p[1] > 12 for p in parts.values())
    if not iso and german == american:
        raise InputError(
            f"{place(0)}: The date must be clear. Got {dates[0]!r}, day and month in either order: write the year "
            "first, or give the sample rate in Hz (--rate)."
        )
    order = (0, 1, 2) if iso else (2, 1, 0) if german else (2, 0, 1)
    number = {}
    for d, p in parts.items():
        year, month, day = (p[k] for k in order)
        try:
            number[d] = datetime.date(year + (2000 if year < 100 else 0), month, day).toordinal()
        except ValueError as e:
            k = dates.index(d)
            raise InputError(f"{place(k)}: The date must be one of the calendar. Got {d!r} instead: {e}.") from None
    return np.array([number[d] for d in dates], dtype=np.float64)
