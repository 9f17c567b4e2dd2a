"""Images and their label images in one folder, which are all frames unless a naming rule distinguishes them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from dloftbs.sources.source import logger

_LABEL_NAME = re.compile(
    r"(?P<stem>.+?)(?P<ending>[_.-](?:masks?|labels?|segmentation|seg)(?:[_.-](?:all|(?P<number>[0-9]+)))?)",
    re.IGNORECASE,
)
"""Endings of stems by which annotation tools and data sets name label images; a number is that of one object."""
_PICTURES = (".jpg", ".jpeg")
"""Suffixes of photographs: nobody stores labels with losses."""


def warn_of_labels(paths: Sequence[Path], where: str) -> None:
    """Report images that lie beside what their names say is their label image, with the rule that distinguishes them.

    Parameters
    ----------
    paths : sequence of Path
        All frames.
    where : str
        Folder or pattern that they were found by, for the message.
    """
    pairs = list(_pairs(paths))
    if not pairs:
        return
    image, label, rule = min(pairs, key=lambda pair: pair[2] is None)
    more = f", and {len(pairs) - 1} more such pairs" * (len(pairs) > 1)
    if rule is None or any(pair[2] is None for pair in pairs):
        remedy = f'Give the images alone, such as "*{image.suffix}"'
        remedy += f', and with them masks="{rule}" (--masks "{rule}")' if rule is not None else ""
    else:
        remedy = f'To use the masks as such, give masks="{rule}" (--masks "{rule}")'
    logger.warning(
        "%s: %s and %s look like an image and its mask%s; all of them are frames. %s",
        where,
        image.name,
        label.name,
        more,
        remedy,
    )


def _pairs(paths: Sequence[Path]) -> Iterator[tuple[Path, Path, str | None]]:
    """Yield the image, its label image and the naming rule of each pair; None for the masks of single objects."""
    by_stem: dict[tuple[Path, str], list[Path]] = {}
    for path in paths:
        by_stem.setdefault((path.parent, path.stem), []).append(path)
    for path in paths:
        named = _LABEL_NAME.fullmatch(path.stem)
        if named is not None:
            images = by_stem.get((path.parent, named["stem"]), [])
            if images:
                rule = None if named["number"] else f"{{stem}}{named['ending']}{path.suffix}"
                yield images[0], path, rule
        elif path.suffix.lower() in _PICTURES:
            others = [p for p in by_stem[path.parent, path.stem] if p.suffix.lower() not in _PICTURES]
            if others:
                yield path, others[0], f"{{stem}}{others[0].suffix}"
