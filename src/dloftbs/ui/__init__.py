"""The local web page: tune a segmentation on any source, and look at curves live.

Served by aiohttp (``pip install 'dloftbs[ui]'``) from one folder of plain HTML, CSS and JavaScript, `page/`. The
browser asks no other host.

`TuneSession` and `ViewSession` hold what a page shows; `serve` gives it a server in a thread of its own::

    with serve(ViewSession(frames, Config(), "name")) as address:
        ...

Importing this room needs the extra; `dloftbs` itself never does.
"""

from __future__ import annotations

from dloftbs.errors import InputError

REMEDY = "the page needs aiohttp: pip install 'dloftbs[ui]'"


def require() -> None:
    """Raise unless the extra is installed.

    Raises
    ------
    InputError
        With the line that installs it.
    """
    try:
        import aiohttp  # noqa: F401 - only whether it is there
    except ImportError as error:
        raise InputError(REMEDY) from error
