"""The version, alone, so that the build can read it without importing the package."""

from __future__ import annotations

from functools import cache

__version__ = "0.1.0"


@cache
def code_version(without: tuple[str, ...]) -> str:
    """Return the version of this package and a digest of its code, which in a checkout changes without the version.

    Parameters
    ----------
    without : tuple of str
        Beginnings of paths below the package, of what makes no difference to whom this is told.
    """
    import hashlib
    from pathlib import Path

    root = Path(__file__).parent
    names = (path.relative_to(root).as_posix() for path in sorted(root.rglob("*.py")))
    code = b"".join((root / name).read_bytes() for name in names if not name.startswith(without))
    return f"{__version__}+{hashlib.sha256(code).hexdigest()[:12]}"
