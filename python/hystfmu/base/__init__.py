"""Ground floor: errors, arrays, files that come from outside, child processes, and where the package keeps its own."""
