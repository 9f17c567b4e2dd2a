import functools
import json
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from lab.evaluation import runner_stubs as stubs
from lab.evaluation.runner_stubs import Bars, method, suite, without_times

from dloftbs.errors import DloftbsError, InputError
from dloftbs_lab.evaluation.runner import finished_parts
from dloftbs_lab.evaluation.runner.run import evaluate
from dloftbs_lab.evaluation.runner.sequence_run import Method

TESTS = Path(__file__).parents[3]


def counted(tmp_path):
    log = tmp_path / "log"
    return log, Method("counted", functools.partial(stubs.logging_method, str(log)))


def calls(log):
    return len(log.read_text().splitlines()) if log.exists() else 0


def test_what_is_finished_is_not_computed_again(tmp_path):
    log, counting = counted(tmp_path)
    first = evaluate([suite()], [counting], tmp_path / "parts")
    before = calls(log)
    seen = []
    again = evaluate([suite()], [counting], tmp_path / "parts", finished=seen.append)
    assert calls(log) == before
    assert again == first == seen


@pytest.mark.parametrize(
    "changed",
    [
        lambda s, m: (replace(s, settings="other"), m),
        lambda s, m: (replace(s, sequences=(Bars(length=2),)), m),
        lambda s, m: (s, replace(m, settings="other")),
    ],
)
def test_other_settings_are_computed(tmp_path, changed):
    log, counting = counted(tmp_path)
    evaluate([suite()], [counting], tmp_path / "parts")
    before = calls(log)
    changed_suite, changed_method = changed(suite(), counting)
    evaluate([changed_suite], [changed_method], tmp_path / "parts")
    assert calls(log) > before


def test_other_code_is_another_version(tmp_path, monkeypatch):
    log, counting = counted(tmp_path)
    evaluate([suite()], [counting], tmp_path / "parts")
    before = calls(log)
    monkeypatch.setattr("dloftbs_lab.evaluation.runner.run.code_version", lambda: "other")
    evaluate([suite()], [counting], tmp_path / "parts")
    assert calls(log) > before


@pytest.mark.parametrize("spoilt", [b"", b"{", b"\xff\xfe", b"[]"])
def test_a_spoilt_part_is_computed_again(tmp_path, spoilt):
    first = evaluate([suite()], [method(stubs.perfect)], tmp_path)
    (file,) = tmp_path.iterdir()
    file.write_bytes(spoilt)
    assert without_times(evaluate([suite()], [method(stubs.perfect)], tmp_path)) == without_times(first)
    json.loads(file.read_bytes())


def test_one_job_and_two_give_the_same(tmp_path):
    sequences = [Bars(f"bars {i}", length=2 + i) for i in range(3)]
    methods = [method(stubs.perfect), method(stubs.raising), Method("counting", stubs.Counting)]
    one = evaluate([suite(*sequences)], methods, tmp_path / "one", jobs=1)
    two = evaluate([suite(*sequences)], methods, tmp_path / "two", jobs=2)
    assert without_times(one) == without_times(two)
    assert [(part.key.sequence, part.key.method) for part in one] == [
        (s.name, m.name) for s in sequences for m in methods
    ]


def started(call, parts, **options):
    """Start a call of a stub in a process of its own, and wait for the first part."""
    code = f"import sys; sys.path.insert(0, {str(TESTS)!r}); import lab.evaluation.runner_stubs as s; s.{call}"
    process = subprocess.Popen([sys.executable, "-c", code], **options)
    deadline = time.monotonic() + 60.0
    while not list(parts.glob("[!.]*.json")) and time.monotonic() < deadline:
        time.sleep(0.02)
    return process


@pytest.mark.slow
def test_an_interrupted_run_does_not_wait_for_the_rest_of_an_answer(tmp_path):
    with started(f"to_be_interrupted({str(tmp_path)!r})", tmp_path, stderr=subprocess.PIPE, text=True) as process:
        time.sleep(0.5)  # the first answer is on its way
        process.send_signal(signal.SIGINT)
        try:
            _, errors = process.communicate(timeout=60)
        finally:
            process.kill()
    assert process.returncode == -signal.SIGINT
    assert errors.endswith("KeyboardInterrupt\n")
    assert 1 <= len(list(tmp_path.glob("[!.]*.json"))) < 100


@pytest.mark.slow
def test_a_killed_run_goes_on_where_it_was(tmp_path):
    parts, log = tmp_path / "parts", tmp_path / "log"
    process = started(f"to_be_killed({str(parts)!r}, {str(log)!r})", parts)
    process.send_signal(signal.SIGKILL)
    process.wait()
    finished = list(parts.glob("[!.]*.json"))
    assert 1 <= len(finished) < 4
    time.sleep(0.5)  # its processes end with it
    before = calls(log)
    time.sleep(0.5)
    assert calls(log) == before
    sequences = [Bars(f"bars {i}", length=4) for i in range(4)]
    again = Method("slow", functools.partial(stubs.logging_method, str(log)))
    whole = evaluate([suite(*sequences)], [again], parts)
    assert [len(part.rows) for part in whole] == [4, 4, 4, 4]
    assert calls(log) - before <= 4 * (4 - len(finished)) + 1  # one to warm up


def test_a_process_that_dies_is_an_error_and_the_finished_stays(tmp_path):
    sequences = [Bars("a"), Bars("b")]
    evaluate([suite(*sequences)], [method(stubs.perfect)], tmp_path)
    with pytest.raises(DloftbsError, match="a process died"):
        evaluate([suite(*sequences)], [method(stubs.perfect), method(stubs.dying)], tmp_path, jobs=2)
    assert len(list(tmp_path.glob("*.json"))) == 2


def test_names_must_differ(tmp_path):
    with pytest.raises(InputError, match="methods must have different names, got a, a"):
        evaluate([suite()], [method(stubs.perfect, "a"), method(stubs.lone, "a")], tmp_path)
    with pytest.raises(InputError, match="suites must have different names"):
        evaluate([suite(), suite()], [], tmp_path)


def test_a_digest_of_the_code_is_part_of_the_version():
    version, _, digest = finished_parts.code_version().partition("+")
    assert version
    assert len(digest) == 12


def test_what_sequences_of_one_scene_show_is_drawn_once(tmp_path):
    log = tmp_path / "drawings"
    first, second = stubs.Drawing(str(log)), stubs.Drawing(str(log))
    sequences = [stubs.Drawn("a", first), stubs.Drawn("b", second), stubs.Drawn("a, noisy", first)]
    for sequence, scene in zip(sequences, ("a", "b", "a"), strict=True):
        sequence.scene_name = scene
    parts = evaluate([suite(*sequences)], [method(stubs.perfect)], tmp_path / "parts", jobs=2)
    assert [part.key.sequence for part in parts] == ["a", "b", "a, noisy"]
    assert calls(log) == 2
