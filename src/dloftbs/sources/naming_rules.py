"""Naming rules, and folders of partners: which files go with a colour file, by its stem.

A rule such as ``"{stem}_depth.png"`` names one file. One with wildcards in its file name, such as
``"{stem}_mask_*.png"``, names a file per object. Where a name could belong to two stems, it is that of the longer one.
"""

from __future__ import annotations

import fnmatch
import functools
import math
import os
import re
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path

from dloftbs.sources.image_files import natural_key
from dloftbs.sources.source import logger
from dloftbs.support.values import count_of

STEM = "{stem}"
_WILDCARDS = re.compile(r"[*?\[]")
_UNION = re.compile(r".*[_.-]all", re.IGNORECASE)
_LAST_NUMBER = re.compile(r".*?(?P<number>[0-9]+)[^0-9]*")


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


def partners_in_folder(paths: Sequence[Path], files: Sequence[Path], where: str) -> Sequence[Path | None]:
    """Return the file of a folder that goes with each colour file, None where that is missing.

    Files go by name where most of the stems agree, and by order elsewhere: also where both are numbered alike, but from
    another start or in other steps. Stems that are there twice distinguish nothing. Order is reported where the numbers
    in the names differ, and so are files that are left out by name.

    Parameters
    ----------
    paths, files : sequence of Path
        Of the frames and of the folder, in natural order.
    where : str
        The folder, for messages.
    """
    stems, others = [path.stem for path in paths], {file.stem: file for file in files}
    shared = others.keys() & stems
    numbers, their_numbers = _numbers(stems), _numbers([file.stem for file in files])
    are_unique = len(set(stems)) == len(paths) and len(others) == len(files)
    if are_unique and 2 * len(shared) > min(len(paths), len(files)) and not _are_renumbered(numbers, their_numbers):
        left_out = [file.name for file in files if file.stem not in shared]
        if left_out:
            count = count_of(len(left_out), "file")
            logger.warning("%s: left out %s, such as %s: no frame has the name", where, count, left_out[0])
        return [others.get(stem) for stem in stems]
    if numbers and their_numbers and len(paths) == len(files) and numbers != their_numbers:
        at = next(i for i, both in enumerate(zip(numbers, their_numbers, strict=True)) if both[0] != both[1])
        logger.warning(
            "%s: its files go with the frames by their order, since the numbers in the names differ: %s goes with %s",
            where,
            files[at].name,
            paths[at].name,
        )
    return files


def _numbers(stems: Sequence[str]) -> list[int]:
    """Return the last number of each stem; none where one lacks it, or all have the same."""
    found = [_LAST_NUMBER.fullmatch(stem) for stem in stems]
    numbers = [int(match["number"]) for match in found if match is not None]
    return numbers if len(numbers) == len(stems) and len({*numbers}) == len(stems) else []


def _are_renumbered(numbers: Sequence[int], others: Sequence[int]) -> bool:
    """Return whether two series of numbers leave out the same places, but begin elsewhere or have other steps."""
    if min(len(numbers), len(others)) < 2:
        return False
    steps = [math.gcd(*(after - before for before, after in pairwise(series))) for series in (numbers, others)]
    places = [
        [(one - series[0]) // step for one in series] for series, step in zip((numbers, others), steps, strict=True)
    ]
    is_same = (numbers[0], steps[0]) == (others[0], steps[1])
    return not is_same and all(one == other for one, other in zip(*places, strict=False))


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
