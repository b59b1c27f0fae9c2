"""The command `hystfmu start` creates a model, its inverse, a tuned loop, FMUs and a report from one record."""
