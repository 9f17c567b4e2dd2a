"""A video of a black cable: track it, and plot its length over time with pandas."""

import cv2
import numpy as np
import pandas as pd

import dloftbs

SIZE = (360, 480)


def make_video(path, frames=20):
    """Write a black cable that bends."""
    video = cv2.VideoWriter(path, cv2.VideoWriter_fourcc(*"mp4v"), 30.0, SIZE[::-1])
    t = np.linspace(0.0, 2.0 * np.pi, 400)
    for i in range(frames):
        image = np.full((*SIZE, 3), (170, 190, 200), np.uint8)
        points = np.stack((60.0 + 57.0 * t, 180.0 + (20.0 + 4.0 * i) * np.sin(t)), axis=1)
        cv2.polylines(image, [points.round().astype(np.int32)], False, (30, 30, 30), 9, cv2.LINE_AA)
        video.write(image)
    video.release()


make_video("cable.mp4")
with dloftbs.sinks.open("curves.csv") as table, dloftbs.sources.open("cable.mp4") as source:
    pipeline = dloftbs.Pipeline(hsv="black")
    for frame in source:
        table.write(frame, pipeline.process(frame))

lengths = pd.read_csv("curves.csv").groupby(["frame", "object"])["length_px"].first().unstack()
print(lengths.describe().round(1))
lengths.plot(ylabel="length, px", title="Length of each cable").figure.savefig("length.png")
