"""Analysis of the excitation: minor loops, input speeds, drift of the output."""
