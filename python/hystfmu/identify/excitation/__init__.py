"""What the data excite: minor loops, speeds of the input, drift of the output."""
