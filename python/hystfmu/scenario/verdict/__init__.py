"""What it is worth: limits, baselines, the verdict on every metric."""
