"""Scenarios for people and machines: report page, comparison of two reports, JUnit, terminal."""
