"""Data of a simulation: scenario file, cases, units, connections, coupling, and events of references."""
