"""A segmentation that fails for some frames ends no tracks and begins none; a scene that changed is believed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from drawings import draw_cable, wave

from dloftbs import Config, Frame, FrameResult, Pipeline
from dloftbs.camera import PinholeCamera
from dloftbs.config import TrackingConfig
from dloftbs.data.tracks import TrackState
from dloftbs.pipeline.mask_gate import MaskGate

SIZE = (240, 400)
FPS = 30.0
FAILS_AT = 8
WIDTH_PX = 5


def mask(index: int, cables: int = 1) -> np.ndarray:
    """Return a mask of cables below each other that move."""
    moving = wave(SIZE, 0.3, 0.01 * index) * np.array([1.0, 0.5]) + np.array([0.0, 60.0])
    drawn = [draw_cable(moving + np.array([0.0, 50.0 * (2 * k - cables + 1)]), WIDTH_PX, SIZE) for k in range(cables)]
    return np.any(drawn, axis=0)


def noise(good: np.ndarray) -> np.ndarray:
    """Return a mask with blots, of more than ten times the area."""
    rng, bad = np.random.default_rng(0), good.copy()
    while bad.sum() < 12 * good.sum():
        x, y = rng.integers(SIZE[1]), rng.integers(SIZE[0])
        bad[y : y + 12, x : x + 40] = True
    return bad


def part(good: np.ndarray) -> np.ndarray:
    """Return a mask with a twentieth of the area."""
    bad = good.copy()
    bad[:, int(np.quantile(np.nonzero(good)[1], 0.05)) :] = False
    return bad


FAILURES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "empty": np.zeros_like,
    "full": np.ones_like,
    "inverted": np.logical_not,
    "noise": noise,
    "a twentieth": part,
}


def follow(masks: Sequence[np.ndarray], pipeline: Pipeline | None = None, fps: float | None = FPS) -> list[FrameResult]:
    pipeline = pipeline or Pipeline()
    stamps = [None if fps is None else i / fps for i in range(len(masks))]
    return [pipeline.process(Frame(mask=one, index=i, stamp=stamps[i])) for i, one in enumerate(masks)]


def states(results: Sequence[FrameResult]) -> list[list[tuple[int, str]]]:
    return [[(track.id, track.state.value) for track in result.tracks] for result in results]


class TestFailures:
    @pytest.mark.parametrize("frames", [1, 5, 15])
    @pytest.mark.parametrize("cables", [1, 2])
    @pytest.mark.parametrize("failure", FAILURES.values(), ids=FAILURES)
    def test_tracks_are_hidden_and_go_on(
        self, failure: Callable[[np.ndarray], np.ndarray], cables: int, frames: int
    ) -> None:
        masks = [mask(i, cables) for i in range(FAILS_AT + frames + 4)]
        failed = range(FAILS_AT, FAILS_AT + frames)
        for i in failed:
            masks[i] = failure(masks[i])
        ids = range(1, cables + 1)
        results = follow(masks)
        assert states(results)[1:FAILS_AT] == [[(k, "confirmed") for k in ids]] * (FAILS_AT - 1)
        assert states(results)[failed.start : failed.stop] == [[(k, "hidden") for k in ids]] * frames
        assert states(results)[failed.stop :] == [[(k, "confirmed") for k in ids]] * 4
        for i in failed:
            assert not results[i].detections
            assert "the segmentation has failed, or the scene changed" in str(results[i].reason)
            assert list(results[i].stage_ms) == ["segmentation", "tracking"]

    def test_a_colour_that_fails_for_a_frame_is_as_a_mask_that_fails(self) -> None:
        pipeline = Pipeline(hsv="red")
        images = [
            np.where(mask(i)[..., None], (0, 0, 255), (90, 120, 90)).astype(np.uint8) for i in range(FAILS_AT + 2)
        ]
        images[FAILS_AT] //= 16  # the exposure jumps
        results = [pipeline.process(Frame(image=one, index=i, stamp=i / FPS)) for i, one in enumerate(images)]
        assert [state for ((_, state),) in states(results)[1:]] == ["confirmed"] * 7 + ["hidden", "confirmed"]
        assert "the segmentation has failed" in str(results[FAILS_AT].reason)

    def test_a_region_of_interest_has_a_mask_of_its_own(self) -> None:
        masks = [mask(i) for i in range(FAILS_AT + 2)]
        masks[FAILS_AT] = np.zeros(SIZE, bool)
        masks[FAILS_AT][:60] = True  # outside of it
        results = follow(masks, Pipeline(roi=(0, 60, SIZE[1], SIZE[0] - 60)))
        assert [state for (_, state), *_ in states(results)[1:]] == ["confirmed"] * 7 + ["hidden", "confirmed"]
        assert str(results[FAILS_AT].reason).startswith("the mask is empty, after ")

    def test_in_a_polygon_known_objects_may_come_back_as_a_whole(self) -> None:
        size, end = (600, 600), np.array([560.0, 560.0])
        pipeline = Pipeline(roi=[(0, 30), (30, 0), (599, 569), (569, 599)])
        seen = [1.0] * 12 + [0.9**k for k in range(28)] + [1.0, 1.0]
        for i, share in enumerate(seen):
            pixels = draw_cable(np.array([(40.0, 40.0), 40.0 + share * (end - 40.0)]), 9, size) > 0
            hidden = draw_cable(np.array([(40.0, 40.0), end]), 9, size) > 0
            frame = Frame(mask=pixels, occluders=hidden & ~pixels, index=i, stamp=i / FPS)
            assert pipeline.process(frame).reason is None

    def test_the_reason_says_what_happened_and_for_how_long_it_is_not_believed(self) -> None:
        masks = [mask(i) for i in range(FAILS_AT)]
        *_, result = follow([*masks, np.zeros(SIZE, bool)])
        share = 100.0 * np.count_nonzero(masks[-1]) / masks[-1].size
        assert result.reason == (
            f"the mask is empty, after {share:.3g} %: the segmentation has failed, or the scene changed, which is "
            "believed after 0.5 s"
        )

    def test_hidden_curves_lie_where_the_cables_were_going(self) -> None:
        masks = [mask(i) for i in range(FAILS_AT + 2)]
        masks[FAILS_AT] = np.zeros(SIZE, bool)
        hidden, seen = (result.tracks[0] for result in follow(masks)[-2:])
        assert hidden.inferred == ((0.0, 1.0),)
        assert np.linalg.norm(hidden.curve.sample(20) - seen.curve.sample(20), axis=1).max() < 2 * WIDTH_PX

    def test_several_failures_are_as_one(self) -> None:
        masks = [mask(i) for i in range(60)]
        for i in range(FAILS_AT, 60, 3):
            masks[i] = np.zeros(SIZE, bool)
        assert states(follow(masks))[1:] == [
            [(1, "hidden" if i >= FAILS_AT and (i - FAILS_AT) % 3 == 0 else "confirmed")] for i in range(1, 60)
        ]

    def test_a_frame_by_itself_is_read_as_it_is(self) -> None:
        pipeline = Pipeline()
        follow([mask(i) for i in range(FAILS_AT)], pipeline)
        assert pipeline.detect(np.zeros(SIZE, bool)).reason == "the mask is empty"
        assert pipeline.trace(np.zeros(SIZE, bool)).result.reason == "the mask is empty"
        assert pipeline.process(Frame(mask=mask(FAILS_AT), stamp=FAILS_AT / FPS)).tracks[0].id == 1

    def test_the_published_method_has_no_gate(self) -> None:
        masks = [*[mask(i) for i in range(FAILS_AT)], np.zeros(SIZE, bool)]
        assert follow(masks, Pipeline(Config.paper()))[-1].reason == "the mask is empty"


class TestChanges:
    """What is no failure."""

    @pytest.mark.parametrize("evidence", ["mask", "camera"])
    def test_unspoilt_sequences_are_read_as_without_a_gate(self, evidence: str) -> None:
        open_pipeline, gated = Pipeline(), Pipeline()
        open_pipeline._gate = None
        for i in range(20):
            drawn = mask(i, 2)
            seen = (
                {} if evidence == "mask" else {"depth": ground(drawn), "camera": CAMERA, "occluders": ~drawn & (i > 9)}
            )
            frame = Frame(mask=drawn, index=i, stamp=i / FPS, **seen)
            pair = [one.process(frame).to_dict() for one in (open_pipeline, gated)]
            assert all(one.pop("stage_ms") for one in pair)
            assert pair[0] == pair[1]

    def test_the_first_mask_is_believed(self) -> None:
        for first in (np.zeros(SIZE, bool), part(mask(0)), mask(0)):
            results = follow([first, *[mask(i, 2) for i in range(1, 4)]])
            assert [len(result) for result in results[1:]] == [2, 2, 2]

    @pytest.mark.parametrize("failure", FAILURES.values(), ids=FAILURES)
    def test_a_change_that_lasts_is_believed_after_half_a_second(
        self, failure: Callable[[np.ndarray], np.ndarray]
    ) -> None:
        masks = [mask(i) if i < FAILS_AT else failure(mask(FAILS_AT)) for i in range(FAILS_AT + 20)]
        reasons = [str(result.reason) for result in follow(masks)]
        refused = ["the segmentation has failed" in reason for reason in reasons]
        assert refused == [False] * FAILS_AT + [True] * 15 + [False] * 5

    def test_what_was_taken_away_leaves_no_track_after_that_and_is_found_again(self) -> None:
        masks = [mask(i) if i < FAILS_AT or i > 40 else np.zeros(SIZE, bool) for i in range(44)]
        results = follow(masks)
        assert states(results)[FAILS_AT + 15 : 41] == [[]] * (41 - FAILS_AT - 15)
        assert results[FAILS_AT + 15].reason == "the mask is empty"
        assert states(results)[41:] == [[(1, "confirmed")]] * 3

    @pytest.mark.parametrize(("fps", "ghosts"), [(2.0, 1), (1.9, 0), (None, 15)])
    def test_a_slow_camera_shows_a_ghost_in_one_frame_at_most(self, fps: float | None, ghosts: int) -> None:
        masks = [mask(i) if i < FAILS_AT else np.zeros(SIZE, bool) for i in range(FAILS_AT + 20)]
        assert sum(len(result.tracks) for result in follow(masks, fps=fps)[FAILS_AT:]) == ghosts

    def test_a_cable_that_is_pulled_out_shrinks_and_is_gone_at_once(self) -> None:
        whole = draw_cable(np.stack([np.linspace(40, 360, 50), np.full(50, 120.0)], axis=1), WIDTH_PX, SIZE) != 0
        masks = [whole] * 3
        while masks[-1].any():
            masks.append(np.roll(masks[-1], 20, axis=1))
            masks[-1][:, :20] = False
        results = follow(masks)
        assert all("failed" not in str(result.reason) for result in results)
        assert results[-1].tracks == ()

    def test_a_cable_that_comes_in_at_the_border_is_seen_at_once(self) -> None:
        masks = [np.zeros(SIZE, bool) for _ in range(6)]
        for shown, one in zip((0, 20, 20, 20, 300, 320), masks, strict=True):
            one[118 : 118 + WIDTH_PX, :shown] = True
        assert [len(result.detections) for result in follow(masks)] == [0, 1, 1, 1, 1, 1]

    def test_known_objects_may_come_back_as_a_whole(self) -> None:
        gate = MaskGate(TrackingConfig())
        gate.accept(0.001, 0.0, shows_tracks=True, known=0.02)
        assert gate.refuse(0.199, 0.1, readable=True) is None
        assert gate.refuse(0.2, 0.1, readable=True) is not None
        gate.accept(0.001, 0.2, shows_tracks=True)
        assert gate.refuse(0.02, 0.3, readable=True) is not None

    def test_without_memory_nothing_is_refused(self) -> None:
        pipeline = Pipeline(Config(tracking=TrackingConfig(keep_lost_s=0.0)))
        results = follow([mask(0), mask(1), mask(2), np.zeros(SIZE, bool)], pipeline)
        assert (results[-1].reason, results[-1].tracks) == ("the mask is empty", ())

    def test_another_camera_or_a_reset_begins_anew(self) -> None:
        pipeline = Pipeline()
        follow([mask(i) for i in range(3)], pipeline)
        assert pipeline.process(np.zeros((100, 100), bool)).reason == "the mask is empty"
        follow([mask(i) for i in range(3)], pipeline)
        pipeline.reset()
        assert pipeline.process(np.zeros(SIZE, bool)).reason == "the mask is empty"


CAMERA = PinholeCamera(400.0, 400.0, 199.5, 119.5)


def ground(cables: np.ndarray) -> np.ndarray:
    """Return the depth, m, of a table at 1 m with cables 10 cm above it."""
    return np.where(cables, 0.9, 1.0).astype(np.float32)


@pytest.mark.parametrize("there", [True, False])
def test_depth_shows_at_once_that_a_cable_was_taken_away(there: bool) -> None:
    pipeline = Pipeline()
    for i in range(FAILS_AT):
        pipeline.process(Frame(mask=mask(0), depth=ground(mask(0)), camera=CAMERA, stamp=i / FPS))
    for i in range(FAILS_AT, FAILS_AT + 5):
        depth = ground(mask(0) & there)
        result = pipeline.process(Frame(mask=np.zeros(SIZE, bool), depth=depth, camera=CAMERA, stamp=i / FPS))
        assert [track.state for track in result.tracks] == [TrackState.HIDDEN] * there


def test_a_mask_of_occluders_is_no_evidence_that_a_cable_is_gone() -> None:
    pipeline = Pipeline()
    nothing = np.zeros(SIZE, bool)
    for i in range(FAILS_AT):
        pipeline.process(Frame(mask=mask(0), occluders=nothing, stamp=i / FPS))
    result = pipeline.process(Frame(mask=nothing, occluders=nothing, stamp=FAILS_AT / FPS))
    assert [track.state for track in result.tracks] == [TrackState.HIDDEN]


class TestGate:
    @staticmethod
    def gate(*shares: float, **config: float) -> MaskGate:
        """Return a gate that has accepted some masks, at 10 frames per second."""
        gate = MaskGate(TrackingConfig(**config))
        for i, share in enumerate(shares):
            gate.accept(share, i / 10, shows_tracks=True)
        return gate

    @pytest.mark.parametrize(
        ("shares", "share", "refused"),
        [
            ((0.02, 0.02), 0.0, True),
            ((0.02, 0.02), 0.002, True),
            ((0.02, 0.02), 0.0021, False),
            ((0.02, 0.02), 0.199, False),
            ((0.02, 0.02), 0.2, True),
            ((0.03, 0.02, 0.01), 0.0, False),
            ((0.04, 0.03, 0.02), 0.0, True),
            ((0.01, 0.02), 0.21, False),
            ((0.01, 0.02), 0.3, True),
        ],
    )
    def test_a_jump_is_ten_times_off_what_is_expected(
        self, shares: Sequence[float], share: float, refused: bool
    ) -> None:
        gate = self.gate(*shares)
        assert (gate.refuse(share, len(shares) / 10, readable=True) is not None) is refused

    def test_what_cannot_be_read_is_refused_whatever_its_area(self) -> None:
        gate = self.gate(0.3, 0.3)
        assert gate.refuse(0.7, 0.2, readable=True) is None
        assert str(gate.refuse(0.7, 0.2, readable=False)).startswith("70 % of the mask is set, after 30 %")

    def test_nothing_is_refused_unless_the_last_mask_showed_a_track(self) -> None:
        gate = MaskGate(TrackingConfig())
        assert gate.refuse(0.0, 0.0, readable=True) is None
        gate.accept(0.02, 0.0, shows_tracks=False)
        assert gate.refuse(0.0, 0.1, readable=True) is None

    def test_time_is_that_of_the_stamps_or_else_of_the_frames(self) -> None:
        gate = self.gate(0.02, 0.02, frame_s=0.15)
        assert [gate.refuse(0.0, stamp, readable=True) is None for stamp in (0.2, 0.6, 0.7)] == [False, False, True]
        gate.accept(0.02, None, shows_tracks=True)
        assert [gate.refuse(0.0, None, readable=True) is None for _ in range(4)] == [False, False, False, True]

    @pytest.mark.parametrize(("keep_lost_s", "held_s"), [(0.25, 0.25), (3600.0, 0.5)])
    def test_tracks_are_held_no_longer_than_they_are_kept(self, keep_lost_s: float, held_s: float) -> None:
        gate = self.gate(0.02, 0.02, keep_lost_s=keep_lost_s)
        assert str(gate.refuse(0.0, 0.2, readable=True)).endswith(f"believed after {held_s:g} s")
        assert gate.refuse(0.0, 0.1 + held_s, readable=True) is not None
        assert gate.refuse(0.0, 0.11 + held_s, readable=True) is None

    def test_a_stamp_before_the_last_one_is_another_stream(self) -> None:
        assert self.gate(0.02, 0.02).refuse(0.0, 0.05, readable=True) is None
