"""Pipelines in threads of their own do not disturb each other: each gives what it gives alone, bit for bit."""

from __future__ import annotations

import importlib
import pkgutil
import sys
import threading

import numpy as np
import pytest

import dloftbs
from dloftbs import Config, Pipeline
from dloftbs_lab.synthetic import TYPICAL_NOISE, TrackingSequence, rgbd_artificial

SIZE = (240, 426)
ROUNDS = 2


def frames_of(kind):
    """Two streams that are not the same, of generated masks, with depth where it is asked for."""
    if kind == "depth":
        return [list(sequence)[:20] for sequence in rgbd_artificial(0.1, size=SIZE, noise=TYPICAL_NOISE)[:2]]
    return [
        list(TrackingSequence("crossing", 3, frames=20, size=SIZE)),
        list(TrackingSequence("occluded", 5, number=1, frames=20, size=SIZE)),
    ]


def plain(value):
    """Make what can be compared of a result: every number of it, without its times."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items() if key != "stage_ms"}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return value.tobytes()
    return repr(value)


def follow(config, frames):
    pipeline = Pipeline(config)
    return [plain(pipeline.process(frame).to_dict()) for frame in frames]


@pytest.mark.parametrize("kind", ["masks", "depth"])
@pytest.mark.parametrize("config", [Config(), Config.paper()], ids=["default", "paper"])
def test_two_pipelines_in_two_threads_give_what_each_gives_alone(config, kind):
    streams = frames_of(kind)
    alone = [follow(config, frames) for frames in streams]
    assert alone[0] != alone[1]
    assert all(frame["detections"] for frame in alone[0])
    assert (alone[0][0]["detections"][0]["curve_3d"] == "None") == (kind == "masks")
    together = [[], []]
    start = threading.Barrier(2)

    def work(number):
        start.wait()
        for _ in range(ROUNDS):
            together[number].append(follow(config, streams[number]))

    threads = [threading.Thread(target=work, args=(number,)) for number in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert together == [[alone[number]] * ROUNDS for number in range(2)]


def test_one_pipeline_for_each_method_side_by_side():
    (frames, _) = frames_of("masks")
    configs = (Config(), Config.paper())
    alone = [follow(config, frames) for config in configs]
    together = {}
    threads = [
        threading.Thread(target=lambda number=number: together.update({number: follow(configs[number], frames)}))
        for number in range(2)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [together[0], together[1]] == alone


def test_a_result_stays_as_it_is_while_the_pipeline_goes_on():
    (frames, _) = frames_of("depth")
    pipeline = Pipeline()
    results = [pipeline.process(frame) for frame in frames]
    assert [plain(result.to_dict()) for result in results] == follow(Config(), frames)


def module_state():
    """What can be changed at the level of any module of the package, as text."""
    modules = {name: module for name, module in sys.modules.items() if name.partition(".")[0] == "dloftbs"}
    return {
        f"{name}.{key}": plain(value)
        for name, module in sorted(modules.items())
        for key, value in vars(module).items()
        if isinstance(value, (np.ndarray, list, dict, set, bytearray)) and not key.startswith("__")
    }


@pytest.mark.parametrize("config", [Config(), Config.paper()], ids=["default", "paper"])
def test_no_module_remembers_anything(config):
    (frames, others) = frames_of("masks")
    follow(config, frames)  # loads every module that it needs
    before = module_state()
    assert any(key.endswith("bitmask._SPREAD") for key in before)
    follow(config, others)
    assert module_state() == before


def test_all_kernels_release_the_gil():
    modules = pkgutil.walk_packages(dloftbs.__path__, "dloftbs.")
    names = [module.name for module in modules if "kernels" in module.name.split(".")]
    compiled = {
        f"{name}.{key}": value.targetoptions
        for name in names
        for key, value in vars(importlib.import_module(name)).items()
        if hasattr(value, "targetoptions")
    }
    assert len(compiled) > 50
    assert [name for name, options in compiled.items() if not options.get("nogil")] == []
