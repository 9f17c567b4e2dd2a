"""The two ways in: whatever a frame or a stream is, and what is none."""

from __future__ import annotations

import logging

import cv2
import numpy as np
import pytest
from drawings import draw_cable, wave

import dloftbs
from dloftbs import Config, ConfigError, Frame, HsvRange, InputError, PinholeCamera, Pipeline, SourceError
from dloftbs.config import LinkingConfig

SIZE = (120, 200)
RED = "170:10,80:255,60:255"
CAMERA = PinholeCamera(300.0, 300.0, 100.0, 60.0)


def mask_of(shift: float = 0.0) -> np.ndarray:
    return draw_cable(wave(SIZE, 1.0, shift), 7, SIZE) != 0


def image_of(mask: np.ndarray) -> np.ndarray:
    image = np.full((*SIZE, 3), 90, np.uint8)
    image[mask] = (30, 20, 210)
    return image


def curves(result: dloftbs.FrameResult) -> list[dloftbs.BSplineCurve]:
    return [detection.curve for detection in result]


class TestDetect:
    def test_a_mask_an_image_and_a_frame_are_the_same_picture(self) -> None:
        mask = mask_of()
        expected = curves(dloftbs.detect(mask))
        assert len(expected) == 1
        red = HsvRange.parse(RED)
        for hsv in (RED, red, [RED], (red, "20:30")):
            assert curves(dloftbs.detect(image_of(mask), hsv=hsv)) == expected
        assert curves(dloftbs.detect(Frame(image=image_of(mask)), hsv=RED)) == expected
        assert curves(dloftbs.detect(Frame(mask=mask))) == expected
        assert curves(dloftbs.detect(mask.astype(np.uint8)[:, :, None])) == expected
        config = Config.from_yaml(f"segmentation: {{hsv: '{RED}'}}")
        assert curves(dloftbs.detect(image_of(mask), config=config)) == expected

    def test_a_configured_colour_gives_way_to_a_mask(self) -> None:
        config = Config.from_yaml(f"segmentation: {{hsv: '{RED}'}}")
        assert curves(dloftbs.detect(mask_of(), config=config)) == curves(dloftbs.detect(mask_of()))

    def test_the_number_of_objects_may_be_known(self) -> None:
        mask = np.zeros(SIZE, bool)
        mask[20:27, 20:180] = mask[60:67, 20:150] = mask[100:107, 20:80] = True
        assert len(dloftbs.detect(mask)) == 3
        found = dloftbs.detect(mask, objects=2)
        assert [round(d.curve.start[1]) for d in sorted(found, key=lambda d: -d.curve.length)] == [23, 63]
        assert len(found.dropped) == 1
        assert len(dloftbs.detect(mask, objects=1, config=Config(linking=LinkingConfig(objects=3)))) == 1

    def test_depth_in_counts_has_a_unit(self) -> None:
        counts = np.full(SIZE, 5000, np.uint16)
        (found,) = dloftbs.detect(mask_of(), depth=counts, depth_unit_m=1e-4, camera=CAMERA)
        assert found.curve_3d is not None
        assert found.curve_3d(0.5)[2] == pytest.approx(0.5, abs=0.02)
        assert found.camera is CAMERA
        assert np.abs(CAMERA.project(found.curve_3d(found.u_3d(0.5))) - found.curve(0.5)).max() < 1.0

    def test_depth_in_millimetres_that_should_be_metres_is_said(self) -> None:
        for config in (None, Config.paper()):
            (found,) = dloftbs.detect(mask_of(), depth=np.full(SIZE, 500.0), camera=CAMERA, config=config)
            assert found.curve_3d is None
            assert "the median of the depth is 500, and floating-point depth is in metres" in str(found.no_3d_reason)
        (found,) = dloftbs.detect(mask_of(), depth=np.zeros(SIZE), camera=CAMERA)
        assert "millimetres" not in str(found.no_3d_reason)

    def test_the_result_keeps_its_frame_and_a_notebook_shows_it(self) -> None:
        mask = mask_of()
        result = dloftbs.detect(image_of(mask), hsv=RED)
        assert result.frame is not None
        picture = cv2.imdecode(np.frombuffer(result._repr_png_(), np.uint8), cv2.IMREAD_COLOR)
        np.testing.assert_array_equal(picture, dloftbs.viz.draw(result.frame, result))
        streamed = Pipeline().process(mask)
        assert streamed.frame is None
        picture = cv2.imdecode(np.frombuffer(streamed._repr_png_(), np.uint8), cv2.IMREAD_COLOR)
        assert picture.shape == (*SIZE, 3)
        assert picture.max() > 100
        trace = Pipeline().trace(mask)
        assert cv2.imdecode(np.frombuffer(trace._repr_png_(), np.uint8), cv2.IMREAD_COLOR).size

    @pytest.mark.parametrize(
        ("x", "given", "message"),
        [
            (np.zeros((9, 9)), {}, r"mask must be bool or integer.*float64; threshold it first: mask > 0\.5"),
            (np.zeros((9, 9, 3), np.uint8), {}, "nothing says what in the image is cable: give its colour"),
            (np.zeros((9, 9, 3)), {}, "image must have shape .* and type uint8"),
            (np.zeros((9, 9, 4), np.uint8), {}, "four channels; leave out the fourth"),
            (np.zeros((9, 9), bool), {"hsv": RED}, "x is a mask already"),
            (np.zeros((9, 9, 3), np.uint8), {"image": np.zeros((9, 9, 3), np.uint8)}, "x must be a mask"),
            (Frame(mask=np.zeros((9, 9), bool)), {"camera": CAMERA}, "give camera to the Frame"),
            (np.zeros((9, 9), bool), {"camera": (1, 2, 3, 4)}, "camera must be a PinholeCamera, got"),
            (np.zeros((9, 9), bool), {"config": {"fitting": {}}}, r"config must be a Config.*Config\.from_dict"),
            (np.zeros((9, 9), bool), {"config": "my.yaml"}, r"config must be a Config.*Config\.from_file a path"),
            ("photo.jpg", {}, r"got 'photo\.jpg'; sources\.open reads files"),
            (None, {}, "got"),
            ({"mask": 5}, {}, "got"),
        ],
    )
    def test_what_cannot_be_is_refused_with_the_remedy(self, x: object, given: dict, message: str) -> None:
        with pytest.raises(InputError, match=message):
            dloftbs.detect(x, **given)

    @pytest.mark.parametrize("given", [{"hsv": "rosso"}, {"hsv": 5}, {"objects": 0}, {"objects": "two"}])
    def test_a_wrong_choice_is_refused(self, given: dict) -> None:
        with pytest.raises(ConfigError):
            dloftbs.detect(np.zeros((9, 9, 3), np.uint8), **given)


