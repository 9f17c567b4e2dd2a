"""Puts a run into the documentation: ``python -m dloftbs_lab.evaluation.report.docs_page RESULTS DOCS``.

RESULTS is the folder that ``dloftbs evaluate`` wrote of the generated suites, and two options name others: of the
default with one cable known, and of photographs. The page ``DOCS/results.md`` and README get what they say of the
figures, ``DOCS/results/`` a page for each suite and ``summary.json``, and ``DOCS/images/results/`` the pictures, small
ones. Photographs belong to others: their page has figures alone, and without their run it stays as it is.
"""

from __future__ import annotations

import argparse
import json
import re
from pathlib import Path
from typing import Any

import cv2

from dloftbs.errors import SourceError, source_errors
from dloftbs.support.json_text import encode
from dloftbs.support.safe_files import write_whole
from dloftbs_lab.evaluation.report.first_page import first_page, readme_line
from dloftbs_lab.evaluation.report.pages import OVERALL, PAPER
from dloftbs_lab.evaluation.report.write import PAGES, SUMMARY

PAGE, FOLDER, PICTURES, PHOTOGRAPHS = "results.md", "results", "images/results", "photographs.md"
README = "README.md"
BEGIN, END = "<!-- made by `make results` -->\n", "<!-- end -->\n"
MAX_BYTES = 300_000

_BLOCK = re.compile(f"({re.escape(BEGIN)}).*?({re.escape(END)})", re.DOTALL)
_LINK = re.compile(r"!\[([^]]*)\]\(([^)]+)\)")
_ON_PHOTOGRAPHS = (
    "# Photographs†\n\n"
    "Photographs of others, with masks and truth by hand; none of them is kept here, only figures.\n\n"
    "- *cables*: ten of the data set of Ariadne (De Gregorio et al., 2018), of the family of the paper's Table II. The "
    "masks are those by hand that come with them; the paper has those of a network. A curve is right within 10 px.\n"
    "- *mbest*: the first thirty of each set of mBEST (Choi et al., 2023), one, two and three cables. Masks are by "
    "their colours, and labelled pixels are the truth.\n\n"
    "† These photographs were among what the weights of the default's linking were fitted on. With all of them left "
    "out of the fit no choice in them is read wrongly either: see [the weights of linking]"
    "(../maintainers/linking-weights.md). The published method has no fitted weights.\n\n"
    "`make results PHOTOGRAPHS=FOLDER` makes this page again, if FOLDER holds `cables` and `mbest`.\n"
)
_SHRINK = 0.85
_JPEG_QUALITY = 75


def assemble(results: Path, docs: Path, one_cable: Path | None = None, photographs: Path | None = None) -> None:
    """Put a run into the documentation.

    Parameters
    ----------
    results : Path
        The folder of the run.
    docs : Path
        The folder of the documents; README lies beside it.
    one_cable : Path, optional
        The folder of a run of the default that knows that there is one cable; README then has its figures beside.
    photographs : Path, optional
        The folder of a run on photographs; without it what is said of these stays.

    Raises
    ------
    SourceError
        If a run has no report, or a page no place for what is made.
    SinkError
        If a file cannot be written.
    """
    summary = _summary(results)
    if one_cable is not None:
        summary["one_cable"] = {"suites": _summary(one_cable)["suites"]}
    before = docs / FOLDER / SUMMARY
    if photographs is not None:
        of_photographs = _summary(photographs)
        for suite in of_photographs["suites"].values():
            suite["title"] = "photographs of others"  # in the place of a folder's name
        summary["photographs"] = {"suites": of_photographs["suites"]}
    elif before.is_file():
        summary |= {key: value for key, value in _read_json(before).items() if key == "photographs"}
    made = {docs / PAGE: first_page(summary), docs.parent / README: readme_line(summary)}
    blocks = {page: _replaced(page, block) for page, block in made.items()}
    for old in (*(docs / PICTURES).glob("*"), *(docs / FOLDER).glob("*.md")):
        if old.name != PHOTOGRAPHS:
            old.unlink()
    for page in sorted((results / PAGES).glob("*.md")):
        write_whole(docs / FOLDER / page.name, _with_pictures(page, docs).encode())
    if photographs is not None:
        write_whole(docs / FOLDER / PHOTOGRAPHS, _page_of_photographs(photographs).encode())
    write_whole(before, encode(summary, indent=1))
    for page, text in blocks.items():
        write_whole(page, text.encode())


def block_of(page: Path) -> str:
    """Return what was made on a page.

    Raises
    ------
    SourceError
        If there is no page, or no such place on it.
    """
    found = _BLOCK.search(_read(page))
    if found is None:
        raise SourceError(f"{str(page)!r} has no place for results: expected {BEGIN.strip()} and {END.strip()}")
    return found[0].removeprefix(BEGIN).removesuffix(END)


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
    while len(data) > MAX_BYTES:
        encoded = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])[1]
        data, suffix = encoded.tobytes(), ".jpg"
        pixels = cv2.resize(pixels, None, fx=_SHRINK, fy=_SHRINK, interpolation=cv2.INTER_AREA)
    return f"{folder}-{picture.stem}{suffix}", data


def _replaced(page: Path, block: str) -> str:
    block_of(page)
    return _BLOCK.sub(lambda old: f"{old[1]}{block}{old[2]}", _read(page))


def _with_pictures(page: Path, docs: Path) -> str:
    """Return a page of a run whose pictures, small ones, lie in the documents."""

    def embedded(link: re.Match[str]) -> str:
        name, data = small(page.parent / link[2])
        write_whole(docs / PICTURES / name, data)
        return f"![{link[1]}](../{PICTURES}/{name})"

    return _LINK.sub(embedded, _read(page))


def _page_of_photographs(results: Path) -> str:
    """Return the tables of all pages but that over all suites, without their pictures and names of folders."""
    names = sorted(path.stem for path in (results / PAGES).glob("*.md") if path.stem not in (OVERALL, PAPER))
    tables = [_tables(_read(results / PAGES / f"{name}.md")) for name in (PAPER, *names)]
    return "\n".join([_ON_PHOTOGRAPHS, *tables])


def _tables(page: str) -> str:
    return page[page.find("### ") :].partition("### Pictures")[0]


def _summary(results: Path) -> dict[str, Any]:
    return _read_json(results / SUMMARY)


def _read_json(path: Path) -> dict[str, Any]:
    return json.loads(_read(path))


def _read(path: Path) -> str:
    with source_errors("cannot make the pages of the results", OSError):
        return path.read_text("utf-8")


def main() -> None:
    """Put the runs that the command line names into the documentation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=Path)
    parser.add_argument("docs", type=Path)
    parser.add_argument("--one-cable", type=Path)
    parser.add_argument("--photographs", type=Path)
    assemble(**vars(parser.parse_args()))


if __name__ == "__main__":
    main()
