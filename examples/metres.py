"""From a mask and depth to metres: where the end is, how long the cable is, how tight it bends, and a mesh of it."""

import cv2
import numpy as np

import dloftbs

CAMERA = dloftbs.PinholeCamera(fx=450.0, fy=450.0, cx=239.5, cy=179.5)  # or .from_file("camera_info.yaml")

t = np.linspace(0.0, np.pi, 400)
points = np.stack((240.0 - 150.0 * np.cos(t), 260.0 - 150.0 * np.sin(t)), axis=1).round().astype(np.int32)
mask, depth = np.zeros((360, 480), np.uint8), np.full((360, 480), 800, np.uint16)  # millimetres
cv2.polylines(mask, [points], False, 255, 11)
depth[mask > 0] = 790  # a half circle of 0.26 m, 10 mm above the table

found = dloftbs.detect(mask, depth=depth, camera=CAMERA)
cable = found[0]
if cable.curve_3d is None:
    raise SystemExit(cable.no_3d_reason)
print("end at", cable.curve_3d.end.round(3), "m, in the camera's frame: x right, y down, z forward")
print(f"length {cable.curve_3d.length:.3f} m, thickness {1e3 * cable.width_m:.1f} mm")
u, radius = cable.tightest_bend_3d()
print(f"tightest bend {radius:.3f} m at {u:.0%} of the length")
print("standard deviation at start, middle and end, mm:", (1e3 * cable.curve_3d_std([0.0, 0.5, 1.0])).round(2))
print("grasp points every 5 cm:", cable.curve_3d.sample(spacing=0.05).round(3).tolist())
found.save("cable.ply")
