"""Numerical tests of equations, lemmas and theorems of the four papers, as table rows that take only seconds."""
