"""Foundations that every other subpackage may import: errors, arrays, untrusted files, child processes."""

from pathlib import Path

__version__ = "0.2.0"

PACKAGE = Path(__file__).parents[1]
"""Folder of the installed package. The build copies the libraries, the C source, the licence and the scenarios here."""
