"""Measure the page at HD: frames a second and delay, with the pipeline and a browser on this machine.

`python -m benchmarks.live_page [--quick] [--docs docs/ui.md]`; needs Chromium.
"""

from __future__ import annotations

import os
import shutil
from time import perf_counter

import numpy as np
import psutil

from benchmarks.docs import arguments, published
from benchmarks.machine import machine
from benchmarks.newcomer import CHROMIUM
from dloftbs import Config, Pipeline
from dloftbs.config import SegmentationConfig
from dloftbs.ui.server import serve
from dloftbs.ui.view_session import ViewSession
from dloftbs_lab.synthetic import DemoSequence

FPS = 60.0
"""Pace of the source: more than is asked for, so that the page is what limits."""


def busy_s() -> float:
    """Return the processor time of this process and all that it started, s."""
    me = psutil.Process()
    times = [process.cpu_times() for process in (me, *me.children(recursive=True))]
    return sum(each.user + each.system for each in times)


def measure(seconds: float) -> tuple[list[float], list[float], float]:
    """Show frames of HD while they are tracked.

    Returns
    -------
    rates, delays : list of float
        Frames painted in a second, and milliseconds of delay, now and then.
    share : float
        Processor time a second, s, of tracking, server and browser together.
    """
    from playwright.sync_api import sync_playwright

    sequence = DemoSequence(frames=60)
    frames = list(sequence)
    config = Config(segmentation=SegmentationConfig(hsv=sequence.hsv))
    Pipeline(config).process(frames[0])  # loads the kernels
    session = ViewSession(frames, config, "HD", length=len(frames), fps=FPS)
    rates, delays = [], []
    with serve(session, port=0) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=CHROMIUM)
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.goto(address.url)
        page.click("#loop")
        page.locator("#objects li").first.wait_for()
        page.wait_for_timeout(2000)
        since, busy = perf_counter(), busy_s()
        for _ in range(round(seconds / 0.25)):
            page.wait_for_timeout(250)
            rates.append(float(page.locator("#rate-now").inner_text().split()[0]))
            delays.append(float(page.locator("#delay").inner_text().split()[0]))
        share = (busy_s() - busy) / (perf_counter() - since)
        browser.close()
    return rates, delays, share


def main() -> None:
    options = arguments(__doc__, "measure for 3 s").parse_args()
    with published("live_page", options.docs):
        print(machine())
        print(f"load before: {os.getloadavg()[0]:.1f}")
        rates, delays, share = measure(3.0 if options.quick else 15.0)
        print(f"1280x720, two cables, source at {FPS:.0f} frames/s")
        print(f"painted    {np.median(rates):.0f} frames/s (median), {np.min(rates):.0f} at worst")
        print(f"processor  {1e3 * share / np.mean(rates):.0f} ms a painted frame, tracking and browser included")
        print(f"delay      {np.median(delays):.0f} ms (median), {np.percentile(delays, 95):.0f} (95 %)")


if __name__ == "__main__":
    main()
