"""Regressors and front ends of models: plays, monomials, auxiliary functions, initial memory, dead band."""
