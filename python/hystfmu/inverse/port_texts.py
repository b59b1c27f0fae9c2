"""Descriptions of the ports of an inverse, from those of the model."""

from __future__ import annotations

from hystfmu.graph import Input, Output


def wanted_text(sink: Output) -> str:
    """Describe the input of an inverse: the wanted output `sink` of the model."""
    return _with("wanted output", sink.text)


def given_text(source: Input) -> str:
    """Describe the output of an inverse: the input `source` of the model."""
    return _with("input that gives it", source.text)


def _with(text: str, own: str) -> str:
    what = own.rpartition(": ")[2]  # of the inverse of an inverse
    return f"{text}: {what}" if what else text
