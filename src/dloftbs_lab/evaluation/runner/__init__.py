"""Scoring of methods on suites."""
