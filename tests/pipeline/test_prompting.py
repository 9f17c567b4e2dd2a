"""Tracks prompt a segmenter that takes prompts."""

from __future__ import annotations

import builders
import cv2
import numpy as np
import pytest
from drawings import draw_cable, wave

from dloftbs import Pipeline, Prompt
from dloftbs.data.frame import Frame
from dloftbs.data.prediction import Prediction
from dloftbs.errors import InputError
from dloftbs.pipeline.prompting import make_prompt

SIZE = (120, 200)
RED, GROUND = (30, 20, 210), (90, 120, 90)


def picture(*cables, decoy=False):
    """A picture of red cables, and of a red tool that is none."""
    image = np.full((*SIZE, 3), GROUND, np.uint8)
    for cable in cables:
        image[cable > 0] = RED
    if decoy:
        cv2.line(image, (20, 110), (180, 110), RED, 7)
    return image


def moving(i):
    return draw_cable(wave((80, 200), 1.0, 0.05 * i), 7, SIZE)


class Clicked:
    """A fake network: what is red and hangs together with a point, and with none beside a cable."""

    def __init__(self):
        self.prompts = []

    def __call__(self, image, prompt):
        self.prompts.append(prompt)
        red = (image == RED).all(axis=2)
        if not len(prompt.boxes):
            return red
        _, labels = cv2.connectedComponents(red.astype(np.uint8))
        (on, off) = (
            labels[tuple(np.rint(points[:, ::-1]).astype(int).T)] for points in (prompt.points, prompt.negative)
        )
        return np.isin(labels, sorted(set(on.tolist()) - set(off.tolist()) - {0}))


def test_a_prompted_network_follows_the_cable_alone():
    network = Clicked()
    pipeline = Pipeline(segmenter=network)
    for i in range(8):
        result = pipeline.process(picture(moving(i), decoy=i >= 4))
        assert [len(result.detections), len(result.tracks)] == [1, 1]

    assert [len(prompt.boxes) for prompt in network.prompts] == [0] + [1] * 7
    last = network.prompts[-1]
    assert (last.mask == (moving(6) > 0)).all()
    columns, rows = np.rint(last.points).astype(int).T
    assert (moving(7)[rows, columns] > 0).all()
    assert len(last.points) == 8
    columns, rows = np.rint(last.negative).astype(int).T
    assert len(last.negative) >= 4
    assert not moving(7)[rows, columns].any()
    (x0, y0, x1, y1), (ys, xs) = last.boxes[0], np.nonzero(moving(7))
    assert np.abs(np.array([x0, y0, x1, y1]) - [xs.min(), ys.min(), xs.max(), ys.max()]).max() < 4.0


@pytest.mark.parametrize("failure", [0, 255], ids=["empty", "full"])
def test_a_mask_that_fails_does_not_end_the_prompts(failure):
    class Failing(Clicked):
        def __call__(self, image, prompt):
            mask = super().__call__(image, prompt)
            return np.full(SIZE, failure, np.uint8) if len(self.prompts) in (6, 7) else mask

    network = Failing()
    pipeline = Pipeline(segmenter=network)
    results = [pipeline.process(picture(moving(i), decoy=i >= 4)) for i in range(12)]
    assert [len(result.detections) for result in results] == [1] * 5 + [0] * 2 + [1] * 5
    assert {track.id for result in results for track in result.tracks} == {1}
    assert network.prompts[6] is network.prompts[7] is network.prompts[5]


@pytest.mark.parametrize(("stamp", "times"), [(0.0, 1), (1.0, 2)], ids=["an older stamp", "another size"])
def test_after_a_failure_a_frame_of_another_stream_has_an_empty_prompt(stamp, times):
    class Failing(Clicked):
        def __call__(self, image, prompt):
            mask = super().__call__(image, prompt)
            return np.zeros_like(mask) if len(self.prompts) == 5 else mask

    network = Failing()
    pipeline = Pipeline(segmenter=network)
    for i in range(5):
        pipeline.process(Frame(image=picture(moving(i)), stamp=0.5 + 0.04 * i))
    pipeline.process(Frame(image=np.repeat(picture(moving(5)), times, axis=0), stamp=stamp))
    last = network.prompts[-1]
    assert (len(last.boxes), len(last.points), last.mask) == (0, 0, None)


@pytest.mark.parametrize(("stamp", "times"), [(0.0, 1), (1.0, 2)], ids=["an older stamp", "another size"])
def test_a_frame_of_another_stream_has_an_empty_prompt(stamp, times):
    network = Clicked()
    pipeline = Pipeline(segmenter=network)
    for i in range(4):
        pipeline.process(Frame(picture(moving(i)), stamp=0.5 + i / 30))
    pipeline.process(Frame(np.tile(picture(moving(4)), (1, times, 1)), stamp=stamp))
    assert [len(prompt.boxes) for prompt in network.prompts] == [0, 1, 1, 1, 0]


