"""SSP archives: write a scenario as one, read and run those of other tools."""
