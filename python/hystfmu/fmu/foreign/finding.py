"""Finding about an FMU, as a sentence."""

from __future__ import annotations


class Finding(Exception):
    """A finding as a sentence; ends the trial or the run in which it occurs."""


class Ended(Finding):
    """The FMU ends the simulation by itself, as the standard allows it."""
