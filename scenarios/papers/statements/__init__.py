"""Rows that test equations, lemmas and theorems of the four papers by numbers or counterexamples, in seconds."""
