"""Checks, documents and processes that all rooms need, and that know nothing of cables."""
