"""Parts of the linearised loop of a case: dynamics of its plant, slopes along its path, delays by simulation."""
