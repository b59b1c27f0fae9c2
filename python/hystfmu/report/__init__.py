"""HTML pages, plots and terminal output. This package does not depend on models or scenarios."""
