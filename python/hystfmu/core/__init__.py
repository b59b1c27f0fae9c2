"""Binding of the C core: library, block tables, the executor of a graph, its continuous-time form."""
