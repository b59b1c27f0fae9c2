"""What runs: scenario file, cases, units, connections, coupling, events of references."""
