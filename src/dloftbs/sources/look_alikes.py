"""Files beside images that are named after them: label images, and pictures that a command drew.

Label images are frames unless a naming rule distinguishes them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from dloftbs.sources.source import logger
from dloftbs.support.values import count_of

_LABEL_NAME = re.compile(
    r"(?P<stem>.+?)(?P<ending>[_.-](?:masks?|labels?|segmentation|seg|(?:obj(?:ect)?|inst(?:ance)?)(?=[_.-]?[0-9]))"
    r"(?:[_.-]all|[_.-]?(?P<number>[0-9]+))?)",
    re.IGNORECASE,
)
"""Endings of stems by which annotation tools and data sets name label images; a number is that of one object."""
_DRAWN_NAME = re.compile(r"(.+)\.(?:overlay|stages)\.png")
"""Names that commands give to pictures in a folder of inputs."""
_PICTURES = (".jpg", ".jpeg")
"""Suffixes of photographs: nobody stores labels with losses."""


def without_drawn(paths: Sequence[Path], where: str) -> list[Path]:
    """Return all frames but the pictures that a command drew of others in their folder, which are reported.

    Parameters
    ----------
    paths : sequence of Path
    where : str
        Folder or pattern that they were found by, for the message.
    """
    stems = {(path.parent, path.stem) for path in paths}
    drawn = [path for path in paths if (name := _DRAWN_NAME.fullmatch(path.name)) and (path.parent, name[1]) in stems]
    if drawn:
        what = f"{count_of(len(drawn), 'picture')} that --overlay or --stages drew, such as {drawn[0].name}"
        logger.warning("%s: left out %s; name it alone to read it", where, what)
    return [path for path in paths if path not in set(drawn)]


def warn_of_labels(paths: Sequence[Path], where: str) -> None:
    """Report images beside their label image, and masks of several objects in a frame, by their names, with a rule.

    Parameters
    ----------
    paths : sequence of Path
        All frames.
    where : str
        Folder or pattern that they were found by, for the message.
    """
    pairs = list(_pairs(paths))
    if not pairs:
        _warn_of_objects(paths, where)
        return
    image, label, rule = max(pairs, key=lambda pair: "*" in pair[2])
    more = f", and {len(pairs) - 1} more such pairs" * (len(pairs) > 1)
    option = "instances" if "*" in rule else "masks"
    logger.warning(
        "%s: %s and %s look like an image and its mask%s; all of them are frames. To use the masks as such, give "
        '%s="%s" (--%s "%s")',
        where,
        image.name,
        label.name,
        more,
        *(option, rule) * 2,
    )


def _warn_of_objects(paths: Sequence[Path], where: str) -> None:
    """Report masks of several objects a frame, which have no picture: of two frames or more, with two masks or more.

    Names are sure where pixels are not: a thin cable that moves fast shares no pixel with itself, either. A single stem
    with many numbers is a stream.
    """
    frames: dict[tuple[Path, str, str], list[Path]] = {}
    for path in paths:
        rule = _rule_of(path)
        if rule is not None and "*" in rule:
            stem = _stem_of(path)
            frames.setdefault((path.parent, stem, rule), []).append(path)
    several = [(rule, group) for (_, _, rule), group in frames.items() if len(group) > 1]
    if len(several) > 1:
        rule, group = several[0]
        logger.warning(
            "%s: %s and %s look like masks of two objects in one frame; all of them are frames, one after the other. "
            'To use them as such, give instances="%s" (--instances "%s")',
            where,
            group[0].name,
            group[1].name,
            rule,
            rule,
        )


def _pairs(paths: Sequence[Path]) -> Iterator[tuple[Path, Path, str]]:
    """Yield the image, its label image and the naming rule of each pair; masks of single objects have a wildcard."""
    by_stem: dict[tuple[Path, str], list[Path]] = {}
    for path in paths:
        by_stem.setdefault((path.parent, path.stem), []).append(path)
    for path in paths:
        rule = _rule_of(path)
        if rule is not None:
            images = by_stem.get((path.parent, _stem_of(path)), [])
            if images:
                yield images[0], path, rule
        elif path.suffix.lower() in _PICTURES:
            others = [p for p in by_stem[path.parent, path.stem] if p.suffix.lower() not in _PICTURES]
            if others:
                yield path, others[0], f"{{stem}}{others[0].suffix}"


def _rule_of(path: Path) -> str | None:
    """Return the naming rule of a file that is named like a label image; None of another."""
    named = _LABEL_NAME.fullmatch(path.stem)
    if named is None:
        return None
    ending = named["ending"] if named["number"] is None else named["ending"].removesuffix(named["number"]) + "*"
    return f"{{stem}}{ending}{path.suffix}"


def _stem_of(path: Path) -> str:
    """Return the stem of the frame that a label image goes with by its name."""
    named = _LABEL_NAME.fullmatch(path.stem)
    return path.stem if named is None else named["stem"]
