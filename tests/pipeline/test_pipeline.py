"""The whole way from frames to curves."""

from __future__ import annotations

import threading
from dataclasses import replace

import cv2
import numpy as np
import pytest
from drawings import EIGHT_VERSIONS, draw_cable, random_masks, turn, turn_points_back, wave
from hypothesis import given
from scipy.spatial import cKDTree

import dloftbs
from dloftbs import Config, Frame, FrameResult, HsvRange, InputError, Pipeline, detect
from dloftbs.config import SegmentationConfig

PAPER = Config.paper()
DEFAULT = Config()
DEFAULT_EVERYTHING = DEFAULT.replace({"cleaning.open_px": 1})
EVERYTHING = PAPER.replace({"cleaning.open_px": 1, "linking.min_length_px": 2})
SIZE = (240, 400)


def ring(size: int = 120) -> np.ndarray:
    return cv2.circle(np.zeros((size, size), np.uint8), (size // 2, size // 2), size // 3, 1, 7)


def scene(seed: int) -> np.ndarray:
    """Two cables that cross, one with a gap, and a ring."""
    rng = np.random.default_rng(seed)
    mask = draw_cable(wave(SIZE, 1.0, rng.uniform(0, 6)), 7, SIZE)
    mask[:, 180:200] = 0
    mask |= draw_cable(rng.uniform((30, 20), (370, 220), (2, 2)), 9, SIZE)
    cv2.circle(mask, (330, 60), 25, 1, 5)
    return mask


class TestDetect:
    def test_a_cable_is_found_where_it_lies(self) -> None:
        points = wave(SIZE)
        mask = draw_cable(points, 9, SIZE)
        (detection,) = dloftbs.detect(mask)
        dense = np.stack([np.interp(np.linspace(0, 199, 4000), np.arange(200), axis) for axis in points.T], axis=1)
        distance, _ = cKDTree(dense).query(detection.curve.sample(300))
        assert distance.max() < 1.5
        assert distance.mean() < 0.5
        assert detection.curve.length == pytest.approx(np.linalg.norm(np.diff(points, axis=0), axis=1).sum(), rel=0.03)
        assert detection.width_px == pytest.approx(mask.sum() / detection.curve.length, rel=0.1)
        assert detection.confidence == detection.centerline.course_confidence > 0.999
        assert detection.curve_3d is None
        assert detection.no_3d_reason == "the frame has no depth"

    def test_the_mask_is_never_changed(self) -> None:
        mask = scene(0)
        mask.flags.writeable = False
        before = mask.copy()
        dloftbs.detect(mask)
        np.testing.assert_array_equal(mask, before)
        writeable = before.copy()
        dloftbs.detect(writeable)
        np.testing.assert_array_equal(writeable, mask)
        assert writeable.flags.writeable

    @pytest.mark.parametrize("dtype", [bool, np.uint8, np.int8, np.uint16, np.int32, np.uint64])
    def test_every_integer_type_and_layout_gives_the_same_curves(self, dtype: type) -> None:
        expected = dloftbs.detect(scene(1))
        for mask in (
            scene(1).astype(dtype),
            scene(1).astype(dtype)[:, :, None],
            np.asfortranarray(scene(1).astype(dtype)),
        ):
            assert [d.curve for d in dloftbs.detect(mask)] == [d.curve for d in expected]

    def test_a_ring_is_one_closed_curve(self) -> None:
        (detection,) = dloftbs.detect(ring())
        assert detection.curve.closed
        assert np.abs(np.linalg.norm(detection.curve.sample(200) - 60, axis=1) - 40).max() < 1.5

    def test_the_same_input_gives_the_same_bits(self) -> None:
        first, second = (dloftbs.detect(scene(2)) for _ in range(2))
        assert [d.curve for d in first] == [d.curve for d in second]
        assert [d.joints for d in first] == [d.joints for d in second]

    @pytest.mark.parametrize(
        "bad", [np.full((4, 4), 1.5), np.zeros((4, 4), complex), np.zeros((4, 4, 1, 3), np.uint8), [1, 2]]
    )
    def test_wrong_masks_are_refused(self, bad: object) -> None:
        with pytest.raises(InputError, match=r"mask must|image must"):
            dloftbs.detect(bad)

    @pytest.mark.parametrize("bad", [[[1, 0], [1]], [1, 2], 5, np.zeros((100, 200), complex)])
    def test_wrong_depth_is_refused(self, bad: object) -> None:
        with pytest.raises(InputError, match="depth"):
            dloftbs.detect(np.zeros((100, 200), bool), depth=bad)


STRANGE = {
    "empty": np.zeros((50, 60), bool),
    "no pixels at all": np.zeros((0, 7), bool),
    "1 x 1": np.ones((1, 1), bool),
    "one pixel": np.pad(np.ones((1, 1), bool), 20),
    "one row": np.ones((1, 300), bool),
    "one column": np.ones((300, 1), bool),
    "2 x 2": np.ones((2, 2), bool),
    "2 x 2 blocks": np.kron(np.indices((20, 20)).sum(0) % 3 == 0, np.ones((2, 2), bool)),
    "full": np.ones((200, 300), bool),
    "checkerboard": np.indices((100, 120)).sum(0) % 2 == 0,
    "wide checkerboard": np.indices((100, 120)).sum(0) // 4 % 2 == 0,
    "frame along the borders": np.pad(np.zeros((80, 90), bool), 5, constant_values=True),
    "noise": np.random.default_rng(0).random((240, 320)) < 0.5,
    "dense noise": np.random.default_rng(0).random((240, 320)) < 0.95,
    "grid": (np.indices((300, 300)) % 12 < 3).any(axis=0),
}


class TestStrangeMasks:
    @pytest.mark.parametrize(
        "config",
        [PAPER, EVERYTHING, DEFAULT, DEFAULT_EVERYTHING],
        ids=["paper", "paper, everything", "default", "default, everything"],
    )
    @pytest.mark.parametrize("mask", STRANGE.values(), ids=STRANGE.keys())
    def test_there_are_curves_or_a_reason(self, mask: np.ndarray, config: Config) -> None:
        result = Pipeline(config).process(Frame(mask=mask))
        assert (result.reason is None) == bool(result.detections)
        for detection in result.detections:
            assert np.isfinite(detection.curve.control_points).all()
            assert detection.curve.length > 0

    @given(random_masks)
    def test_random_masks_give_finite_curves_inside_their_box(self, mask: np.ndarray) -> None:
        for detection in dloftbs.detect(mask, config=EVERYTHING):
            centre_line = detection.centerline.points
            assert mask[tuple(centre_line.astype(int)[:, ::-1].T)].all()
            assert np.isfinite(detection.curve.sample(50)).all()

    @given(random_masks)
    def test_random_masks_give_finite_curves_by_the_default_method(self, mask: np.ndarray) -> None:
        result = Pipeline(DEFAULT_EVERYTHING).process(Frame(mask=mask))
        assert (result.reason is None) == bool(result.detections)
        for detection in result.detections:
            u = np.linspace(0.0, 1.0, 50)
            points = detection.curve(u)
            assert np.isfinite(points).all()
            seen = np.ones(50, np.bool_)
            for low, high in detection.inferred:  # an arc across a gap may leave the box, but not far from its ends
                within = (u > low) & (u < high)
                seen &= ~within
                ends = detection.curve(np.array([low, high]))
                away = np.linalg.norm(points[within, None] - ends, axis=2).min(axis=1)
                assert (away < np.linalg.norm(ends[1] - ends[0]) + 1.5).all()
            assert (points[seen] > -0.1 * max(mask.shape) - 1.5).all()
            assert (points[seen] < 1.1 * np.array(mask.shape[::-1]) + 0.5).all()

    @pytest.mark.parametrize(
        ("name", "config", "reason"),
        [
            ("empty", PAPER, "the mask is empty"),
            ("empty", DEFAULT, "the mask is empty"),
            ("one pixel", DEFAULT, "nothing of the mask is left after the opening by 3 x 3 px"),
            (
                "one pixel",
                DEFAULT_EVERYTHING,
                "nothing is as long as linking.min_length_px = 10 and linking.min_length_widths = 1.5",
            ),
            ("full", DEFAULT, "100 % of the mask is set, and cables cover at most 60 %: if it is inverted, turn it"),
            ("grid", DEFAULT, "segments are more than segments.max_segments = 1000: this mask is noise"),
            ("one pixel", PAPER, "nothing of the mask is left after the opening by 3 x 3 px"),
            ("one pixel", EVERYTHING, "the longest segment has 1 px, fewer than linking.min_length_px = 2"),
            ("grid", PAPER.replace({"segments.max_segments": 20, "linking.min_length_px": 2}), "this mask is noise"),
        ],
    )
    def test_the_reason_says_what_happened(self, name: str, config: Config, reason: str) -> None:
        result = Pipeline(config).process(Frame(mask=STRANGE[name]))
        assert result.reason is not None
        assert reason in result.reason

    def test_a_mask_of_4096_by_4096(self) -> None:
        mask = np.zeros((4096, 4096), bool)
        mask[2000:2040, 30:4000] = True
        (detection,) = dloftbs.detect(mask)
        assert detection.width_px == pytest.approx(40, abs=1)
        assert detection.curve.length == pytest.approx(3970 - 40, abs=45)


class TestSymmetry:
    """Turning or flipping a mask moves the curves along."""

    @staticmethod
    def of_versions(mask: np.ndarray, config: Config) -> list[list[np.ndarray]]:
        """Detect in all eight versions and turn the masks' curves into the first one's image."""
        found = []
        for how in EIGHT_VERSIONS:
            curves = [d.curve.sample(100) for d in dloftbs.detect(turn(mask, *how), config=config)]
            found.append([turn_points_back(points, mask.shape, *how) for points in curves])
        return found

    @pytest.mark.parametrize("config", [PAPER, DEFAULT], ids=["paper", "default"])
    @pytest.mark.parametrize("seed", range(12))
    def test_curves_of_a_scene_move_along_exactly(self, seed: int, config: Config) -> None:
        first, *others = self.of_versions(scene(seed), config)
        assert first
        for other in others:
            assert len(other) == len(first)
            for a, b in zip(first, other, strict=True):
                np.testing.assert_allclose(a, b, atol=1e-6)

    @given(random_masks)
    def test_there_are_as_many_curves_in_every_version_of_any_mask(self, mask: np.ndarray) -> None:
        for config in (EVERYTHING, DEFAULT_EVERYTHING):
            counts = {len(version) for version in self.of_versions(mask, config)}
            assert len(counts) == 1

    @pytest.mark.parametrize("config", [PAPER, DEFAULT], ids=["paper", "default"])
    @pytest.mark.parametrize("width", [3, 6, 12])
    def test_a_symmetric_mask_has_curves_that_are_symmetric_to_a_pixel(self, width: int, config: Config) -> None:
        mask = draw_cable(np.array([[20.0, 200.0], [380.0, 200.0]]), width, (400, 400))
        mask |= mask.T  # the ends are too far apart to be joined
        first, *others = self.of_versions(mask, config)
        points = np.concatenate(first)
        for other in others:
            assert len(other) == len(first)
            distance, _ = cKDTree(points).query(np.concatenate(other))
            assert distance.max() < 2.9  # half the distance of the samples, and a pixel


class TestColour:
    RED = Config(segmentation=SegmentationConfig(hsv=(HsvRange.parse("170:10,80:255,60:255"),)))

    @staticmethod
    def image() -> np.ndarray:
        image = np.full((*SIZE, 3), 90, np.uint8)
        image[draw_cable(wave(SIZE), 9, SIZE) != 0] = (30, 20, 210)
        return image

    def test_a_red_cable_is_found_by_its_hue(self) -> None:
        result = Pipeline(self.RED).process(Frame(image=self.image()))
        (expected,) = dloftbs.detect(draw_cable(wave(SIZE), 9, SIZE))
        assert [d.curve for d in result.detections] == [expected.curve]

    def test_a_mask_takes_the_place_of_the_segmentation(self) -> None:
        result = Pipeline(self.RED).process(Frame(image=self.image(), mask=np.zeros(SIZE, bool)))
        assert result.reason == "the mask is empty"

    def test_any_callable_segments(self) -> None:
        pipeline = Pipeline(segmenter=lambda image: (image[:, :, 2] > 150)[:, :, None])
        assert len(pipeline.process(Frame(image=self.image())).detections) == 1

    def test_an_image_without_any_way_to_a_mask_is_refused(self) -> None:
        with pytest.raises(InputError, match=r"such as hsv='170:10.* for red, .*, or the frame a mask"):
            Pipeline().process(Frame(image=self.image()))

    def test_a_segmenter_that_returns_something_else_is_refused(self) -> None:
        with pytest.raises(InputError, match=r"frame's size \(240, 400\), got \(120, 400\)"):
            Pipeline(segmenter=lambda image: image[::2, :, 0]).process(Frame(image=self.image()))
        with pytest.raises(
            InputError, match=r"mask must be a probability in 0\.\.1 .*, got 90\.\.210; of scores, give"
        ):
            Pipeline(segmenter=lambda image: image[:, :, 2].astype(float)).process(Frame(image=self.image()))


class TestStream:
    def test_a_repeated_stamp_changes_nothing(self) -> None:
        def frame(index: int, stamp: float) -> Frame:
            lines = [((40, 150), (360, 150)), ((200, 150), (200, 40))]
            mask = np.zeros((300, 400), np.uint8)
            for start, end in lines:
                cv2.line(mask, (start[0], start[1] + index), (end[0], end[1] + index), 255, 9)
            return Frame(mask=mask, index=index, stamp=stamp, name=f"{index}.png")

        pipeline = Pipeline(branched=True)
        results = [pipeline.process(frame(k, stamp)) for k, stamp in enumerate((0.0, 0.03, 0.06, 0.06, 0.1))]
        assert (results[3].index, results[3].name) == (3, "3.png")
        assert (results[3].detections, results[3].tracks) == (results[2].detections, results[2].tracks)
        assert [[one.id for one in result.harnesses] for result in results] == [[1]] * 5
        assert len({tuple(one.id for one in result.branch_points) for result in results}) == 1

    def test_other_pixels_with_a_repeated_stamp_are_reported_once(self, caplog: pytest.LogCaptureFixture) -> None:
        frames = [replace(frame, stamp=0.5) for frame in self.frames()]
        pipeline = Pipeline()
        for frame in (frames[0], frames[0]):
            pipeline.process(frame)
        assert not caplog.records
        found = [pipeline.process(frame) for frame in frames[1:3]]
        (record,) = caplog.records
        assert "frame 1 differs from the one before it and has the same stamp, 0.5 s" in record.getMessage()
        assert found[0].diagnosis == (record.getMessage(),)
        assert found[1].diagnosis[0].startswith("frame 2 differs")
        assert pipeline.process(replace(frames[3], stamp=0.6)).diagnosis == ()

    def test_a_mask_that_is_mostly_set_is_said_in_each_result(self) -> None:
        mask = np.ones(SIZE, np.uint8)
        mask[::4] = 0
        for result in (Pipeline().process(mask), Pipeline(roi=(0, 0, *SIZE[::-1])).process(mask), detect(mask)):
            assert [text[:28] for text in result.diagnosis] == ["75 % of the mask is set: inv"]
            assert FrameResult.from_dict(result.to_dict()).diagnosis == result.diagnosis
        assert "diagnosis" not in detect(np.zeros(SIZE, np.uint8)).to_dict()

    @staticmethod
    def frames() -> list[Frame]:
        masks = [draw_cable(wave(SIZE, 1.0, 0.05 * i), 9, SIZE) for i in range(12)]
        masks[6] = np.zeros(SIZE, np.uint8)
        return [Frame(mask=mask, index=i, stamp=i / 30, name=f"f{i}") for i, mask in enumerate(masks)]

    def test_identity_and_direction_hold(self) -> None:
        results = list(dloftbs.track(self.frames()))
        assert [[t.id for t in result.tracks] for result in results] == [[1]] * 12
        starts = np.array([result.tracks[0].curve(0.0) for result in results])
        assert np.linalg.norm(np.diff(starts, axis=0), axis=1).max() < 25
        assert str(results[6].reason).startswith("the mask is empty, after ")
        assert results[6].detections == ()

    def test_results_carry_what_the_frame_says_of_itself(self) -> None:
        result = list(dloftbs.track(self.frames()))[3]
        assert (result.index, result.stamp, result.name, result.size) == (3, 0.1, "f3", SIZE)
        assert list(result.stage_ms) == [
            "segmentation", "cleaning", "skeleton", "segments", "linking", "fitting", "crossings", "lifting",
            "tracking",
        ]  # fmt: skip
        assert result.total_ms == pytest.approx(sum(result.stage_ms.values()))

    def test_results_come_as_frames_come(self) -> None:
        taken = []

        def source() -> object:
            for frame in self.frames():
                taken.append(frame.index)
                yield frame

        results = dloftbs.track(source())
        next(results)
        assert taken == [0]

    def test_reset_forgets(self) -> None:
        pipeline = Pipeline()
        pipeline.process(self.frames()[0])
        pipeline.reset()
        assert [t.id for t in pipeline.process(self.frames()[1]).tracks] == [2]

    def test_the_mask_that_was_segmented_can_be_asked_for(self) -> None:
        image = np.zeros((*SIZE, 3), np.uint8)
        image[draw_cable(wave(SIZE), 9, SIZE) > 0] = (0, 0, 255)
        pipeline = Pipeline(hsv="170:10")
        assert pipeline.mask is None
        pipeline.process(image)
        assert pipeline.mask is not None
        assert np.array_equal(pipeline.mask != 0, image.any(axis=2))
        pipeline.reset()
        assert pipeline.mask is None

    def test_detecting_gives_the_same_objects_and_leaves_the_tracks_alone(self) -> None:
        frames, pipeline = self.frames(), Pipeline()
        published = pipeline.process(frames[0]).tracks
        alone = pipeline.detect(frames[1])
        assert alone.tracks == ()
        assert alone.index == 1
        assert "tracking" not in alone.stage_ms
        followed = pipeline.process(frames[1])
        assert [d.curve for d in alone.detections] == [d.curve for d in followed.detections]
        assert [t.id for t in followed.tracks] == [t.id for t in published]
        assert followed.tracks[0].hits == 2

    def test_two_pipelines_in_two_threads_do_not_disturb_each_other(self) -> None:
        streams = [[scene(seed) for seed in range(first, first + 6)] for first in (0, 100)]

        def run(masks: list[np.ndarray], out: list[object]) -> None:
            pipeline = Pipeline(PAPER)
            out.extend(t.curve for _ in range(5) for m in masks for t in pipeline.process(Frame(mask=m)).tracks)

        expected: list[list[object]] = [[], []]
        for masks, out in zip(streams, expected, strict=True):
            run(masks, out)
        parallel: list[list[object]] = [[], []]
        threads = [threading.Thread(target=run, args=pair) for pair in zip(streams, parallel, strict=True)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert parallel == expected


class TestTrace:
    def test_the_trace_shows_every_stage(self) -> None:
        mask = scene(3)
        trace = Pipeline(PAPER).trace(Frame(mask=mask))
        np.testing.assert_array_equal(trace.mask, mask != 0)
        np.testing.assert_array_equal(trace.cleaned, cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)))
        assert trace.cleaned[tuple(trace.skeleton.astype(int)[:, ::-1].T)].all()
        assert len(trace.endpoints) >= 3
        assert len(trace.branch_points) >= 1
        assert len(trace.segments) >= 4
        walked = sum(map(len, trace.segments)) + sum(map(len, trace.short_segments))
        assert walked + len(trace.branch_points) == len(trace.skeleton)
        assert [d.curve for d in trace.result.detections] == [d.curve for d in dloftbs.detect(mask, config=PAPER)]

    def test_the_trace_of_the_default_method_shows_its_runs(self) -> None:
        mask = scene(3)
        trace = Pipeline().trace(Frame(mask=mask))
        # Each point of the skeleton but the branch points is in a run, moved to the middle of the mask.
        runs = [*trace.segments, *trace.short_segments]
        assert sum(map(len, runs)) + len(trace.branch_points) == len(trace.skeleton)
        away, _ = cKDTree(trace.skeleton).query(np.concatenate([run.points for run in runs]))
        assert away.max() < 4.0
        assert len(trace.segments) >= 4
        assert [d.curve for d in trace.result.detections] == [d.curve for d in dloftbs.detect(mask)]

    def test_the_trace_leaves_the_tracks_alone(self) -> None:
        pipeline = Pipeline(PAPER)
        pipeline.trace(Frame(mask=scene(3)))
        assert min(t.id for t in pipeline.process(Frame(mask=scene(3))).tracks) == 1

    def test_the_trace_of_nothing_is_empty(self) -> None:
        trace = Pipeline(PAPER).trace(Frame(mask=np.zeros(SIZE, bool)))
        assert (len(trace.skeleton), trace.segments, trace.result.reason) == (0, (), "the mask is empty")
