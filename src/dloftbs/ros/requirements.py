"""Packages of the extra ``ros``, imported when they are needed."""

from __future__ import annotations

import importlib
from typing import Any

from dloftbs.errors import DloftbsError, SourceError

PIP_LINE = "pip install 'dloftbs[ros]'"


def needed(module: str, remedy: str = PIP_LINE, error: type[DloftbsError] = SourceError) -> Any:
    """Return a module that not everybody has installed.

    Parameters
    ----------
    module : str
    remedy : str
        Says what to install.
    error : type of DloftbsError

    Raises
    ------
    DloftbsError
        Of the type given, if it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as missing:
        raise error(f"messages of ROS need the module {module}, which is not there: {remedy}") from missing
