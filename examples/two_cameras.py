"""Two cameras without depth: a cable in space from two masks, in metres, with its standard deviation."""

import cv2
import numpy as np

import dloftbs

CAMERA = dloftbs.PinholeCamera(fx=450.0, fy=450.0, cx=239.5, cy=179.5)
RIGHT = np.eye(4)
RIGHT[0, 3] = 0.12  # the right camera stands 12 cm to the right; or CameraRig.from_file("camchain.yaml")

rig = dloftbs.CameraRig([CAMERA, CAMERA], [np.eye(4), RIGHT])

t = np.linspace(0.0, 1.0, 400)
axis = np.stack((0.5 * t - 0.2, 0.12 * np.sin(6.0 * t), 0.8 + 0.1 * t), axis=1)  # metres
masks = []
for pixels in rig.project(axis):
    masks.append(np.zeros((360, 480), np.uint8))
    cv2.polylines(masks[-1], [(16.0 * pixels).round().astype(np.int32)], False, 255, 7, shift=4)

result = rig.detect(masks)
for cable in result:
    if cable.curve_3d is None:
        print("no curve in space:", cable.no_3d_reason)
        continue
    off = [cable.curve_3d.nearest(point)[1] for point in axis]
    print(f"length {cable.curve_3d.length:.3f} m, end at {cable.curve_3d.end.round(3)}")
    print(f"off the true axis: {1e3 * np.mean(off):.2f} mm in the mean")
    print("stated deviation, mm:", (1e3 * cable.curve_3d_std([0.1, 0.5, 0.9])).round(2))
# A stream: pipeline = dloftbs.StereoPipeline(rig); pipeline.process([left, right]).tracks
