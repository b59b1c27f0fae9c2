"""Foundations that every other room may import: errors, arrays, untrusted files, child processes, package files."""

from __future__ import annotations

from pathlib import Path

__version__ = "0.1.0"

PACKAGE = Path(__file__).parents[1]
"""The folder of the package; the build puts libraries, C source, licence and scenarios into it."""
