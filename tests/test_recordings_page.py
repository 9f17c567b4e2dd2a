"""The commands of the page on many recordings, run as they stand."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

from cli.cli_inputs import run
from ros import bag_examples as bags

PAGE = (Path(__file__).parents[1] / "docs" / "recordings.md").read_text(encoding="utf-8")


def test_the_commands_run_and_the_status_is_as_described(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("recordings/day").mkdir(parents=True)
    for name in ("recordings/day/run.mcap", "recordings/other.mcap"):
        bags.write_mcap(Path(name), bags.entries(2, depth=False))
    blocks = "".join(re.findall(r"^```sh\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))
    commands = [line.removeprefix("dloftbs ") for line in blocks.splitlines()]
    for command in commands:
        run(*shlex.split(command))
    assert len(commands) == 3
    assert Path("results/day/run.mcap.jsonl").stat().st_size > 100
    assert Path("again/day/run.mcap.npz").stat().st_size > 100
    status = json.loads(Path("results/day/run.mcap.status.json").read_text())
    described = re.findall(r"`(\w+)`", "".join(re.findall(r"^\| (`.*?) \|", PAGE, re.MULTILINE)))
    assert set(described) == status.keys()
