"""Analysis of a record: minor loops, speeds, initial memory, lag, and kinds of signals that it does not contain."""
