"""Files of masks of single objects: which of them a frame has, and streams that are made of nothing else."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path

from dloftbs.camera import PinholeCamera
from dloftbs.data.instance_labels import Labels, Size, as_labels, check_kind, paint
from dloftbs.errors import InputError, SourceError, source_errors
from dloftbs.sources.annotations import ANNOTATION_SUFFIXES, read_annotations, read_coco
from dloftbs.sources.image_files import IMAGE_EXTENSIONS, check_place, list_files
from dloftbs.sources.naming_rules import STEM, is_pattern, is_rule, is_union, partner_of, partners_of, stem_under
from dloftbs.sources.picture_stream import PictureStream
from dloftbs.sources.pixel_values import read_labels, read_mask
from dloftbs.sources.pixels import Picture, load_npy
from dloftbs.sources.source import logger
from dloftbs.support.arrays import AnyArray

Read = Callable[[Size | None], Labels]
"""Reader of the label image of a frame, whose size is given where it is known."""

_NUMBER = re.compile(r"(?P<name>.*?)(?P<number>[0-9]{1,18})")
"""Stem of a numbered frame."""


def holds_objects(where: str) -> bool:
    """Return whether a rule or a path names files that only a reader of objects understands."""
    return is_pattern(where) or Path(where).suffix.lower() in ANNOTATION_SUFFIXES


def object_reads(where: str, beside: Sequence[Path] | None) -> list[Read]:
    """Return what reads the label image of each frame.

    Parameters
    ----------
    where : str
        A naming rule, or a file of annotations: COCO's for all frames, or any of one frame.
    beside : sequence of Path or None
        Files of the frames; None where the source is something else.

    Raises
    ------
    InputError
        If frames that are not in files of their own are to be known by their names.
    SourceError
        If a file for all frames cannot be read, or has none of them.
    """
    if is_rule(where):
        if beside is None:
            raise InputError(f"the naming rule {where!r} needs frames in files of their own")
        frames = {Path(os.path.normpath(path)) for path in beside} if is_pattern(where) else ()
        groups = partners_of(beside, where)
        if len(beside) > 1 and not any(file.exists() for files in groups for file in files):
            raise SourceError(
                f"instances: no frame has a file by the rule {where!r}, such as {str(partner_of(beside[0], where))!r}; "
                "a rule starts from the folder of the frames"
            )
        return [partial(_read, [file for file in files if file not in frames], where) for files in groups]
    path = Path(os.path.expanduser(where))
    check_place(path, f"instances: there is no file {where!r}, and it is no naming rule with {STEM}")
    coco = read_coco(path) if path.suffix.lower() == ".json" else None
    if coco is None:
        return [partial(read_objects, path)]
    if beside is None and coco.count == 1:
        return [partial(coco.read, None)]
    if beside is None:
        raise InputError(f"{where!r} knows frames by their names, and needs them in files of their own")
    coco.check_names(beside)
    return [partial(coco.read, frame) for frame in beside]


def _read(files: Sequence[Path], rule: str, size: Size | None) -> Labels:
    """Return the label image of a frame from the files that go with it."""
    if is_pattern(rule):
        if not files:
            raise SourceError(f"there is no file by the rule {rule!r}")
        with source_errors(f"{files[0].name}, ...", InputError):
            return paint(map(_read_object, files), size)
    return read_objects(files[0], size)


def _read_object(path: Path) -> AnyArray:
    """Return the mask (H, W) of one object."""
    with source_errors(path, InputError):
        return check_kind("the mask of an object", read_mask(path))


def read_objects(path: Path, size: Size | None) -> Labels:
    """Return the label image (H, W) of a frame from one file: a label image, .npy, also of a stack, or annotations.

    Raises
    ------
    SourceError
        If the file cannot be read, or holds something else.
    """
    if path.suffix.lower() in ANNOTATION_SUFFIXES:
        return read_annotations(path, size)
    with source_errors(path, InputError):
        return as_labels(load_npy(path) if path.suffix.lower() == ".npy" else read_labels(path), size)


class ObjectFileSource(PictureStream):
    """Frames that have no pictures, only files of their objects.

    Parameters
    ----------
    groups : dict of str to sequence of Path
        Files of each frame by its stem, in the order of the stream.
    rule : str
        That named them.
    name : str
    mask_is, camera, fps
        As `FileSource` has them.

    Attributes
    ----------
    paths : tuple of Path
        Pictures as they would be, for other naming rules.
    """

    def __init__(
        self,
        groups: dict[str, list[Path]],
        rule: str,
        name: str,
        *,
        mask_is: str = "auto",
        camera: PinholeCamera | None = None,
        fps: float | None = None,
    ) -> None:
        super().__init__(name, list(groups), mask_is=mask_is, camera=camera, fps=fps)
        self.paths = tuple(files[0].with_name(f"{stem}.png") for stem, files in groups.items())
        self._groups = tuple(groups.values())
        self._rule = rule

    def _pictures(self) -> Iterator[Picture | SourceError]:
        return map(self._picture, self._groups)

    def _picture(self, files: Sequence[Path]) -> Picture | SourceError:
        try:
            return Picture(None, None, instances=_read(files, self._rule, None))
        except SourceError as error:
            return error


def group_by_frame(where: str, rule: str, rules: Sequence[str]) -> dict[str, list[Path]] | None:
    """Return the files of each frame by its stem, where there are no pictures beside them; None where there are.

    Parameters
    ----------
    where : str
        Folder or glob.
    rule : str
        Naming rule of the objects.
    rules : sequence of str
        All naming rules.

    Raises
    ------
    SourceError
        If there is no file at all, or the folder cannot be read.
    """
    suffix = Path(rule).suffix.lower()
    files = list_files(where, (*IMAGE_EXTENSIONS, suffix))
    groups: dict[str, list[Path]] = {}
    for path in files:
        stem = stem_under(path, rule)
        if stem is not None and is_pattern(rule) and is_union(path):
            continue
        if stem is not None:
            groups.setdefault(stem, []).append(path)
        elif path.suffix.lower() in IMAGE_EXTENSIONS and all(stem_under(path, one) is None for one in rules):
            return None
    _warn_of_gaps(where, list(groups))
    return groups or None


def _warn_of_gaps(where: str, stems: Sequence[str]) -> None:
    """Report stems whose numbers leave some out: frames in which nothing was found may have no file.

    All steps from number to number are then multiples of the smallest, which times as names are not.
    """
    numbers: dict[str, list[tuple[int, str]]] = {}
    for stem in stems:
        found = _NUMBER.fullmatch(stem)
        if found is not None:
            numbers.setdefault(found["name"], []).append((int(found["number"]), stem))
    for named in numbers.values():
        named.sort()
        steps = [after - before for (before, _), (after, _) in pairwise(named)]
        least = min(steps, default=0)
        if least < 1 or max(steps) == least or any(step % least for step in steps):
            continue
        at = next(place for place, step in enumerate(steps) if step > least)
        logger.warning(
            "%s: %d numbers have no file, such as between %s and %s; the frames behind them move up, in their indices "
            "and stamps. If these are frames without an object, save a mask of zeros for each",
            where,
            (named[-1][0] - named[0][0]) // least + 1 - len(named),
            named[at][1],
            named[at + 1][1],
        )
