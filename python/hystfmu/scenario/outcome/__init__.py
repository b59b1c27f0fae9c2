"""Results of a run: chunks of rows, excerpts for plots, CSV files, and metrics."""
