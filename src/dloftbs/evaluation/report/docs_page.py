"""Puts the report of a run into the documentation: ``python -m dloftbs.evaluation.report.docs_page RESULTS PAGE``."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import cv2

from dloftbs.errors import SourceError
from dloftbs.evaluation.report.write import MARKDOWN
from dloftbs.evaluation.runner.finished_parts import write

BEGIN = "<!-- made by `make results` from here on -->\n"
PICTURES = "images/results"
MOST_BYTES = 300_000

_LINK = re.compile(r"!\[([^]]*)\]\(([^)]+)\)")
_SHRINK = 0.85
_JPEG_QUALITY = 75


def assemble(results: Path, page: Path) -> None:
    """Replace what was made on a page by the report of a run, and put its pictures, small ones, beside it.

    Parameters
    ----------
    results : Path
        The folder of the run.
    page : Path
        Page to write; its text before `BEGIN` stays.

    Raises
    ------
    SourceError
        If there is no report or no page.
    SinkError
        If a file cannot be written.
    """
    try:
        report = (results / MARKDOWN).read_text("utf-8")
        head = page.read_text("utf-8").partition(BEGIN)[0]
    except OSError as error:
        raise SourceError(f"cannot put {str(results)!r} on {str(page)!r}: {error}") from error
    pictures = page.parent / PICTURES
    for old in pictures.glob("*"):
        old.unlink()

    def embedded(link: re.Match[str]) -> str:
        source = results / link[2]
        name, data = small(source)
        write(pictures / name, data)
        return f"![{link[1]}]({PICTURES}/{name})"

    write(page, f"{head}{BEGIN}\n{_LINK.sub(embedded, report)}".encode())


def small(picture: Path) -> tuple[str, bytes]:
    """Return a name and the data of a picture, as it is where it is small enough, and else as a smaller JPEG.

    Raises
    ------
    SourceError
        If it cannot be read.
    """
    folder = picture.parent.name
    pixels = cv2.imread(str(picture))
    if pixels is None:
        raise SourceError(f"cannot read the picture {str(picture)!r}")
    data, suffix = picture.read_bytes(), picture.suffix
    while len(data) > MOST_BYTES:
        encoded = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])[1]
        data, suffix = encoded.tobytes(), ".jpg"
        pixels = cv2.resize(pixels, None, fx=_SHRINK, fy=_SHRINK, interpolation=cv2.INTER_AREA)
    return f"{folder}-{picture.stem}{suffix}", data


if __name__ == "__main__":
    assemble(Path(sys.argv[1]), Path(sys.argv[2]))
