"""`hystfmu demo`: the whole way once on built-in data."""
