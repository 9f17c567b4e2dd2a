"""The status file, and what makes an input to be done again."""

import dataclasses
import os

import pytest
from cli.batch.batch_inputs import only, settings, stack
from cli.cli_inputs import mask, photo, save

from dloftbs.cli.batch import settings as settings_module
from dloftbs.cli.batch.input_run import run_input
from dloftbs.cli.batch.status_file import State, fingerprint_of, read_status, reason_to_run, write_status
from dloftbs.cli.input_options import InputOptions
from dloftbs.config import Config


@pytest.fixture
def done(tmp_path):
    item = only(stack(tmp_path / "a.npy", 12), tmp_path / "out")
    return item, run_input(item, settings())


def test_it_comes_back_as_it_was_written(done):
    item, status = done
    assert status.state is State.DONE
    assert read_status(item) == status
    assert reason_to_run(item, settings(), status) is None


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '{"input": 3}'])
def test_what_is_no_status_is_none(done, text):
    item, _ = done
    item.status.write_text(text)
    assert read_status(item) is None
    assert reason_to_run(item, settings(), read_status(item)) == "new"


@pytest.mark.parametrize(
    "changes",
    [
        {"config": Config().replace({"linking.objects": 1})},
        {"fps": 30.0},
        {"every": 2},
        {"limit": 5},
        {"suffix": ".npz"},
        {"inputs": InputOptions("mask", None, None, None, None, None, None)},
    ],
)
def test_another_setting_is_a_reason(done, changes):
    item, status = done
    assert reason_to_run(item, settings(**changes), status) == "with other settings"


def test_another_version_is_a_reason(done, monkeypatch):
    item, status = done
    monkeypatch.setattr(settings_module, "code_version", lambda without: "0.0.1+other")
    assert reason_to_run(item, settings(), status) == "by another version"


def test_a_changed_or_a_missing_file_is_a_reason(done):
    item, status = done
    os.utime(item.path, ns=(0, 1))
    assert reason_to_run(item, settings(), status) == "changed since"
    item.result.unlink()
    assert reason_to_run(item, settings(), status) == "without their result"


@pytest.mark.parametrize(
    ("state", "again"), [(State.DONE, None), (State.PARTIAL, "failed before"), (State.FAILED, "failed before")]
)
def test_what_failed_is_done_again_where_that_is_asked_for(done, state, again):
    item, status = done
    write_status(item, dataclasses.replace(status, state=state))
    assert reason_to_run(item, settings(), read_status(item)) is None
    assert reason_to_run(item, settings(retry_failed=True), read_status(item)) == again


def test_a_fingerprint_is_that_of_all_files_of_a_folder_and_their_partners(tmp_path):
    for i in range(2):
        save(tmp_path / "rgb" / f"{i}.png", photo())
        save(tmp_path / "masks" / f"{i}.png", mask())
    rule = settings(inputs=InputOptions("auto", None, "../masks/{stem}.png", None, None, None, None))
    item = only(tmp_path / "rgb", tmp_path / "out")
    alone, both = fingerprint_of(item, settings()), fingerprint_of(item, rule)
    assert (alone.files, both.files) == (2, 4)
    (tmp_path / "rgb" / ".lock").write_bytes(b"hidden")
    assert fingerprint_of(item, settings()) == alone
    os.utime(tmp_path / "masks" / "1.png", ns=(0, 1))
    assert fingerprint_of(item, settings()) == alone
    assert fingerprint_of(item, rule).digest != both.digest
    os.rename(tmp_path / "rgb" / "1.png", tmp_path / "rgb" / "2.png")
    assert fingerprint_of(item, settings()).digest != alone.digest
