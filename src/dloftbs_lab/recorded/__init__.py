"""Sequences with truth from disk, in the layouts that the field publishes: a module here for each."""

from __future__ import annotations

import os
from pathlib import Path

from dloftbs.errors import InputError, SourceError
from dloftbs.support.values import check_path, shown
from dloftbs_lab.known_sequence import KnownSequence
from dloftbs_lab.recorded import ariadne, label_images, mbest, polylines, spline_tables, written
from dloftbs_lab.recorded.layout import Layout, content_of, folders_in, listed

__all__ = ["LAYOUTS", "looks_labelled", "open_labelled"]

LAYOUTS: dict[str, Layout] = {
    module.LAYOUT.name: module.LAYOUT for module in (written, label_images, mbest, ariadne, spline_tables, polylines)
}
"""By name, in the order in which "auto" tries them."""


def open_labelled(folder: str | os.PathLike[str], layout: str = "auto") -> KnownSequence:
    """Open a sequence whose truth lies on disk.

    Frames are read when they are asked for, in any order. What cannot be read is then a `SourceError`, not a hole:
    a frame that is measured against must be there.

    Parameters
    ----------
    folder : str or path
    layout : {"auto", "written", "labels", "mbest", "ariadne", "spline tables", "polylines"}
        "written" is what `dloftbs_lab.write_sequence` leaves; "labels" has ``NN.jpg`` with ``NN.labels.png``, whose
        pixels are the objects' numbers, and the mask where there is no ``NN.mask.png``, and knows no curves; "mbest" is
        the same, segmented by the colours of mBEST's cables; "ariadne" has photographs, masks and coarse points as
        Ariadne's data set; "spline tables" has a CSV file of points per frame, as the authors of DLOFTBs write it or
        plain, beside a video or images; "polylines" has ``STEM.json`` or ``STEM.csv`` with points beside each image or
        mask. "auto" is the first that the folder looks like. A wrong folder gets an error that draws the right ones.

    Returns
    -------
    KnownSequence
        Named as the folder, or as what was written. Where points are given, the curves are cubic splines through them.
        In all but "written", whose frames have what they had, camera.json or camera.yaml gives the camera, in any
        form that `PinholeCamera.from_file` takes, STEM.depth.png (16 bits) or STEM.depth.npy beside an image its
        depth, and STEM.occluders.png what may hide cables in it.

    Raises
    ------
    InputError
        If there is no such layout.
    SourceError
        If the folder is of no layout, or not of this one, or what belongs together is not all there.
    """
    tried = _candidates(layout)
    path = Path(os.path.expanduser(check_path("folder", folder)))
    if not os.path.isdir(path):
        raise SourceError(f"there is no folder {str(path)!r}; a labelled sequence is a folder")
    for candidate in tried:
        if candidate.fits(path):
            return candidate.open(path)
    raise SourceError(_wrong(path, tried))


def looks_labelled(folder: Path, layout: str = "auto") -> bool:
    """Return whether a folder looks like a labelled sequence, at a glance, whole or not.

    Raises
    ------
    InputError
        If there is no such layout.
    """
    return any(candidate.fits(folder) for candidate in _candidates(layout))


def _candidates(layout: str) -> list[Layout]:
    if not isinstance(layout, str) or layout not in ("auto", *LAYOUTS):
        raise InputError(f"layout must be one of auto, {', '.join(LAYOUTS)}, got {shown(layout)}")
    return list(LAYOUTS.values()) if layout == "auto" else [LAYOUTS[layout]]


def _wrong(folder: Path, tried: list[Layout]) -> str:
    inside = [place.name for place in folders_in(folder) if any(layout.fits(place) for layout in LAYOUTS.values())]
    hint = f"\nFolders in it that look right, to be opened one by one: {listed(inside)}." if inside else ""
    others = [layout.name for layout in LAYOUTS.values() if layout not in tried and layout.fits(folder)]
    hint += f"\nIt looks like the layout {' or '.join(others)}." if others else ""
    trees = "\n\n".join(layout.tree for layout in tried)
    names = " or ".join(layout.name for layout in tried)
    what = f"{folder}: no labelled sequence. Looked for: {names}; found {content_of(folder)}."
    return f"{what}{hint}\n\nRight are:\n\n{trees}"
