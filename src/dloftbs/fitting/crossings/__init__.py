"""Crossings of objects with each other and themselves, and which of the two is on top."""
