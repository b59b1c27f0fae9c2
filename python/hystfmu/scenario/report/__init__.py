"""Output of scenario results: report page, comparison of two reports, JUnit XML, text for the terminal."""
