"""What came out: chunks of rows, excerpts for pictures, CSV files, metrics."""
