"""Checks of an FMU of any origin: its archive, its model description, and trial runs in child processes."""
