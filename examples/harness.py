"""A wiring harness: branches, branch points, and the routes from the trunk to each connector."""

import cv2
import numpy as np

import dloftbs

mask = np.zeros((360, 480), np.uint8)
trunk = [(30, 180), (220, 180)]
branches = [[(220, 180), (330, 90), (440, 70)], [(220, 180), (330, 270), (440, 300)]]
cv2.polylines(mask, [np.array(trunk)], False, 255, 13)
for branch in branches:
    cv2.polylines(mask, [np.array(branch)], False, 255, 9)

result = dloftbs.detect(mask, branched=True)
for point in result.branch_points:
    print("branch point at", np.round(point.position, 1), "joins", len(point.members), "ends")
for harness in result.harnesses:
    print(f"harness of {len(harness.branches)} branches, {harness.length:.0f} px of cable, {len(harness.ends)} ends")
for route in result.routes:
    print(f"route of {route.curve.length:.0f} px to", route.curve.end.round(1))
result.save("harness.png")
result.save("harness.jsonl")
