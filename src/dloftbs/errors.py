"""The errors of the package; each is also the built-in error that it stands for."""

from __future__ import annotations


class DloftbsError(Exception):
    """Base of every error that this package raises on purpose."""


class InputError(DloftbsError, ValueError):
    """An argument has the wrong shape, type or value; the message says what was expected and what came."""


class ConfigError(DloftbsError, ValueError):
    """A configuration has an unknown key, a wrong type or a value out of range."""


class SourceError(DloftbsError, OSError):
    """A source of frames cannot be opened or read."""


class SinkError(DloftbsError, OSError):
    """A result cannot be written."""
