"""A photograph: find the cable by its colour, print its length and its ends, draw it, and write it as a table."""

import cv2
import numpy as np

import dloftbs


def draw_photo():
    """Return a picture of a red cable on a green table, BGR, as `cv2.imread("photo.jpg")` returns yours."""
    image = np.full((360, 480, 3), (90, 120, 90), np.uint8)
    t = np.linspace(0.0, 2.0 * np.pi, 400)
    points = np.stack((60.0 + 57.0 * t, 180.0 + 80.0 * np.sin(t)), axis=1)
    cv2.polylines(image, [points.round().astype(np.int32)], False, (30, 20, 210), 9, cv2.LINE_AA)
    return image


image = draw_photo()
found = dloftbs.detect(image, hsv="red")
print(f"{len(found)} found", found.reason or "")
for cable in found:
    print(f"{cable.curve.length:.0f} px long, {cable.width_px:.1f} px wide, sure to {cable.confidence:.0%}")
    print("from", cable.curve.start.round(1), "to", cable.curve.end.round(1))
    print("five places at equal distances:", cable.curve.sample(5).round(1).tolist())

found.save("overlay.png")
found.save("cable.csv")
