"""The controller of a loop for a target, as one graph and as one FMU."""
