"""Your own network as the segmenter: any function from an image to a mask, or to a probability."""

import cv2
import numpy as np

import dloftbs


def my_network(image):
    """Return the probability of cable (H, W), float32: here the distance from the colour of the table stands for one."""
    far = np.linalg.norm(image.astype(np.float32) - (90.0, 120.0, 90.0), axis=2)
    return np.clip(far / 120.0, 0.0, 1.0).astype(np.float32)


def draw_photo(shift):
    """Return a picture of a grey and a blue cable that cross."""
    image = np.full((360, 480, 3), (90, 120, 90), np.uint8)
    t = np.linspace(0.0, 2.0 * np.pi, 400)
    for colour, sign in (((200, 200, 200), 1.0), ((210, 90, 30), -1.0)):
        points = np.stack((50.0 + 60.0 * t, 180.0 + shift + sign * 70.0 * np.cos(t / 2.0)), axis=1)
        cv2.polylines(image, [points.round().astype(np.int32)], False, colour, 9, cv2.LINE_AA)
    return image


found = dloftbs.detect(draw_photo(0.0), segmenter=my_network)
for crossing in found.crossings:
    print("crossing at", np.round(crossing.position, 1), "on top:", crossing.top, f"sure to {crossing.confidence:.0%}")
found.save("overlay.png")

pipeline = dloftbs.Pipeline(segmenter=my_network)  # a stream: ids are kept
for i in range(5):
    result = pipeline.process(draw_photo(3.0 * i))
    print([(track.id, round(track.curve.length)) for track in result.tracks])
# An ONNX file needs no code: dloftbs.Pipeline(segmenter="cables.onnx"), with the extra `onnx`.
