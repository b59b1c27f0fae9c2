"""Parsers of binary files, each run by its path in a confined process; no module of the package imports them."""
