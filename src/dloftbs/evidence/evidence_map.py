"""Evidence of a frame at the ends of cables: whether two are one cable's, and what lies between them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera
from dloftbs.config import DepthConfig
from dloftbs.data.depth import unit_of
from dloftbs.data.frame import Frame
from dloftbs.data.graph import POSITION, TANGENT, Graph
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.evidence.kernels.colour_differences import compare_pairs
from dloftbs.evidence.kernels.end_labels import label_ends
from dloftbs.evidence.kernels.end_references import sample_cables, sample_references
from dloftbs.evidence.kernels.gap_depths import describe_depths, measure_swerves, sample_depths
from dloftbs.evidence.kernels.gap_pixels import describe_pixels, lay_ways, list_uncovered, mark_covered, mark_probable
from dloftbs.support.arrays import AnyArray, BoolArray, ByteArray, FloatArray, IntArray, as_bytes
from dloftbs.support.values import MILLIMETRE_M


@dataclass(frozen=True, eq=False)
class EvidenceMap:
    """Evidence of a frame beside its mask, asked about gaps: occluders, a probability, depth, the image.

    Occluders hide what they cover, and say nothing of other places, where something else may hide a cable. What is
    somewhat probable is seen as cable, and what is not says nothing: a network is sure of the ground as well where
    something hides a cable. Depth and the image say of all other places how much they look like ground in sight.

    Parameters
    ----------
    crop : MaskCrop
    image : numpy.ndarray, shape (H, W, 3), uint8, optional
        BGR.
    depth : numpy.ndarray, shape (H, W), optional
        See `Frame`.
    occluders : numpy.ndarray, shape (H, W), bool or any integer type, optional
        See `Frame`.
    camera : PinholeCamera, optional
        Without one, depth does not show how steep a cable is, and a hidden one is taken not to sag.
    config : DepthConfig, optional
        Range of the depth.
    depth_unit_m : float
        See `Frame`.
    soft : numpy.ndarray, shape (H, W), uint8, optional
        The probability, of 256, that the mask was made of.
    labels : numpy.ndarray, shape (H, W), uint16, optional
        Single objects, as `Frame.instances` has them.
    """

    crop: MaskCrop
    image: ByteArray | None = None
    depth: npt.NDArray[Any] | None = None
    occluders: AnyArray | None = None
    camera: PinholeCamera | None = None
    config: DepthConfig = field(default_factory=DepthConfig)
    depth_unit_m: float = MILLIMETRE_M
    soft: ByteArray | None = None
    labels: npt.NDArray[np.uint16] | None = None

    @classmethod
    def of(
        cls,
        frame: Frame,
        crop: MaskCrop,
        config: DepthConfig,
        soft: ByteArray | None = None,
        labels: npt.NDArray[np.uint16] | None = None,
    ) -> EvidenceMap | None:
        """Return the evidence in a frame, and in the probability and the labels of its mask; None if there is none."""
        if all(given is None for given in (frame.image, frame.depth, frame.occluders, soft, labels)):
            return None
        return cls(
            crop, frame.image, frame.depth, frame.occluders, frame.camera, config, frame.depth_unit_m, soft, labels
        )

    def at(self, graph: Graph) -> EndEvidence:
        """Return the evidence at the ends of the branches of a graph."""
        return EndEvidence(self, graph)


@dataclass(frozen=True, eq=False)
class EndEvidence:
    """Evidence of a frame at the ends of branches.

    Parameters
    ----------
    frame : EvidenceMap
    graph : Graph
    """

    frame: EvidenceMap
    graph: Graph

    @property
    def width(self) -> float:
        """Of the cables, px."""
        return self.graph.width

    @property
    def tells_swerves(self) -> bool:
        """True if there is depth, and a camera that shows how steep it is."""
        return self.frame.depth is not None and self.frame.camera is not None

    @property
    def knows_covers(self) -> bool:
        """True if occluders are given, or a probability: a gap may be covered, or seen as cable."""
        return self.frame.occluders is not None or self.frame.soft is not None

    @property
    def has_labels(self) -> bool:
        """True if single objects are labelled."""
        return self.frame.labels is not None

    def swerves(self, pairs: IntArray, lengths: FloatArray) -> FloatArray:
        """Return how unlikely a cable is from end to end, by its swerve towards the camera or away from it.

        Parameters
        ----------
        pairs : numpy.ndarray, shape (k, 2)
            Ends.
        lengths : numpy.ndarray, shape (k,)
            Of the way from one to the other, px.

        Returns
        -------
        numpy.ndarray, shape (k,)
            Minus the logarithm of a density over its peak, nats; 0 where depth shows nothing.
        """
        assert self.frame.camera is not None  # see tells_swerves
        return measure_swerves(self._depths, pairs, lengths, self.frame.camera.fx, self.width)

    def swerves_into(
        self, ends: list[int], span: tuple[int, int], at_start: bool, lengths: FloatArray
    ) -> FloatArray | None:
        """Return how unlikely cables are, as `swerves` does, that go on along some points of the graph.

        Parameters
        ----------
        ends : list of int
            Where they come from.
        span : (int, int)
            The points where one of them goes on.
        at_start : bool
            True if the first one of these is nearest to the ends, not the last one.
        lengths : numpy.ndarray, shape (k,)
            Of the ways there, px.

        Returns
        -------
        numpy.ndarray, shape (k,), or None
            nats; None where the points are too few to show how they go on.
        """
        assert self.frame.camera is not None  # see tells_swerves
        no_edge = np.zeros(2, dtype=np.bool_)
        ahead = sample_depths(*self._asked, self._points, np.array([span]), no_edge, self.width)[[0 if at_start else 1]]
        if np.isnan(ahead[0, 2]):
            return None
        known, count = np.concatenate((self._depths[ends], ahead)), len(ends)
        pairs = np.column_stack((np.arange(count), np.full(count, count)))
        return measure_swerves(known, pairs, lengths, self.frame.camera.fx, self.width)

    @property
    def has_depth(self) -> BoolArray:
        """True for each end where depth shows how it goes on."""
        known: BoolArray = ~np.isnan(self._depths[:, 2])
        return known

    @property
    def tells_colours(self) -> bool:
        """True if there is an image."""
        return self.frame.image is not None

    @property
    def tells_steps(self) -> bool:
        """True if a step of a cable in depth or in colour would show."""
        return self.tells_swerves or self.tells_colours

    def differ_in_colour(self, pairs: IntArray) -> BoolArray:
        """Return True for pairs of ends (k, 2) whose cables differ clearly in colour, all along before them."""
        if self.frame.image is None or len(pairs) == 0:
            return np.zeros(len(pairs), dtype=np.bool_)
        return compare_pairs(*self._colours, pairs)

    def differ_along(self, ends: list[int], span: tuple[int, int], at_start: bool) -> BoolArray:
        """Return True for ends whose cables differ clearly in colour from the one along some points of the graph.

        Parameters
        ----------
        ends : list of int
        span : (int, int)
            The first of the points, and the one behind the last.
        at_start : bool
            True if the first one of these is nearest to the ends, not the last one.
        """
        colours, samples, offsets = self._colours
        ahead, more, count = self._sample_colours(np.array([span]), np.array([0 if at_start else 1]))
        known = (
            np.concatenate((colours, ahead)),
            np.concatenate((samples, more)),
            np.append(offsets, len(samples) + count[1]),
        )
        return compare_pairs(*known, np.column_stack((ends, np.full(len(ends), len(colours)))))

    @property
    def has_colour(self) -> BoolArray:
        """True for each end before which the image shows a cable's colour."""
        known: BoolArray = ~np.isnan(self._colours[0][:, 0])
        return known

    def instance_signs(self, pairs: IntArray) -> FloatArray:
        """Return 1 for pairs of ends (k, 2) of one labelled object, -1 for those of two, 0 where that is unknown."""
        one, other = self._labels[pairs].T
        signs: FloatArray = np.where(one == other, 1.0, -1.0) * ((one > 0) & (other > 0))
        return signs

    def across(self, pairs: IntArray, lengths: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return what lies between pairs of ends.

        Parameters
        ----------
        pairs : numpy.ndarray, shape (k, 2)
        lengths : numpy.ndarray, shape (k,)
            How far the ends of each pair are apart, px.

        Returns
        -------
        hidden : numpy.ndarray, shape (k,)
            Share of each way that occluders cover, or that is somewhat probable.
        pixels : numpy.ndarray, shape (k, 3)
            What the image shows of the rest, as `describe_pixels` returns it; 0 without an image.
        depths : numpy.ndarray, shape (k, 2)
            What depth shows of it, as `describe_depths` returns it; 0 without depth.
        """
        pixels: FloatArray = np.zeros((len(pairs), 3))
        depths: FloatArray = np.zeros((len(pairs), 2))
        if len(pairs) == 0:
            return np.zeros(0), pixels, depths
        frame, width = self.frame, self.width
        ways, steps = lay_ways(self._states, pairs, width)
        covered: ByteArray = np.zeros((len(pairs), ways.shape[1]), dtype=np.uint8)
        if frame.occluders is not None:
            occluders = as_bytes(frame.occluders.reshape(frame.occluders.shape[:2])[self._window])
            mark_covered(occluders, ways, steps, covered)
        if frame.soft is not None:
            mark_probable(frame.soft[self._window], self._mask, ways, steps, width, covered)
        if frame.depth is not None:
            focal = math.inf if frame.camera is None else frame.camera.fx
            of_ways = pairs, ways, steps, lengths
            depths = describe_depths(*self._asked, self._depths, *of_ways, focal, width, covered)
        if frame.image is not None:
            asked, ends, numbers = list_uncovered(self._mask, pairs, len(self._states), ways, steps, covered, width)
            if len(asked):
                image = frame.image[self._window]
                colours = sample_references(image, self._mask, self._points, self.graph.spans, ends, width)
                seen = image, self._mask, numbers, asked, ways, steps
                pixels[asked] = describe_pixels(*seen, *colours, width, covered)
        return covered.sum(axis=1) / (steps - 1), pixels, depths

    @cached_property
    def _labels(self) -> IntArray:
        """Label before each end, shape (2 n,); 0 where none is seen."""
        assert self.frame.labels is not None
        return label_ends(self.frame.labels[self._window], self._points, self.graph.spans, self.width)

    @cached_property
    def _colours(self) -> tuple[FloatArray, FloatArray, IntArray]:
        """Colours before all ends, as `sample_cables` returns them."""
        return self._sample_colours(self.graph.spans, np.arange(len(self.graph.nodes)))

    def _sample_colours(self, spans: IntArray, ends: IntArray) -> tuple[FloatArray, FloatArray, IntArray]:
        assert self.frame.image is not None  # see tells_colours
        return sample_cables(self.frame.image[self._window], self._points, spans, ends, self.width)

    @cached_property
    def _depths(self) -> FloatArray:
        """Depth at each end, as `sample_depths` returns it."""
        free = self.graph.nodes < 0
        return sample_depths(*self._asked, self._points, self.graph.spans, free, self.width)

    @cached_property
    def _points(self) -> FloatArray:
        """Points (m, 2) of all runs, in the pixels of the crop."""
        return self._in_crop(self.graph.points)

    @cached_property
    def _states(self) -> FloatArray:
        """Position and outward tangent (2 n, 4) of each end, in the pixels of the crop."""
        states = self.graph.end_states
        found: FloatArray = np.empty((len(states), 4))
        found[:, :2] = self._in_crop(states[:, POSITION])
        found[:, 2:] = states[:, TANGENT] @ self.frame.crop.image_transform[0].T
        return found

    def _in_crop(self, points: FloatArray) -> FloatArray:
        matrix, offset = self.frame.crop.image_transform
        return points @ matrix.T + (offset - np.array(self.frame.crop.origin, dtype=np.float64))

    @cached_property
    def _asked(self) -> tuple[npt.NDArray[Any], float, float, float, ByteArray]:
        """The depth around the mask, its unit and range, and the mask."""
        depth, config = self.frame.depth, self.frame.config
        assert depth is not None
        counts = depth[self._window]
        if counts.dtype != np.uint16:  # which the kernels read as it is: no whole image is converted for a few places
            with np.errstate(over="ignore"):  # what float32 cannot hold is infinity, missing
                counts = counts.astype(np.float32, copy=False)
        return counts, unit_of(depth, self.frame.depth_unit_m), *config.range_m, self._mask

    @property
    def _window(self) -> tuple[slice, slice]:
        (h, w), (x0, y0) = self.frame.crop.size, self.frame.crop.origin
        return np.s_[y0 : y0 + h, x0 : x0 + w]

    @property
    def _mask(self) -> ByteArray:
        h, w = self.frame.crop.size
        return self.frame.crop.pixels[1 : h + 1, 1 : w + 1]
