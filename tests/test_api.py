"""The two ways in: whatever a frame or a stream is, and what is none."""

from __future__ import annotations

import io
import json
import logging
from collections.abc import Callable
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from drawings import draw_cable, wave

import dloftbs
from dloftbs import Config, ConfigError, Frame, HsvRange, InputError, PinholeCamera, Pipeline, SourceError
from dloftbs.config import LinkingConfig
from dloftbs.data.run_lengths import encode

SIZE = (120, 200)
RED = "170:10,80:255,60:255"
CAMERA = PinholeCamera(300.0, 300.0, 100.0, 60.0)


def mask_of(shift: float = 0.0) -> np.ndarray:
    return draw_cable(wave(SIZE, 1.0, shift), 7, SIZE) != 0


def image_of(mask: np.ndarray) -> np.ndarray:
    image = np.full((*SIZE, 3), 90, np.uint8)
    image[mask] = (30, 20, 210)
    return image


def video_of(image: np.ndarray, count: int) -> bytes:
    """Return a video of a picture that stands still, without loss."""
    file = io.BytesIO()
    with av.open(file, "w", format="matroska") as container:
        stream = container.add_stream("ffv1", rate=10)
        stream.height, stream.width = image.shape[:2]
        stream.pix_fmt = "bgr0"
        for _ in range(count):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="bgr24")))
        container.mux(stream.encode())
    return file.getvalue()


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
            assert "the median of the depth is 500 m, beyond lifting.max_depth_m (20 m)" in str(found.no_3d_reason)
            assert "floating-point depth is taken for metres; is it in metres?" in str(found.no_3d_reason)
        (found,) = dloftbs.detect(mask_of(), depth=np.zeros(SIZE), camera=CAMERA)
        assert "metres" not in str(found.no_3d_reason)

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
            (np.full((9, 9), 3.0), {}, r"mask must be a probability in 0\.\.1 .*, got 3\.\.3; of scores, give"),
            (
                np.zeros((9, 9, 3), np.uint8),
                {},
                r"is cable: give its colour.*if the image is a mask itself, .*\[\.\.\., 0\]",
            ),
            (np.zeros((9, 9, 3)), {}, "image must have shape .* and type uint8"),
            (
                np.zeros((9, 9, 4), np.uint8),
                {},
                r"four channels: image\[\.\.\., :3\] if they are BGRA, image\[\.\.\., 2::-1\]",
            ),
            (np.zeros((3, 9, 9), np.uint8), {}, r"channels come last: image\.transpose\(1, 2, 0\)"),
            (np.zeros((1, 3, 9, 9), np.uint8), {}, r"channels come last: image\.transpose\(1, 2, 0\)"),
            (np.zeros((9, 9, 3)), {}, r"scale it first: \(255 \* image\)\.astype\(np\.uint8\) if it is in 0\.\.1"),
            (np.zeros((9, 9, 3), np.uint16), {}, r"reduce it first: \(image >> 8\)"),
            (np.zeros((9, 9, 3), int), {}, r"image\.astype\(np\.uint8\) if it is in 0\.\.255"),
            (np.zeros((7, 9, 9), np.uint8), {}, "track follows a stack"),
            (np.zeros((7, 1, 9, 9), bool), {}, r"got \(7, 1, 9, 9\); track follows a stack"),
            (np.zeros((7, 9, 9, 3), np.uint8), {}, "track follows a stack"),
            (np.zeros((9, 9), bool), {"hsv": RED}, "x is a mask already"),
            (np.zeros((9, 9, 3), np.uint8), {"image": np.zeros((9, 9, 3), np.uint8)}, "x must be a mask"),
            (Frame(mask=np.zeros((9, 9), bool)), {"camera": CAMERA}, "give camera to the Frame"),
            (np.zeros((9, 9), bool), {"camera": (1, 2, 3)}, r"camera must be a PinholeCamera, .*got \(1, 2, 3\)"),
            (np.zeros((9, 9), bool), {"config": 5}, "config must be a Config, the path of a YAML file or a dictionary"),
            (
                np.zeros((9, 9), bool),
                {"depth": "{stem}.npy"},
                r"'\{stem\}\.npy' needs the path of a picture, got array",
            ),
            (None, {}, r"the frame is None \(cv2\.imread returns None"),
            ({"mask": np.zeros((9, 9))}, {}, "the frame must be an array, got a dict with the keys 'mask'$"),
        ],
    )
    def test_what_cannot_be_is_refused_with_the_remedy(self, x: object, given: dict, message: str) -> None:
        with pytest.raises(InputError, match=message):
            dloftbs.detect(x, **given)

    @pytest.mark.parametrize("shape", [(1, *SIZE), (*SIZE, 1), (1, 1, *SIZE), (1, *SIZE, 1)])
    def test_axes_of_one_around_a_mask_are_dropped(self, shape: tuple[int, ...]) -> None:
        assert curves(dloftbs.detect(mask_of().reshape(shape))) == curves(dloftbs.detect(mask_of()))
        assert curves(dloftbs.detect(image_of(mask_of())[None], hsv=RED)) == curves(dloftbs.detect(mask_of()))

    def test_an_image_in_the_other_order_is_said_to_be_one(self) -> None:
        result = dloftbs.detect(image_of(mask_of())[..., ::-1], hsv=RED)
        assert result.reason is not None
        assert "arrays are BGR: turn an RGB one by image[..., ::-1]" in result.reason
        assert "BGR" not in str(dloftbs.detect(np.zeros(SIZE, bool)).reason)

    @pytest.mark.parametrize(
        "camera",
        [
            (300.0, 300.0, 100.0, 60.0),
            [300, 300, 100, 60],
            CAMERA.matrix,
            CAMERA.matrix.tolist(),
            CAMERA.matrix.ravel(),
            CAMERA.to_dict(),
        ],
    )
    def test_a_camera_may_be_its_numbers(self, camera: object) -> None:
        depth = np.full(SIZE, 500, np.uint16)
        (expected,) = dloftbs.detect(mask_of(), depth=depth, camera=CAMERA)
        (found,) = dloftbs.detect(mask_of(), depth=depth, camera=camera)
        assert found.curve_3d == expected.curve_3d

    @pytest.mark.parametrize("given", [{"hsv": "rosso"}, {"hsv": 5}, {"objects": 0}, {"objects": "two"}])
    def test_a_wrong_choice_is_refused(self, given: dict) -> None:
        with pytest.raises(ConfigError):
            dloftbs.detect(np.zeros((9, 9, 3), np.uint8), **given)