class TestDoubts:
    def test_an_inverted_mask_is_found_strange(self, caplog: pytest.LogCaptureFixture) -> None:
        with caplog.at_level(logging.WARNING, "dloftbs"):
            dloftbs.detect(mask_of())
            assert caplog.messages == []
            dloftbs.detect(Frame(mask=~mask_of(), name="a.png"))
        share = round(100 * (~mask_of()).mean())
        assert caplog.messages == [
            f"{share} % of the mask of a.png is set: inverted, a photograph, or too many colours? "
            "See `dloftbs tune --help`"
        ]

    def test_a_stream_says_so_once(self, caplog: pytest.LogCaptureFixture) -> None:
        pipeline = Pipeline()
        with caplog.at_level(logging.WARNING, "dloftbs"):
            for _ in range(3):
                pipeline.process(~mask_of())
            assert len(caplog.messages) == 1
            pipeline.reset()
            pipeline.process(~mask_of())
        assert len(caplog.messages) == 2


class TestTrack:
    MASKS = tuple(mask_of(0.05 * i) for i in range(4))

    def ids(self, results: object) -> list[list[int]]:
        return [[track.id for track in result.tracks] for result in results]  # type: ignore[attr-defined]

    def test_a_stream_is_whatever_frames_come_from(self, tmp_path) -> None:
        for i, mask in enumerate(self.MASKS):
            cv2.imwrite(str(tmp_path / f"{i}.png"), mask.astype(np.uint8) * 255)
        stack = np.array(self.MASKS)
        np.save(tmp_path / "stack.npy", stack)
        ways = [
            self.MASKS,
            (mask.astype(np.uint8) for mask in self.MASKS),
            stack,
            str(tmp_path),
            tmp_path,
            tmp_path / "stack.npy",
            sorted(tmp_path.glob("*.png")),
            [Frame(mask=mask, index=i) for i, mask in enumerate(self.MASKS)],
        ]
        for way in ways:
            results = list(dloftbs.track(way))
            assert self.ids(results) == [[1]] * 4
            assert [result.index for result in results] == [0, 1, 2, 3]
            assert results[0].frame is None

    def test_a_source_that_is_given_stays_open(self) -> None:
        source = dloftbs.sources.open(np.array(self.MASKS))
        assert len(list(dloftbs.track(source))) == len(list(dloftbs.track(source))) == 4

    def test_images_are_segmented_by_their_colour(self) -> None:
        images = [image_of(mask) for mask in self.MASKS]
        assert self.ids(dloftbs.track(images, hsv=RED, objects=1)) == [[1]] * 4
        assert self.ids(dloftbs.track(np.array(images), segmenter=lambda image: image[:, :, 2] > 150)) == [[1]] * 4

    @pytest.mark.parametrize(
        ("frames", "given", "message"),
        [
            (np.zeros((9, 9), bool), {}, "got a single frame: detect takes one"),
            (np.zeros((9, 9, 3), np.uint8), {}, "got a single frame"),
            (Frame(mask=np.zeros((9, 9), bool)), {}, "got a single frame"),
            (5.5, {}, "expected a path, a camera's index or an iterable of frames, got 5.5"),
            (None, {}, "or an iterable of frames, got None"),
            ({"a": 1}, {}, "or an iterable of frames, got"),
            ([], {"config": {}}, "config must be a Config"),
            ([], {"segmenter": "net"}, "segmenter must be a function"),
            ([], {"segmenter": len, "hsv": RED}, "either hsv or a segmenter"),
        ],
    )
    def test_what_cannot_be_is_refused_at_once(self, frames: object, given: dict, message: str) -> None:
        with pytest.raises(InputError, match=message):
            dloftbs.track(frames, **given)

    def test_a_path_that_is_not_there_is_refused_at_once(self, tmp_path) -> None:
        with pytest.raises(SourceError, match="there is no file or folder"):
            dloftbs.track(tmp_path / "cable.mp4")

    def test_a_frame_that_is_none_is_refused_when_it_comes(self) -> None:
        results = dloftbs.track([self.MASKS[0], None])
        assert self.ids([next(results)]) == [[1]]
        with pytest.raises(InputError, match="mask must"):
            next(results)


def test_a_pipeline_counts_arrays_and_keeps_the_numbers_of_frames() -> None:
    pipeline = Pipeline()
    frames = [mask_of(), Frame(mask=mask_of(), index=7), mask_of()]
    assert [pipeline.process(frame).index for frame in frames] == [0, 7, 8]
    assert pipeline.detect(mask_of()).index == 0
    assert pipeline.trace(mask_of()).result.index == 0
