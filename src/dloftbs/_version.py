"""The version, alone, so that the build can read it without importing the package."""

from __future__ import annotations

from functools import cache

__version__ = "0.1.0"


@cache
def code_version(without: tuple[str, ...], beside: str | None = None) -> str:
    """Return the version of this package and a digest of its code, which in a checkout changes without the version.

    Parameters
    ----------
    without : tuple of str
        Beginnings of paths below a package, of what makes no difference to the caller.
    beside : str, optional
        Folder of another package, whose code counts as well.
    """
    import hashlib
    from pathlib import Path

    code = hashlib.sha256()
    for root in (Path(__file__).parent, *([] if beside is None else [Path(beside)])):
        for path in sorted(root.rglob("*.py")):
            if not path.relative_to(root).as_posix().startswith(without):
                code.update(path.read_bytes())
    return f"{__version__}+{code.hexdigest()[:12]}"
