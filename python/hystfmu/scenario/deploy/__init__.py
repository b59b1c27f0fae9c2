"""Part of a loop that runs on the target: its controller alone, as one graph and as one FMU."""
