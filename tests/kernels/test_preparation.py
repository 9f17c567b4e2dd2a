"""Kernels of whole rooms, compiled ahead and in other processes."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from dloftbs.config import Config, SegmentationConfig, Stroke
from dloftbs.data.frame import Frame
from dloftbs.kernels import compiler, preparation
from dloftbs.pipeline.stages import kernel_rooms
from dloftbs.segmentation import ColourModel

START = """
import logging, sys
logging.basicConfig(level=logging.WARNING, format="%(message)s")
import dloftbs.segmentation.kernels.colour_table
import dloftbs.segmentation.kernels.plane_heights
import dloftbs_lab.evaluation.kernels.nearest_points
from dloftbs.kernels import compiler, preparation
preparation._core_count = lambda: 3
preparation._MIN_KERNELS = 3
"""
FEW = 'compiler._kernels[:] = [one for one in compiler._kernels if not one.module.endswith(("forest", "features"))]\n'
"""Leaves four kernels in three modules, which a test has the time to compile."""


def run(code, cache, start=START + FEW):
    """Return what a program prints that starts with an empty cache."""
    done = subprocess.run(
        [sys.executable, "-c", start + code],
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    return done.stdout.split(), done.stderr


@pytest.mark.slow
def test_what_other_processes_compile_is_loaded(tmp_path):
    code = (
        "print(preparation.prepare(), preparation.prepare(),"
        " sum(one._dispatcher.stats.cache_hits.total() for one in compiler._kernels))"
    )
    (compiled, again, hits), said = run(code, tmp_path)
    assert (int(compiled), int(again)) == (4, 0)
    assert int(hits) >= 1, "a process has compiled some of them"
    assert said.count("compiling kernels, once") == 1
    assert run(code, tmp_path) == (["0", "0", "4"], "")


@pytest.mark.slow
def test_only_the_kernels_of_the_rooms_are_compiled(tmp_path):
    code = "print(preparation.prepare(['segmentation']), *sorted(compiler.count_missing()))"
    assert run(code, tmp_path)[0] == ["3", "dloftbs_lab.evaluation.kernels.nearest_points"]


def test_a_block_that_ends_early_waits_for_nothing(tmp_path):
    code = (
        "import time; preparation._start = lambda start=preparation._start: started.append(start()) or started[-1]\n"
        "started = []\n"
        "with preparation.compiling_ahead(['segmentation']): pass\n"
        "print(len(started), *(process.returncode for process in started))"
    )
    count, *codes = run(code, tmp_path)[0]
    assert int(count) == 2
    assert set(codes) == {"-9"}


def test_where_no_process_can_start_this_one_compiles(monkeypatch):
    def refuse():
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(preparation, "_start", refuse)
    monkeypatch.setattr(preparation, "_core_count", lambda: 4)
    missing = {"linking.kernels.weights": 50, "fitting.kernels": 50}
    with preparation._workers(missing) as (waiting, threads):
        assert (list(waiting), threads) == (list(missing), [])


def test_rooms_that_are_ready_start_no_process(monkeypatch):
    monkeypatch.setattr(preparation, "_entered", {"linking", "fitting"})
    monkeypatch.setattr(compiler, "count_missing", None)  # not asked
    with preparation.compiling_ahead(["linking"]):
        pass


@pytest.mark.parametrize("death", ["import nonsense", "import os; os.kill(os.getpid(), 9)"])
@pytest.mark.slow
def test_a_process_that_dies_costs_nothing_but_time(tmp_path, death):
    dying = f"import sys; sys.stdin.readline(); sys.stdin.readline(); {death}"
    assert run(f"preparation._WORKER = {dying!r}\nprint(preparation.prepare())", tmp_path)[0] == ["4"]
    assert run("print(preparation.prepare())", tmp_path)[0] == ["0"]


@pytest.mark.parametrize("executable", ["", None, "/usr/bin/blender"])
def test_a_program_that_is_not_python_is_not_started_again(monkeypatch, executable):
    monkeypatch.setattr(sys, "executable", executable)
    assert not preparation._can_start_python()


def test_a_frozen_program_is_not_started_again(monkeypatch):
    assert preparation._can_start_python()
    monkeypatch.setattr(sys, "frozen", True, raising=False)
    assert not preparation._can_start_python()


def test_no_process_starts_where_nothing_can_be_saved(tmp_path):
    (tmp_path / "file").touch()
    code = (
        "from pathlib import Path\n"
        "from dloftbs.kernels import kernel_cache\n"
        f"kernel_cache.list_places = lambda folder: (Path({str(tmp_path / 'file')!r}),)\n"
        "preparation._start = None\n"
        "print(preparation.prepare(['segmentation']), *[len(one._dispatcher.signatures) for one in compiler._kernels])"
    )
    (count, *signatures), said = run(code, tmp_path / "unused")
    assert (count, signatures) == ("0", ["1"] * 3 + ["0"])
    assert said.count("cannot be saved") == 1


def test_a_worker_compiles_what_it_is_given_and_ends_with_its_input(tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    with subprocess.Popen(
        [sys.executable, "-c", preparation._WORKER],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
    ) as worker:
        answer, _ = worker.communicate(
            f"{preparation.json.dumps(sys.path)}\ndloftbs_lab.evaluation.kernels.nearest_points\n"
        )
    assert answer == "dloftbs_lab.evaluation.kernels.nearest_points\n"
    assert list(tmp_path.glob("kernels_*/nearest_points.*.nbc"))


def test_rooms_that_are_loaded_are_not_looked_at_again(monkeypatch):
    monkeypatch.setattr(preparation, "_loaded", {"linking", "fitting"})
    monkeypatch.setattr(compiler, "count_missing", None)  # not asked
    assert preparation.prepare(["fitting", "linking"]) == 0


ROOMS = {
    "segmentation": {
        f"dloftbs.segmentation.kernels.{name}"
        for name in ("colour_table", "forest", "line_features", "pixel_features", "plane_heights")
    },
    "segmentation.kernels.colour_table": {"dloftbs.segmentation.kernels.colour_table"},
    "kernels": set(),
    "segment": set(),
}


@pytest.fixture(scope="module")
def found_in(tmp_path_factory):
    """Return the modules with kernels in each room, as a process of its own finds them."""
    code = (
        f"print(*(f'{{room}}:{{one.module}}' for room in {[*ROOMS]} for one in compiler._kernels if one.is_in(room)))"
    )
    pairs = [line.split(":") for line in run(code, tmp_path_factory.mktemp("unused"), START)[0]]
    return {room: {module for other, module in pairs if other == room} for room in ROOMS}


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_is_a_folder_or_one_of_its_modules(found_in, room):
    assert found_in[room] == ROOMS[room]


def test_a_frame_needs_the_rooms_that_its_stages_enter():
    image, depth, mask = np.zeros((8, 8, 3), np.uint8), np.ones((8, 8)), np.ones((8, 8), bool)
    alone = kernel_rooms(Config(), Frame(mask=mask))
    assert "evidence" not in alone
    assert "lifting" not in alone
    assert "segmentation" not in alone
    coloured = set(kernel_rooms(Config(), Frame(image=image)))
    assert {"segmentation.kernels.colour_table", "segmentation.kernels.plane_heights", "evidence"} <= coloured
    assert "segmentation" not in coloured
    strokes = Stroke(points=((10.0, 20.0), (50.0, 20.0)))
    drawn = np.full((40, 60, 3), 90, np.uint8)
    drawn[17:24] = (20, 20, 200)
    colour = ColourModel.fit(drawn, [strokes]).to_config()
    assert "segmentation" in kernel_rooms(Config(segmentation=SegmentationConfig(colour=colour)), Frame(image=image))
    assert {"evidence", "lifting", "camera"} <= set(kernel_rooms(Config(), Frame(mask=mask, depth=depth)))
    assert "pipeline.published" in kernel_rooms(Config.paper(), Frame(mask=mask))
