"""Equations, lemmas and theorems of the four papers as rows: a check or a counterexample, each computed in seconds."""
