"""The C core seen from Python: its library and block tables, the executor of a graph, a graph in continuous time."""
