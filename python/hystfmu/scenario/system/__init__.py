"""Description of a run: scenario file, cases, units, connections, coupling, events of references."""
