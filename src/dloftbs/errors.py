"""The errors of the package; each is also the built-in error that it stands for."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the module has errors alone
    from collections.abc import Iterator

_MAX_CHARACTERS = 4000
"""Length of the longest message shown: a library's error, quoted in ours, may hold a whole corrupt file."""


class DloftbsError(Exception):
    """Base of every error that this package raises on purpose."""

    def __str__(self) -> str:
        text = super().__str__()
        if len(text) <= _MAX_CHARACTERS:
            return text
        half = _MAX_CHARACTERS // 2
        return f"{text[:half]} [{len(text) - 2 * half} characters left out] {text[-half:]}"


class InputError(DloftbsError, ValueError):
    """An argument has the wrong shape, type or value; the message says what was expected and what came."""


class ConfigError(DloftbsError, ValueError):
    """A configuration has an unknown key, a wrong type or a value out of range."""


class SourceError(DloftbsError, OSError):
    """A source of frames cannot be opened or read."""


class SinkError(DloftbsError, OSError):
    """A result cannot be written."""


class DependencyError(DloftbsError, ImportError):
    """A package that everything needs cannot be imported; the message says how to install it."""


def explain_import(error: ImportError) -> ImportError:
    """Return an error that names the remedy where OpenCV cannot be imported, and any other error as it is.

    OpenCV is no dependency that pip installs by itself: its four packages share one folder, and one that is installed
    over another breaks that one's windows or modules.
    """
    if (error.name or "").partition(".")[0] != "cv2":
        return error
    if isinstance(error, ModuleNotFoundError):
        return DependencyError(
            "OpenCV is not installed. Install one of its packages: pip install 'dloftbs[headless]' takes "
            "opencv-python-headless; opencv-python and opencv-contrib-python serve as well",
            name="cv2",
        )
    return DependencyError(
        f"OpenCV is installed but cannot be loaded ({error}). On a machine without a screen, replace it: "
        "pip uninstall opencv-python opencv-contrib-python, then pip install 'dloftbs[headless]'",
        name="cv2",
    )


@contextmanager
def source_errors(what: object, kinds: type[Exception] | tuple[type[Exception], ...] = SourceError) -> Iterator[None]:
    """Raise an error of some kinds in the block as a `SourceError` that begins with what is read."""
    try:
        yield
    except kinds as error:
        raise SourceError(f"{what}: {error}") from error
