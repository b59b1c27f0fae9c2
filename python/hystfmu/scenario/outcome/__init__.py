"""Results of a run: chunks of rows, excerpts for pictures, CSV files, metrics."""
