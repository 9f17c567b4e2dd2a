"""A robot's loop: each frame in, a grasp pose and the answer whether it may be trusted out, with depth in metres."""

import cv2
import numpy as np

import dloftbs

CAMERA = dloftbs.PinholeCamera(fx=450.0, fy=450.0, cx=239.5, cy=179.5)


def camera_frames(count=10):
    """Yield images and depth (uint16 millimetres) of a cable 5 mm above a table that is 0.6 m away, as a driver does."""
    t = np.linspace(0.0, 2.0 * np.pi, 400)
    for i in range(count):
        image, depth = np.full((360, 480, 3), (90, 120, 90), np.uint8), np.full((360, 480), 600, np.uint16)
        points = np.stack((60.0 + 57.0 * t, 180.0 + (60.0 + i) * np.sin(t)), axis=1).round().astype(np.int32)
        cv2.polylines(image, [points], False, (30, 20, 210), 9)
        cv2.polylines(depth, [points], False, 595, 9)
        yield image, depth


pipeline = dloftbs.Pipeline(hsv="red", objects=1)
for index, (image, depth) in enumerate(camera_frames()):
    frame = dloftbs.Frame(image=image, depth=depth, camera=CAMERA, index=index)
    result = pipeline.process(frame)
    if not result.tracks:
        print(index, "wait:", result.reason)
        continue
    track = result.tracks[0]
    if track.curve_3d is None or track.confidence < 0.9:
        print(index, "wait: not sure enough")
        continue
    poses = track.curve_3d.poses([0.25, 0.5, 0.75])  # (3, 4, 4), x along the cable
    print(index, f"{track.curve_3d.length:.3f} m; grasp at", poses[1][:3, 3].round(3), f"{result.total_ms:.1f} ms")
