"""Naming rules: which files go with a colour file, by its stem.

A rule such as ``"{stem}_depth.png"`` names one file. One with wildcards in its file name, such as
``"{stem}_mask_*.png"``, names a file per object. Where a name could belong to two stems, it is that of the longer one.
"""

from __future__ import annotations

import fnmatch
import functools
import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from dloftbs.sources.image_files import natural_key
from dloftbs.sources.source import logger

STEM = "{stem}"
_WILDCARDS = re.compile(r"[*?\[]")
_UNION = re.compile(r".*[_.-]all", re.IGNORECASE)


def is_rule(where: str | None) -> bool:
    """Return whether this is a naming rule, and not a path."""
    return where is not None and STEM in where


def is_pattern(rule: str) -> bool:
    """Return whether a rule names any number of files for a frame."""
    return is_rule(rule) and _WILDCARDS.search(os.path.basename(rule)) is not None


def is_union(path: Path) -> bool:
    """Return whether a file beside those of single objects holds all of them, by its name, ``photo_mask_all.png``."""
    return _UNION.fullmatch(path.stem) is not None


def partner_of(path: Path, rule: str) -> Path:
    """Return the file that goes with a colour file under a rule without wildcards."""
    return _normal(path.parent / rule.replace(STEM, path.stem))


def partners_of(paths: Sequence[Path], rule: str) -> list[list[Path]]:
    """Return the files that go with each colour file: of a rule with wildcards those that are there, in natural order.

    A file whose stem ends in ``_all`` is left out: it is the union of the objects.
    """
    if not is_pattern(rule):
        return [[partner_of(path, rule)] for path in paths]
    folder, name = os.path.split(rule)
    found: dict[Path, list[Path]] = {path: [] for path in paths}
    by_folder: dict[Path, dict[str, list[Path]]] = {}
    for path in found:
        by_folder.setdefault(partner_of(path, folder), {}).setdefault(path.stem, []).append(path)
    for place, by_stem in by_folder.items():
        for file in _files_in(place):
            stem = stem_in(file.name, name, by_stem) if STEM in name else next(iter(by_stem))
            is_named = STEM in name or fnmatch.fnmatchcase(file.name, name)
            for path in by_stem.get(stem or "", ()) if is_named and not is_union(file) else ():
                found[path].append(file)
    return [[file for file in sorted(found[path], key=natural_key) if file != _normal(path)] for path in paths]


def without_partners(paths: Sequence[Path], rule: str) -> list[Path]:
    """Return the colour files: those that are no other's partner under the rule.

    A file that is named like a partner, but belongs to nothing, is left out with a warning.
    """
    groups = partners_of(paths, rule)
    partners = {partner for group in groups for partner in group}
    colour = []
    for path, group in zip(paths, groups, strict=True):
        if _normal(path) in partners and not (is_pattern(rule) and group):  # one with objects of its own is a frame
            continue
        if stem_under(path, rule) is not None and not any(os.path.exists(partner) for partner in group):
            if not is_pattern(rule) or not is_union(path):
                logger.warning("left out %s: it is named by the rule %r, and no file goes with it", path, rule)
            continue
        colour.append(path)
    return colour


def stem_under(path: Path, rule: str) -> str | None:
    """Return the stem of the frame that a file in the frames' own folder goes with by its name; None if with none."""
    folder, name = os.path.split(rule)
    is_beside = _normal(path.parent / folder) == _normal(path.parent)
    return stem_in(path.name, name) if is_beside and STEM in name else None


def stem_in(text: str, name: str, known: Iterable[str] | None = None) -> str | None:
    """Return the longest stem with which a rule's file name gives a text, among `known` ones; None if there is none."""
    before, _, after = name.partition(STEM)
    if not text.startswith(before):
        return None
    ends = _endings(after)
    for end in range(len(text) - 1, len(before), -1):
        stem = text[len(before) : end]
        if (known is None or stem in known) and ends.fullmatch(text, end):
            return stem
    return None


@functools.cache
def _endings(after: str) -> re.Pattern[str]:
    return re.compile(fnmatch.translate(after))


def _files_in(folder: Path) -> list[Path]:
    """Return the files of a folder that are not hidden; none of one that cannot be read, whose files are missing."""
    try:
        return [_normal(Path(one.path)) for one in os.scandir(folder) if one.is_file() and not one.name.startswith(".")]
    except OSError:
        return []


def _normal(path: Path) -> Path:
    return Path(os.path.normpath(path))
