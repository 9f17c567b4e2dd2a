"""Scores of frames and of sequences, and the files in which finished sequences wait to be used again."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from dloftbs import _version
from dloftbs.data.centerline import JointKind
from dloftbs.errors import InputError
from dloftbs.support.documents import parse_json
from dloftbs.support.json_text import encode
from dloftbs.support.safe_files import write_whole
from dloftbs_lab.evaluation.identity_scores import TrackingScores

_SHOWS = ("cli/", "commands/", "sinks/", "viz/", "evaluation/report/", "evaluation/paper_figures")
_LAB = str(Path(__file__).parents[2])

Points = list[tuple[float, float]]
"""A curve in a file: ``(x, y)`` px in order."""


@dataclass(frozen=True)
class FrameRow:
    """Scores of one method on one frame; a score without a value is None.

    Parameters
    ----------
    suite, sequence : str
    index : int
        Of the frame in its sequence.
    method : str
    n_true, n_found : int
        Objects.
    l1_px, l2_px : float or None
        Criteria 1 and 2, between the visible pixels of all objects and all curves; None where one of both is empty.
    l3_px : float or None
        Mean criterion 3 of the matched, whichever end came first, from the whole true curve or its visible extent.
    l3_whole_px : float or None
        The same from the whole true curve in every case, hidden ends included: the paper's criterion to the letter.
    l3_mm : float or None
        The same in space, of those that are known there.
    length_error : float or None
        Mean distance of their lengths in space from the true ones, as a share of these.
    dice : float or None
        Of the label images, where the truth has nothing else.
    missing, redundant : int
    right : int
        Objects whose curve is within the limit of a clean frame.
    clean : bool
        Whether every object is right, and there is nothing else.
    ms : float
        Milliseconds of the method's call alone.
    failure : str or None
        Error of the method, or fault of its result; then all objects are missing.
    l1_mm, l2_mm : float or None
        Criteria 1 and 2 in space, between the mask's pixels that have depth and all curves that are known there.
    l3_surface_mm : float or None
        As `l3_mm`, but from the line on the surface that faces the camera, where the objects' radius is known.
    scene : str
        Scene that the frame shows. Frames of one scene are no independent sample: a sequence is one, under whatever
        noise; of single images each is one.
    sure, sure_wrong : int
        Curves with a confidence of at least `frame_scores.SURE`, and those of them that are not right; 0 where a method
        gives no confidence.
    nodes_true, nodes_found, nodes_right : int
        Branch points; 0 where no true curves meet.
    branches_right : int
        Curves that are right, with branch points that are right at both ends.
    whole : bool
        Whether all branches and branch points are right, and there is nothing else.
    """

    suite: str
    sequence: str
    index: int
    method: str
    n_true: int
    n_found: int
    l1_px: float | None
    l2_px: float | None
    l3_px: float | None
    l3_whole_px: float | None
    l3_mm: float | None
    length_error: float | None
    dice: float | None
    missing: int
    redundant: int
    right: int
    clean: bool
    ms: float
    failure: str | None
    l1_mm: float | None = None
    l2_mm: float | None = None
    l3_surface_mm: float | None = None
    scene: str = ""
    sure: int = 0
    sure_wrong: int = 0
    nodes_true: int = 0
    nodes_found: int = 0
    nodes_right: int = 0
    branches_right: int = 0
    whole: bool = False

    @property
    def badness(self) -> tuple[int, float, int]:
        """By this the worst frames are chosen: more objects missing, wrong or too many, then more error, then index."""
        without_l3 = math.inf if self.dice is None else 1.0 - self.dice
        error = without_l3 if self.l3_px is None else self.l3_px
        return self.missing + self.n_found - self.right, error, -self.index


@dataclass(frozen=True)
class JointRow:
    """One joint of what a method found.

    Parameters
    ----------
    index : int
        Of the frame in its sequence.
    kind : JointKind
    confidence : float
        Confidence that the method gives it, in 0..1.
    right : bool
        Whether it joins parts of one piece of one true curve.
    scene : str
        As of the frame.
    """

    index: int
    kind: JointKind
    confidence: float
    right: bool
    scene: str = ""


@dataclass(frozen=True)
class TrackRow:
    """Scores of one object's track in one frame; every L3 is in px, undirected, and from the whole true curve.

    Parameters
    ----------
    index : int
        Of the frame in its sequence.
    object : int
        Its id in the truth.
    shown : float
        The share of its length that the mask shows.
    track : int or None
        The track that it was given; while nothing of it shows, the one that it had last, if that is published.
    seen : bool
        Whether that track was seen in this frame.
    track_px : float or None
        L3 of that track's curve; where the object was given none, of the curve nearest to it; None without curves.
    shown_px, hidden_px : float or None
        The part of it over what the mask shows, and over what it does not; None where there is no such part.
    alone_px : float or None
        L3 of the nearest curve that the method finds in the frame without those before; None where it finds none.
    nearest_px : float or None
        L3 of the nearest curve of all tracks; None without tracks.
    """

    index: int
    object: int
    shown: float
    track: int | None
    seen: bool
    track_px: float | None
    shown_px: float | None
    hidden_px: float | None
    alone_px: float | None
    nearest_px: float | None = None


@dataclass(frozen=True)
class Following:
    """Scores of the tracks of a sequence, hidden tracks and hidden objects included.

    Parameters
    ----------
    family : str
        Kind of motion in the sequence.
    cables : int
        Number of objects.
    scores : TrackingScores
        Of all published tracks. While nothing of an object shows, neither it nor the track that it had last counts.
    rows : tuple of TrackRow
        By frame, then by object.
    points : int
        Points of all published curves, a pixel apart.
    ghosts : int
        Those of them that lie more than a cable's width from anything in the mask.
    missed : int
        Objects of which something shows, by frame, without a track in the assignment by mean distance.
    shown : int
        Objects of which something shows, by frame.
    """

    family: str
    cables: int
    scores: TrackingScores
    rows: tuple[TrackRow, ...]
    points: int = 0
    ghosts: int = 0
    missed: int = 0
    shown: int = 0


@dataclass(frozen=True)
class Key:
    """Inputs that the scores of a sequence depend on; scores are used again only where all of them are equal.

    Parameters
    ----------
    suite, sequence, method : str
    number : int
        Of the sequence in its suite.
    frames : int
    settings : str
        Of the suite: scale, seed, size.
    method_settings : str
    code : str
        Version of this package and a digest of its code.
    """

    suite: str
    sequence: str
    method: str
    number: int
    frames: int
    settings: str
    method_settings: str
    code: str

    @property
    def file_name(self) -> str:
        """A name for its file, different from that of any other key."""
        text = "-".join((self.suite, f"{self.number:03d}", self.method))
        return f"{re.sub(r'[^A-Za-z0-9.]+', '-', text)[-80:]}-{_digest(encode(self))}.json"


@dataclass(frozen=True)
class Part:
    """Scores of one method on one sequence.

    Parameters
    ----------
    key : Key
    rows : tuple of FrameRow
        One for each frame, in order.
    tracking : TrackingScores or None
        Scores of identities, where the method gives any and the truth is a sequence.
    worst : mapping of int to curves
        Results of the worst frames, by index.
    joints : tuple of JointRow
        Of all frames, where the method has any and the true curves are known.
    ladder : str or None
        Ladder of growing noise of which the sequence is a rung.
    level : float or None
        Its height on the ladder.
    following : Following or None
        Scores of the tracks, where the sequence is made for them and the method gives identities.
    """

    key: Key
    rows: tuple[FrameRow, ...]
    tracking: TrackingScores | None = None
    worst: Mapping[int, list[Points]] = field(default_factory=dict)
    joints: tuple[JointRow, ...] = ()
    ladder: str | None = None
    level: float | None = None
    following: Following | None = None

    @property
    def scene(self) -> str:
        """The scene of the first frame, which is that of all of them where the sequence is no single images."""
        return self.rows[0].scene if self.rows else ""


def load(folder: Path, key: Key) -> Part | None:
    """Return the finished part with this key, or None if there is none that can be read."""
    try:
        part: Part = parse_json((folder / key.file_name).read_bytes(), Part)
    except (OSError, InputError):
        return None
    return part if part.key == key else None


def save(folder: Path, part: Part) -> None:
    """Write a part; the file is whole or not there, whatever ends the process.

    Raises
    ------
    SinkError
        If it cannot be written.
    """
    write_whole(folder / part.key.file_name, encode(part))


def code_version() -> str:
    """Return the version of all that makes scores: what merely shows them is left out."""
    return _version.code_version(_SHOWS, _LAB)


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:12]
