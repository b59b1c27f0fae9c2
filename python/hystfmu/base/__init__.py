"""Foundations that every other room may import: errors, arrays, untrusted files, child processes, package files."""
