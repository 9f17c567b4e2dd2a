"""The figures of a user's screen, taken from the page of details: what ``make bench`` measured, in ten lines.

Run it with ``python -m benchmarks.summary [--details PAGE] [--docs PAGE]``, after those that write the details.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from benchmarks.docs import published

DETAILS = Path("docs/maintainers/performance-details.md")

_PIPELINE = r"mask to tracked curves +([\d.]+) +([\d.]+)"
_HEADINGS = ("1280 x 720, one core, a frame", "median ms", "99 % ms")
_LINES = (
    ("mask to tracked curve, one cable 1500 px long", "speed", r"^1 cable ", _PIPELINE),
    ("five such cables in one tangle", "speed", r"^5 cables  ", _PIPELINE),
    ("five cables of 400 to 700 px that move freely", "speed", r"^5 cables, freely", _PIPELINE),
    ("before that: colour to mask", "speed", r"^colour to mask", r"ours, hue wrapping around 0 +([\d.]+) +([\d.]+)"),
    ("after that: depth to metres", "speed", r"^depth to metres", r"^  all +([\d.]+) +([\d.]+)"),
)
_OTHERS = (
    (
        *("a video, tracked, on two cores", "throughput", r"^track, 2 cores"),
        *(r"video to curves  .* ([\d.]+) +[\d.]+ +[\d.]+$", "frames/s"),
    ),
    ("a later start of the command", "process", r"^whole process", r"mask.png, cached +([\d.]+)", "s"),
    ("the first start: compiling", "process", r"^whole process", r"mask.png, compiling +([\d.]+)", "s"),
    ("memory after 10,000 frames", "process", r"^resident memory", r"after 10000 frames +([\d.]+)", "MiB"),
)


def main() -> None:
    """Print the lines, under the machine that they were measured on."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--details", type=Path, default=DETAILS, metavar="PAGE", help="page of the benchmarks")
    parser.add_argument("--docs", type=Path, metavar="PAGE", help="put what is printed into this page, too")
    given = parser.parse_args()
    with published("summary", given.docs):
        print(summarise(given.details.read_text("utf-8")))


def summarise(details: str) -> str:
    """Return the lines of a page of details.

    Raises
    ------
    ValueError
        If a figure is not on the page.
    """
    title, median, p99 = _HEADINGS
    lines = [block(details, "machine"), "", f"{title:52}{median:>10}{p99:>10}"]
    for what, name, heading, pattern in _LINES:
        found = figures(block(details, name), heading, pattern)
        lines.append(f"  {what:50}" + "".join(f"{float(value):10.2f}" for value in found))
    lines.append("")
    for what, name, heading, pattern, unit in _OTHERS:
        (value,) = figures(block(details, name), heading, pattern)
        lines.append(f"{what:52}{float(value):10.3g} {unit}")
    return "\n".join(lines)


def block(page: str, name: str) -> str:
    """Return what stands between the marks of a name.

    Raises
    ------
    ValueError
        If the page has no such marks.
    """
    found = re.search(rf"<!-- made: {re.escape(name)} -->\n```text\n(.*?)\n```\n<!-- end -->", page, re.DOTALL)
    if found is None:
        raise ValueError(f"the page has no figures of {name!r}: run its benchmark first")
    return found[1]


def figures(text: str, heading: str, pattern: str) -> tuple[str, ...]:
    """Return the groups of the first match of a pattern after the line of a heading.

    Raises
    ------
    ValueError
        If there is none.
    """
    start = re.search(heading, text, re.MULTILINE)
    found = start and re.compile(pattern, re.MULTILINE).search(text, start.start())
    if not found:
        raise ValueError(f"no figure {pattern!r} after {heading!r}")
    return found.groups()


if __name__ == "__main__":
    main()
