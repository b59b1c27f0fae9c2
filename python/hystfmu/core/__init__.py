"""Binding of the C core: the library, its block tables, and executors of a graph in discrete and continuous time."""
