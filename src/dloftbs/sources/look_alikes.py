"""Images and their label images in one folder, which are all frames unless a naming rule tells them apart."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from dloftbs.sources.source import logger

_LABEL_NAME = re.compile(r"(?P<stem>.+)(?P<ending>[_.-](?:masks?|labels?|segmentation|seg))", re.IGNORECASE)
"""Endings of stems by which annotation tools and data sets name label images."""
_PICTURES = (".jpg", ".jpeg")
"""Suffixes of photographs: nobody stores labels with losses."""


def warn_of_labels(paths: Sequence[Path], where: str) -> None:
    """Report images that lie beside what their names say is their label image, with the rule that tells them apart.

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
    image, label, rule = pairs[0]
    more = f", and {len(pairs) - 1} more such pairs" * (len(pairs) > 1)
    logger.warning(
        "%s: %s and %s look like an image and its mask%s; all of them are frames. "
        'To use the masks as such, give masks="%s" (--masks "%s")',
        where,
        image.name,
        label.name,
        more,
        rule,
        rule,
    )


def _pairs(paths: Sequence[Path]) -> Iterator[tuple[Path, Path, str]]:
    """Yield the image, its label image and the naming rule of each pair."""
    by_stem: dict[tuple[Path, str], list[Path]] = {}
    for path in paths:
        by_stem.setdefault((path.parent, path.stem), []).append(path)
    for path in paths:
        named = _LABEL_NAME.fullmatch(path.stem)
        if named is not None:
            images = by_stem.get((path.parent, named["stem"]), [])
            if images:
                yield images[0], path, f"{{stem}}{named['ending']}{path.suffix}"
        elif path.suffix.lower() in _PICTURES:
            others = [p for p in by_stem[path.parent, path.stem] if p.suffix.lower() not in _PICTURES]
            if others:
                yield path, others[0], f"{{stem}}{others[0].suffix}"
