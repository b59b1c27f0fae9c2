"""TDMS files of LabVIEW by npTDMS: channels of numbers and times, with the step of their waveform."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from hystfmu.base.told_arrays import Found, number, serve, since_first

UNITS = ("unit_string", "NI_UnitDescription", "unit", "Unit")


def arrays(source: str) -> tuple[list[Found], list[str]]:
    """Return the channels, named with their group where there are several groups."""
    from nptdms import TdmsFile

    file = TdmsFile.open(source)
    groups = [group for group in file.groups() if group.channels()]
    found = []
    for group in groups:
        for channel in group.channels():
            name = channel.name if len(groups) == 1 else f"{group.name}/{channel.name}"
            found += _found(name, channel)
    return found, []


def _found(name: str, channel: Any) -> list[Found]:
    dtype = channel.dtype
    unit = next((str(channel.properties[k]) for k in UNITS if k in channel.properties), "")
    if dtype.kind == "M" and len(channel):
        seconds, first = since_first(np.asarray(channel[:]))
        return [Found(name, seconds.shape, seconds.nbytes, lambda: seconds, "s", first)]
    if dtype.kind not in "biuf":
        return []
    found = [Found(name, (len(channel),), 8 * len(channel), partial(channel.__getitem__, slice(None)), unit)]
    step = channel.properties.get("wf_increment")
    return [*found, number(f"{name}@dt", float(step))] if step else found


if __name__ == "__main__":
    serve(arrays)
