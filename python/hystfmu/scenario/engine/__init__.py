"""Simulation engines: the master loop over FMUs, the native engine in C, and foreign FMUs in a child process."""
