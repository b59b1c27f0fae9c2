"""Checking any FMU: the archive, static checks, and trial runs in a process of their own."""
