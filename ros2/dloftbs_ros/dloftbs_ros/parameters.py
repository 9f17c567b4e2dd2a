"""Parameters as they arrive, and what they ask for."""

from __future__ import annotations

from typing import Any, TypeVar

from dloftbs import Config, Pipeline
from dloftbs.errors import ConfigError

T = TypeVar("T", str, int, float)


def as_type(name: str, value: Any, default: T) -> T:
    """Return the value of a parameter in the type of its default.

    On a command line the shape of a value makes its type: ``hsv:=1`` is an integer, ``max_rate:=5`` as well.

    Raises
    ------
    ConfigError
        If it cannot be taken for that.
    """
    kind = type(default)
    taken = {str: (str, int, float), int: (int,), float: (int, float)}[kind]
    if isinstance(value, bool) or not isinstance(value, taken):
        what = {str: "text", int: "an integer", float: "a number"}[kind]
        raise ConfigError(f"the parameter {name} must be {what}, got {value!r}")
    return kind(value)


def make_pipeline(config: str, hsv: str, objects: int) -> Pipeline:
    """Return the pipeline that the parameters ask for; what is empty, or 0, is left to the configuration.

    Raises
    ------
    ConfigError
        If one of them is wrong, or the configuration cannot be read.
    """
    return Pipeline(Config.from_file(config) if config else None, hsv=hsv or None, objects=objects or None)
