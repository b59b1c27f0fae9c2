"""Simulation of an FMU of any origin: FMI 1.0, 2.0 and 3.0 in Co-Simulation and Model Exchange."""
