"""What is wrong with an FMU, as a sentence."""

from __future__ import annotations


class Finding(Exception):
    """A finding as a sentence; ends the trial or the run in which it occurs."""
