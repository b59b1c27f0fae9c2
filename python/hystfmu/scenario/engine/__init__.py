"""Simulation engines: units as FMUs or as graphs of the core, the master in C, foreign FMUs in a child process."""
