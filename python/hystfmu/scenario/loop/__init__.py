"""Linearised loop of a case: dynamics of the plant, slopes along the path, and delays by simulation."""
