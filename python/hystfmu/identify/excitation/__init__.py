"""Analysis of the excitation in a record: minor loops, speeds, initial memory, lag, and signals it does not contain."""
