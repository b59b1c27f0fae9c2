"""Regressors of fits and first blocks of models: plays, relays, static nonlinearities, initial memory, dead band."""
