"""SSP archives: write a scenario as an archive, and read and run archives of other tools."""
