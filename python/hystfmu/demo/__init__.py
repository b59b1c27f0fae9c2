"""`hystfmu demo`: the whole workflow on built-in data."""
