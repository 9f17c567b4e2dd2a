"""Methods to be scored, by name: the package's own, and anybody's function."""

from __future__ import annotations

import functools
import hashlib
import importlib
import inspect
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any, cast

from dloftbs.config import Config
from dloftbs.errors import InputError
from dloftbs.evaluation.runner.sequence_run import Method
from dloftbs.frame import Frame
from dloftbs.frame_result import FrameResult

_CONFIGS: dict[str, Callable[[], Config]] = {"default": Config, "paper": Config.paper}


def method_of(name: str) -> Method:
    """Return a method by its name.

    Parameters
    ----------
    name : str
        "default", "paper", or ``module:callable``: a function from a `Frame` to curves, or a class, of which an
        instance is made for each sequence and called in this way.

    Raises
    ------
    InputError
        If there is no such method, or its module cannot be imported.
    """
    if name in _CONFIGS:
        config = _CONFIGS[name]()
        return Method(name, functools.partial(_pipeline, config), config.to_yaml())
    module_name, colon, _ = name.partition(":")
    if not colon:
        raise InputError(f"there is no method {name!r}; methods are {', '.join(_CONFIGS)} and module:callable")
    found = _imported(name)
    if not callable(found) or (inspect.isclass(found) and "__call__" not in dir(found)):
        raise InputError(f"method {name!r} must be a function, or a class whose instances can be called, got {found!r}")
    return Method(name, functools.partial(_strangers, name), _digest(importlib.import_module(module_name)))


def _pipeline(config: Config) -> Callable[[Frame], FrameResult]:
    from dloftbs.pipeline import Pipeline

    return Pipeline(config).process


def _strangers(name: str) -> Callable[[Frame], Any]:
    found = _imported(name)
    made = found() if inspect.isclass(found) else found
    return cast(Callable[[Frame], Any], made)


def _imported(name: str) -> Any:
    module_name, _, attribute = name.partition(":")
    try:
        module = importlib.import_module(module_name)
    except Exception as error:  # a stranger's module may raise anything
        raise InputError(f"method {name!r}: cannot import {module_name!r}: {type(error).__name__}: {error}") from error
    try:
        return functools.reduce(getattr, attribute.split("."), module)
    except AttributeError as error:
        raise InputError(f"method {name!r}: {error}") from error


def _digest(module: ModuleType) -> str:
    """Return what changes when the module's file does: what it imports in turn is not watched."""
    file = getattr(module, "__file__", None)
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()[:12] if file else ""
