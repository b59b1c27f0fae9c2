"""Pages, plots and terminal output for people; knows nothing of models or scenarios."""
