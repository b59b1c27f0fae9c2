"""`hystfmu start`: from one record to a model, its inverse, a tuned loop, FMUs and a report."""