class TestFiles:
    """Files in the place of arrays, in every argument that takes them."""

    @pytest.fixture(autouse=True)
    def _files(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.chdir(tmp_path)
        cv2.imwrite("mask.png", mask_of().astype(np.uint8) * 255)
        cv2.imwrite("photo.png", image_of(mask_of()))
        cv2.imwrite("photo_depth.png", np.full(SIZE, 500, np.uint16))
        np.save("depth.npy", np.full(SIZE, 0.5, np.float32))
        np.savez("depth.npz", depth=np.full((1, *SIZE), 0.5, np.float32))
        np.savez("depths.npz", depth=np.full((2, *SIZE), 0.5, np.float32))
        Path("camera.json").write_text(json.dumps(CAMERA.to_dict()), encoding="utf-8")
        Path("cable.yaml").write_text(f"segmentation: {{hsv: '{RED}'}}", encoding="utf-8")

    @pytest.mark.parametrize("make", [str, Path])
    def test_a_picture_is_read(self, make: Callable[[str], object]) -> None:
        expected = curves(dloftbs.detect(mask_of()))
        result = dloftbs.detect(make("photo.png"), hsv=RED)
        assert curves(result) == expected
        assert (result.name, result.index) == ("photo.png", 0)
        assert curves(dloftbs.detect(make("mask.png"))) == expected
        assert curves(dloftbs.detect(make("photo.png"), config=make("cable.yaml"))) == expected

    @pytest.mark.parametrize("depth", ["photo_depth.png", Path("depth.npy"), "depth.npz"])
    @pytest.mark.parametrize("x", [mask_of(), "mask.png"], ids=["array", "file"])
    def test_what_goes_beside_is_read(self, x: object, depth: object) -> None:
        (found,) = dloftbs.detect(x, image="photo.png", depth=depth, camera="camera.json", occluders=Path("mask.png"))
        assert found.curve_3d is not None
        assert found.curve_3d(0.5)[2] == pytest.approx(0.5, abs=0.02)
        frame = dloftbs.detect(x, image="photo.png", occluders=Path("mask.png")).frame
        assert frame is not None
        np.testing.assert_array_equal(frame.image, image_of(mask_of()))
        np.testing.assert_array_equal(frame.occluders != 0, mask_of())

    def test_a_naming_rule_finds_the_depth_beside_a_picture(self) -> None:
        (found,) = dloftbs.detect("photo.png", hsv=RED, depth="{stem}_depth.png", camera=Path("camera.json"))
        assert found.curve_3d is not None

    def test_a_configuration_may_be_a_file_or_a_dictionary(self) -> None:
        images = [image_of(mask_of())] * 2
        dictionary = {"segmentation": {"hsv": RED}}
        for config in ("cable.yaml", Path("cable.yaml"), dictionary):
            assert [len(result) for result in dloftbs.track(images, config=config)] == [1, 1]
            assert Pipeline(config).config == Config.from_dict(dictionary)

    @pytest.mark.parametrize(
        ("x", "given", "error", "message"),
        [
            ("no.png", {}, SourceError, r"there is no file 'no\.png'"),
            (Path("no.mp4"), {}, SourceError, r"there is no file 'no\.mp4'"),
            (".", {}, InputError, r"expected the file of one picture, got '\.'; track\('\.'\) follows a stream"),
            ("0", {}, InputError, r"track\('0'\) follows a stream"),
            ("rtsp://camera/1", {}, InputError, r"track\('rtsp://camera/1'\) follows a stream"),
            ("cable.mkv", {}, InputError, r"'cable\.mkv' holds several; track\('cable\.mkv'\) follows a stream"),
            ("stack.npy", {}, InputError, r"'stack\.npy' holds several; track"),
            ("photo.png", {"hsv": RED, "depth": "no.png"}, SourceError, r"depth: there is no file 'no\.png'"),
            ("photo.png", {"hsv": RED, "depth": "{stem}.exr"}, SourceError, r"depth: there is no file 'photo\.exr'"),
            ("photo.png", {"hsv": RED, "depth": "depths.npz"}, SourceError, "depth must hold one frame, got 2"),
            ("photo.png", {"hsv": RED, "occluders": "no.png"}, SourceError, "occluders: there is no file"),
            ("mask.png", {"image": "no.png"}, SourceError, "there is no file"),
            ("mask.png", {"camera": "no.json"}, SourceError, r"no\.json: cannot be read"),
            ("mask.png", {"config": "no.yaml"}, ConfigError, r"no\.yaml: cannot be read"),
            ("mask.png", {"config": "fitting:\n  knots: 5"}, InputError, r"pass Config\.from_yaml\(text\)"),
            ("photo.png", {"segmenter": "no.onnx"}, ConfigError, "no file 'no.onnx'|needs ONNX Runtime"),
            ("photo.png", {"segmenter": "net.pt"}, InputError, r"the path of a network \(\*\.onnx\), got 'net\.pt'"),
        ],
    )
    def test_the_rest_is_refused_with_the_call(
        self, x: object, given: dict, error: type[Exception], message: str
    ) -> None:
        np.save("stack.npy", np.stack([mask_of()] * 2))
        Path("cable.mkv").write_bytes(video_of(image_of(mask_of()), 3))
        with pytest.raises(error, match=message):
            dloftbs.detect(x, **given)

    def test_a_grey_picture_is_an_image_where_there_is_a_colour(self) -> None:
        grey = np.where(mask_of(), np.uint8(30), np.uint8(150))
        cv2.imwrite("grey.png", grey)
        np.save("stack.npy", np.stack([grey, grey]))
        dark = {"segmentation": {"hsv": "black"}}
        for x in (grey, grey[..., None], "grey.png"):
            for given in ({"hsv": "black"}, {"config": dark}, {"segmenter": lambda image: image[..., 0] < 90}):
                (found,) = dloftbs.detect(x, **given)
                (expected,) = dloftbs.detect(mask_of())
                assert found.width_px == expected.width_px
        for stream in ([grey, grey], np.stack([grey, grey]), "stack.npy"):
            assert [len(result) for result in dloftbs.track(stream, hsv="black")] == [1, 1]

    def test_a_grey_picture_has_no_hue(self) -> None:
        grey = np.where(mask_of(), np.uint8(30), np.uint8(150))
        reason = dloftbs.detect(grey, hsv=RED).reason
        assert reason is not None
        assert "it is grey, and the colour asks for saturation" in reason
        assert "if it is a mask, leave the colour out" in reason

    def test_a_black_picture_is_dark(self) -> None:
        """As the first ones of a webcam."""
        black = np.zeros((*mask_of().shape, 3), np.uint8)
        assert "it is dark: the colour asks for a brightness of 40" in (
            dloftbs.detect(black, hsv="orange").reason or ""
        )

    def test_an_array_of_bool_is_a_mask_beside_a_colour(self) -> None:
        config = {"segmentation": {"hsv": RED}}
        assert len(dloftbs.detect(mask_of() != 0, config=config)) == 1
        with pytest.raises(InputError, match=r"uint16; if it is a mask, give Frame\(mask=array\) or array != 0"):
            dloftbs.detect(mask_of().astype(np.uint16), config=config)

    def test_a_capture_is_followed_until_it_ends(self) -> None:
        Path("cable.mkv").write_bytes(video_of(image_of(mask_of()), 3))
        capture = cv2.VideoCapture("cable.mkv")
        results = list(dloftbs.track(capture, hsv=RED))
        assert [(result.index, [track.id for track in result.tracks]) for result in results] == [
            (index, [1]) for index in range(3)
        ]
        assert capture.isOpened()
        capture.release()
        with pytest.raises(SourceError, match="the capture is not open"):
            dloftbs.track(capture, hsv=RED)

    def test_the_values_of_a_mask_are_what_is_said_of_them(self, tmp_path: Path) -> None:
        soft = np.zeros((240, 640), np.uint8)
        soft[116:125, 15:625], soft[116:125, 215:425] = 255, 100
        for name in ("a.png", "a.jpg"):
            cv2.imwrite(str(tmp_path / name), soft, [cv2.IMWRITE_JPEG_QUALITY, 100])
            assert len(dloftbs.detect(tmp_path / name, mask_is="probability")) == 1
            assert [len(result) for result in dloftbs.track(str(tmp_path / name), mask_is="probability")] == [1]
        assert len(dloftbs.detect(tmp_path / "a.jpg", mask_is="binary")) == 2
        with pytest.raises(SourceError, match=r"a\.jpg: a lossy codec changes numbers"):
            dloftbs.detect(tmp_path / "a.jpg", mask_is="labels")

    def test_floating_point_is_binary_where_that_is_said(self, tmp_path: Path) -> None:
        unsure = mask_of().astype(np.float32) * 0.3
        stack = np.stack([unsure] * 2)
        np.savez(tmp_path / "a.npz", masks=stack)
        cv2.imwrite(str(tmp_path / "a.tif"), unsure)
        assert len(dloftbs.detect(tmp_path / "a.tif", mask_is="binary")) == 1
        for frames in ([unsure] * 2, stack, tmp_path / "a.npz"):
            assert [len(result) for result in dloftbs.track(frames, mask_is="binary")] == [1, 1]
            assert [len(result) for result in dloftbs.track(frames)] == [0, 0]


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

    def test_a_mask_that_is_mostly_set_is_refused_and_ends_no_track(self) -> None:
        steady = [mask_of()] * 4
        results = list(dloftbs.track([*steady, ~mask_of(), *steady]))
        assert [len(result) for result in results] == [1, 1, 1, 1, 0, 1, 1, 1, 1]
        share = 100 * (~mask_of()).mean()
        assert str(results[4].reason).startswith(
            f"{share:.3g} % of the mask is set, after {100 - share:.3g} %: the seg"
        )
        assert [track.state.value for track in results[4].tracks] == ["hidden"]
        assert dloftbs.detect(~mask_of()).reason == (
            f"{share:.3g} % of the mask is set, and cables cover at most 60 %: if it is inverted, turn it round "
            "(mask == 0); if it is a photograph or scores, threshold it"
        )
        assert {track.id for result in results for track in result.tracks} == {1}
        segmented = dloftbs.detect(image_of(mask_of()), segmenter=lambda image: image[..., 2] < 200)
        assert "the segmentation takes the ground for cable: narrow it" in str(segmented.reason)

    def test_the_published_method_takes_it_as_it_is(self) -> None:
        assert "cables cover" not in str(dloftbs.detect(~mask_of(), config=Config.paper()).reason)

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
            ({"a": np.zeros((9, 9))}, {}, "or an iterable of frames, got a dict with the keys 'a'$"),
            (np.zeros((9, 9, 1), bool), {}, "got a single frame"),
            (np.zeros((5, 3, 9, 9), np.uint8), {}, r"channels come last: images\.transpose\(0, 2, 3, 1\)"),
            (np.zeros((5, 9, 9, 4), np.uint8), {}, r"four channels: images\[\.\.\., :3\]"),
            (np.full((5, 9, 9), 3.0), {}, r"mask must be a probability in 0\.\.1 .*, got 3\.\.3; of scores"),
            ([], {"config": 5}, "config must be a Config"),
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
        with pytest.raises(InputError, match="the frame is None"):
            next(results)

    def test_arrays_of_several_sizes_in_one_are_frames(self) -> None:
        frames = np.empty(2, object)
        frames[:] = [self.MASKS[0], self.MASKS[0][:100]]
        assert [result.size for result in dloftbs.track(frames)] == [SIZE, (100, 200)]


def test_a_pipeline_counts_arrays_and_keeps_the_numbers_of_frames() -> None:
    pipeline = Pipeline()
    frames = [mask_of(), Frame(mask=mask_of(), index=7), mask_of()]
    assert [pipeline.process(frame).index for frame in frames] == [0, 7, 8]
    assert pipeline.detect(mask_of()).index == 0
    assert pipeline.trace(mask_of()).result.index == 0


class TestInstances:
    """A mask per object, as segmenters give it."""

    SHORT = np.zeros(SIZE, bool)
    SHORT[98:103, 20:180] = True
    MASKS = (np.roll(SHORT, -60, axis=0), SHORT)
    SAM = tuple({"segmentation": mask, "area": int(mask.sum())} for mask in MASKS)

    class Detections:
        def __init__(self, mask: np.ndarray) -> None:
            self.mask = mask

    FORMS = (
        list(SAM),
        list(MASKS),
        np.stack(MASKS),
        np.select(MASKS, [1, 2]),
        [{"segmentation": encode(mask)} for mask in MASKS],
        Detections(np.stack(MASKS)),
    )

    @pytest.mark.parametrize("instances", FORMS, ids=["sam", "list", "stack", "labels", "run lengths", "detections"])
    def test_every_form_is_taken_alone_and_beside(self, instances: object) -> None:
        expected = curves(dloftbs.detect(self.MASKS[0] | self.MASKS[1]))
        image = image_of(self.MASKS[0])
        for result in (
            dloftbs.detect(instances=instances),
            dloftbs.detect(image, instances=instances),
            dloftbs.detect(instances=instances, image=image),
            dloftbs.detect(Frame(instances=instances)),
            dloftbs.detect(self.MASKS[0] | self.MASKS[1], instances=instances),
        ):
            assert len(result) == len(expected) == 2
            assert result.frame is not None
            np.testing.assert_array_equal(result.frame.instances, np.select(self.MASKS, [1, 2]))
        assert curves(dloftbs.detect(self.MASKS[1], instances=instances)) == curves(dloftbs.detect(self.MASKS[1]))

    def test_depth_and_a_camera_go_with_them(self) -> None:
        depth = np.full(SIZE, 0.5, np.float32)
        for found in dloftbs.detect(instances=list(self.SAM), depth=depth, camera=CAMERA):
            assert found.curve_3d is not None

    def test_no_object_in_an_image_is_an_empty_result(self) -> None:
        assert dloftbs.detect(image_of(self.MASKS[0]), instances=[]).reason == "the mask is empty"

    def test_labels_that_a_mask_holds_stay_the_mask(self) -> None:
        labels = np.select(self.MASKS, [1, 2]).astype(np.uint8)
        for mask_is, instances in (("auto", None), ("labels", labels)):
            result = dloftbs.detect(labels, mask_is=mask_is)
            np.testing.assert_array_equal(result.frame.mask, labels)
            np.testing.assert_array_equal(result.frame.instances, instances)

    def test_a_region_cuts_them(self) -> None:
        (found,) = dloftbs.detect(instances=list(self.SAM), roi=(0, 80, 200, 40))
        assert found.curve(0.5)[1] == pytest.approx(100.0, abs=1.0)

    def test_a_stream_of_them(self) -> None:
        frames = (Frame(instances=[np.roll(self.MASKS[0], t, axis=0), self.SHORT]) for t in range(4))
        *_, last = dloftbs.track(frames)
        assert [track.id for track in last.tracks] == [1, 2]

    @pytest.mark.parametrize("form", ["{stem}_mask_*.png", "{stem}.json", "labels.png", "stack.npy", "sam.json"])
    def test_files(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, form: str) -> None:
        monkeypatch.chdir(tmp_path)
        cv2.imwrite("photo.jpg", image_of(self.MASKS[0]))
        for k, mask in enumerate(self.MASKS):
            cv2.imwrite(f"photo_mask_{k}.png", mask.astype(np.uint8) * 255)
        cv2.imwrite("labels.png", np.select(self.MASKS, [1, 2]).astype(np.uint16))
        np.save("stack.npy", np.stack(self.MASKS))
        sam = [{"segmentation": encode(mask)} for mask in self.MASKS]
        for name in ("photo.json", "sam.json"):
            Path(name).write_text(json.dumps(sam), encoding="utf-8")
        given = [("photo.jpg", None), (None, "photo.jpg"), (Path("photo.jpg"), None)]
        for x, image in given if "{stem}" in form else [*given, (None, None), (image_of(self.MASKS[0]), None)]:
            result = dloftbs.detect(x, image=image, instances=form)
            assert result.frame is not None
            np.testing.assert_array_equal(result.frame.instances, np.select(self.MASKS, [1, 2]))

    @pytest.mark.parametrize("x", [list(SAM), SAM, Detections(np.stack(MASKS)), SAM[0], np.stack(MASKS), list(MASKS)])
    def test_what_they_are_taken_for_says_where_they_go(self, x: object) -> None:
        for call in (dloftbs.detect, Pipeline().process):
            with pytest.raises(InputError, match=r"give detect\(instances=x\).* Frame\(instances=x\)"):
                call(x)

    def test_a_stream_of_dictionaries_says_so_at_once(self) -> None:
        for frames in (list(self.SAM), self.Detections(np.stack(self.MASKS))):
            with pytest.raises(
                InputError, match=r"got the masks of one frame's objects, .*detect\(instances=x\) takes"
            ):
                dloftbs.track(frames)
        with pytest.raises(InputError, match=r"Frame\(instances=x\)"):
            list(dloftbs.track([list(self.SAM), list(self.SAM)]))

    @pytest.mark.parametrize(
        ("x", "given", "message"),
        [
            (None, {"instances": []}, "an empty list, of which nothing says the size"),
            (image_of(MASKS[0]), {"instances": MASKS, "hsv": RED}, "the instances are a mask already"),
            (None, {"instances": MASKS, "segmenter": lambda image: image[..., 0]}, "the instances are a mask already"),
            (Frame(mask=SHORT), {"instances": MASKS}, "give instances to the Frame"),
            (SHORT[:50], {"instances": MASKS}, r"instances\[0\] must have the size \(50, 200\)"),
            (SHORT, {"instances": "{stem}_*.png"}, "needs frames in files of their own"),
        ],
    )
    def test_what_cannot_be_is_refused(self, x: object, given: dict, message: str) -> None:
        with pytest.raises(InputError, match=message):
            dloftbs.detect(x, **given)
