"""The commands of the page on recordings and clusters, run as they stand, in a folder with what they read."""

from __future__ import annotations

import re
import shlex
import socket
import subprocess
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from cli.cli_inputs import COMMAND, run
from test_readme import SIZE, photo_of

PAGE = (Path(__file__).parents[1] / "docs" / "recordings.md").read_text(encoding="utf-8")
SCHEDULER = "10.0.0.1:8786"
"""Address in the page, for which the test has another one."""
RESULTS = {"day1/a.mp4.jsonl", "day1/a.mp4.status.json", "b.mp4.jsonl", "b.mp4.status.json", "batch.config.yaml"}


def commands(heading: str, program: str = "dloftbs batch") -> list[list[str]]:
    """Return the commands below a heading, as the shell would split them."""
    section = PAGE[PAGE.index(f"## {heading}") :].partition("\n## ")[0]
    blocks = re.findall(r"^```sh\n(.*?)^```", section, re.MULTILINE | re.DOTALL)
    lines = [line for block in blocks for line in block.splitlines() if line.startswith(program)]
    return [[word for word in shlex.split(line, comments=True) if word != "&"] for line in lines]


def files(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the current folder, with all files that the page names."""
    monkeypatch.chdir(tmp_path)
    for name in ("recordings/day1", "scans/1/rgb", "scans/1/depth"):
        Path(name).mkdir(parents=True)
    for name in ("recordings/day1/a.mp4", "recordings/b.mp4"):
        video = cv2.VideoWriter(name, cv2.VideoWriter_fourcc(*"mp4v"), 30.0, SIZE[::-1])
        for i in range(3):
            video.write(photo_of(0.05 * i))
        video.release()
    for i in range(2):
        cv2.imwrite(f"scans/1/rgb/{i}.png", photo_of(0.05 * i))
        cv2.imwrite(f"scans/1/depth/{i}.png", np.full(SIZE, 600, np.uint16))
    Path("cable.yaml").write_text("segmentation: {hsv: ['170:10']}\n")
    return tmp_path


@pytest.mark.slow
def test_the_commands_for_a_laptop(folder: Path) -> None:
    found = commands("On a laptop")
    assert len(found) == 3
    for command in found:
        run(*command[1:])
    assert files(folder / "results") == RESULTS
    assert files(folder / "tables") == {"1/rgb.csv", "1/rgb.status.json", "batch.config.yaml"}


def test_the_commands_for_slurm(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    share, one = commands("On SLURM")
    for task in (0, 1):
        for name, value in (("ID", task), ("MIN", 0), ("MAX", 1), ("COUNT", 2), ("STEP", 1)):
            monkeypatch.setenv(f"SLURM_ARRAY_TASK_{name}", str(value))
        assert "1 inputs: 1 done" in run(*share[1:]).stderr
    assert files(folder / "results") == RESULTS
    assert "0 inputs" in run(*one[1:]).stderr  # of two inputs, the third of eight shares has none


def test_the_commands_for_dask(folder: Path) -> None:
    pytest.importorskip("distributed", reason="needs the extra cluster")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    (scheduler,), (worker,), (batch,) = (
        commands("On dask", program) for program in ("dask scheduler", "dask worker", "dloftbs batch")
    )

    def here(command: list[str]) -> list[str]:
        local = " ".join(command).replace(SCHEDULER, f"127.0.0.1:{port}").replace("10.0.0.1", "127.0.0.1")
        return local.replace("8786", str(port)).replace("--nworkers -1", "--nworkers 1").split()

    started = []
    try:
        for command in (scheduler, worker):
            program = [str(COMMAND.with_name("dask")), *here(command)[1:], "--no-dashboard"]
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            started.append(subprocess.Popen(program, start_new_session=True, **quiet))
            _wait_for(port)
        assert "2 inputs: 2 done" in run(*here(batch)[1:]).stderr
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait(60)
    assert files(folder / "results") == RESULTS


def _wait_for(port: int) -> None:
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        with socket.socket() as there:
            if there.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.1)
    pytest.fail("the scheduler does not answer")
