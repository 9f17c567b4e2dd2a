"""A live camera: `python live_camera.py 0` follows the cables before camera 0; without a number, a camera that is made up."""

import sys
from time import perf_counter

import cv2
import numpy as np

import dloftbs


class FakeCamera:
    """Gives 30 pictures of a moving orange cable, with the methods of `cv2.VideoCapture`."""

    count = 0

    def isOpened(self):
        return True

    def grab(self):
        return self.count < 30

    def read(self):
        self.count += 1
        image = np.full((360, 480, 3), (110, 100, 100), np.uint8)
        t = np.linspace(0.0, 5.0, 300)
        points = np.stack((60.0 + 72.0 * t, 180.0 + 60.0 * np.sin(t + 0.1 * self.count)), axis=1)
        cv2.polylines(image, [points.round().astype(np.int32)], False, (0, 130, 250), 9, cv2.LINE_AA)
        return self.count <= 30, image


camera = cv2.VideoCapture(int(sys.argv[1])) if len(sys.argv) > 1 else FakeCamera()
frames, since = 0, perf_counter()
for result in dloftbs.track(camera, hsv="orange"):
    frames += 1
    for track in result.tracks:
        print(f"frame {result.index}, cable {track.id}: ends at {track.curve.end.round(1)}, {result.total_ms:.1f} ms")
print(f"{frames / (perf_counter() - since):.0f} frames/s")