def test_a_frame_by_itself_has_an_empty_prompt():
    network = Clicked()
    pipeline = Pipeline(segmenter=network)
    for i in range(3):
        pipeline.process(picture(moving(i)))
    pipeline.detect(picture(moving(3)))
    pipeline.trace(picture(moving(3)))
    pipeline.reset()
    pipeline.process(picture(moving(4)))
    for prompt in network.prompts[-3:]:
        assert prompt.mask is None
        assert [len(part) for part in (prompt.points, prompt.owner, prompt.negative, prompt.boxes)] == [0] * 4


def test_a_mask_of_the_frame_goes_before_the_network():
    network = Clicked()
    Pipeline(segmenter=network).process(Frame(image=picture(moving(0)), mask=moving(0)))
    assert network.prompts == []


def test_coordinates_are_those_of_the_region_of_interest():
    network = Clicked()
    pipeline = Pipeline(segmenter=network, roi=(10, 0, 180, 100))
    for i in range(4):
        pipeline.process(picture(moving(i)))
    last = network.prompts[-1]
    assert last.mask.shape == (100, 180)
    columns, rows = np.rint(last.points).astype(int).T
    assert (moving(3)[:100, 10:190][rows, columns] > 0).all()


def no_prompt(image, threshold=150):
    return image[..., 2] > threshold


def by_name(image, prompt=None):
    assert isinstance(prompt, Prompt)
    return image[..., 2] > 150


def by_place(image, /, clicks):
    assert isinstance(clicks, Prompt)
    return image[..., 2] > 150


@pytest.mark.parametrize("segmenter", [no_prompt, by_name, by_place, lambda image, **_: no_prompt(image)])
def test_only_a_function_of_two_arguments_gets_a_prompt(segmenter):
    assert len(Pipeline(segmenter=segmenter).process(picture(moving(0))).detections) == 1


def predicted(start, end, width=6.0, **options):
    return Prediction(builders.line(start, end), 1.0, width_px=width, **options)


def test_points_lie_on_what_was_seen():
    one = predicted((10.0, 40.0), (170.0, 40.0), inferred=((0.25, 0.75),), unseen=((0.0, 0.125),))
    prompt = make_prompt([one], None, SIZE)

    x = prompt.points[:, 0]
    assert np.allclose(prompt.points[:, 1], 40.0)
    assert ((x > 30.0) & (x < 50.0)).sum() == 3  # an eighth and a quarter of the curve are left
    assert ((x > 130.0) & (x < 170.0)).sum() == 5
    assert np.allclose(prompt.boxes, [[27.0, 37.0, 173.0, 43.0]], atol=0.1)
    assert set(np.round(prompt.negative[:, 1])) == {28.0, 52.0}


def test_each_object_has_its_points_and_its_box():
    hidden = predicted((10.0, 90.0), (170.0, 90.0), inferred=((0.0, 1.0),))
    away = predicted((10.0, 300.0), (170.0, 300.0))
    unknown = predicted((10.0, 60.0), (170.0, 60.0), width=None)
    two = [predicted((10.0, 20.0), (170.0, 20.0)), predicted((10.0, 32.0), (260.0, 32.0))]
    prompt = make_prompt([hidden, away, unknown, *two], None, SIZE)

    assert len(prompt.boxes) == 2
    assert prompt.boxes[1][2] == SIZE[1] - 1  # the picture's edge
    for number, y in enumerate((20.0, 32.0)):
        assert np.allclose(prompt.points[prompt.owner == number][:, 1], y)
    assert (prompt.points[:, 0] <= SIZE[1] - 1).all()
    assert set(np.round(prompt.negative[:, 1])) == {8.0, 44.0}  # 20 + 12 and 32 - 12 are on the other


def test_what_is_set_is_no_ground():
    one = predicted((10.0, 40.0), (170.0, 40.0))
    mask = np.zeros(SIZE, np.uint8)
    mask[45:60] = 255
    assert set(np.round(make_prompt([one], mask, SIZE).negative[:, 1])) == {28.0}
    assert make_prompt([one], mask[1:], SIZE).mask is None


def test_nothing_tracked_is_an_empty_prompt_with_the_mask():
    prompt = make_prompt([], np.ones(SIZE, bool), SIZE)
    assert len(prompt.boxes) == 0
    assert prompt.mask.all()


def test_a_prompt_is_read_only_and_checked():
    prompt = Prompt(points=[[1, 2]], owner=[0], boxes=[[0, 0, 3, 4]], mask=np.ones((2, 2), np.uint8))
    assert prompt.mask.dtype == bool
    for array in (prompt.points, prompt.owner, prompt.negative, prompt.boxes, prompt.mask):
        assert not array.flags.writeable
    for given, message in (
        ({"points": [[1, 2, 3]]}, "points must have shape"),
        ({"points": [[1, 2]]}, "owner must be an integer for each of the 1 points"),
        ({"points": [[1, 2]], "owner": [0.5], "boxes": [[0, 0, 1, 1]]}, "owner must be an integer"),
        ({"points": [[1, 2]], "owner": [1], "boxes": [[0, 0, 1, 1]]}, "owner must be rows of the 1 boxes, got 1 to 1"),
        ({"boxes": [[0, 0, 1]]}, "boxes must have shape"),
        ({"mask": np.zeros(3)}, "mask must have shape"),
    ):
        with pytest.raises(InputError, match=message):
            Prompt(**given)
