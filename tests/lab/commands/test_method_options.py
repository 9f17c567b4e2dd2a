"""Settings of the methods to be scored: of the options, of YAML files among the methods, and of both."""

import subprocess
import sys

import click
import numpy as np
import pytest
from cli.cli_inputs import mask, photo

from dloftbs.config import Config, HsvRange
from dloftbs.data.frame import Frame
from dloftbs.errors import ConfigError, InputError
from dloftbs_lab.commands.method_options import MethodSettings
from dloftbs_lab.commands.methods import Masked, config_of, current_folder_importable, method_of, methods_of

RED = HsvRange.parse("170:10,80:255,60:255")


@pytest.fixture
def files(tmp_path):
    (tmp_path / "mine.yaml").write_text("linking:\n  min_length_px: 33\nfitting:\n  knots: 20\n")
    (tmp_path / "common.yml").write_text("linking:\n  min_length_px: 44\n")
    return tmp_path


def test_without_settings_a_method_is_what_its_name_says(files):
    assert config_of("default", MethodSettings()) == Config()
    assert config_of("paper", MethodSettings()) == Config.paper()
    expected = Config().replace({"linking.min_length_px": 33, "fitting.knots": 20})
    assert config_of(str(files / "mine.yaml"), MethodSettings()) == expected
    assert method_of(str(files / "mine.yaml")).settings == expected.to_yaml()
    assert config_of("module:callable", MethodSettings(hsv=(RED,))) is None


@pytest.mark.parametrize("name", ["default", "paper", "mine.yaml"])
def test_settings_apply_to_every_method_the_later_over_the_earlier(files, name, monkeypatch):
    monkeypatch.chdir(files)
    settings = MethodSettings(files / "common.yml", {"tracking.gate": 0.7} if name != "paper" else {}, (RED,))
    config = config_of(name, settings)
    assert config.linking.min_length_px == 44
    assert config.segmentation.hsv == (RED,)
    if name != "paper":
        assert config.tracking.gate == 0.7
    assert (config.fitting.knots == 20) == (name == "mine.yaml")
    assert type(config.linking) is type((Config.paper() if name == "paper" else Config()).linking)
    assert (
        config_of(name, MethodSettings(files / "common.yml", {"linking.min_length_px": 55})).linking.min_length_px == 55
    )


def test_a_file_of_the_default_does_not_become_the_paper(files):
    (files / "complete.yaml").write_text(Config().to_yaml())
    settings = MethodSettings(files / "complete.yaml")
    assert config_of("default", settings) == Config()
    with pytest.raises(click.UsageError, match=r"linking\.method: bending, but the published method has greedy"):
        config_of("paper", settings)


def test_methods_with_other_settings_are_other_methods(files):
    assert method_of("default", MethodSettings(hsv=(RED,))).settings != method_of("default").settings


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        ("default", {"linkin.max": 1}, "method 'default': unknown configuration key 'linkin.max'"),
        ("default", {"linking.max_cost": 1}, "method 'default': unknown configuration key 'linking.max_cost'"),
        ("gone.yaml", {}, "method 'gone.yaml': gone.yaml: cannot be read"),
    ],
)
def test_wrong_settings_name_the_method(name, changes, message):
    with pytest.raises(ConfigError, match=message):
        method_of(name, MethodSettings(changes=changes))


def test_settings_that_no_method_takes_are_an_error():
    settings = MethodSettings(changes={"tracking.gate": 0.7}, hsv=(RED,))
    with pytest.raises(InputError, match=r"--set and --hsv: none of the methods takes settings; .*got math:sin"):
        methods_of(["math:sin"], settings)
    assert [method.name for method in methods_of(["math:sin", "default"], settings)] == ["math:sin", "default"]
    assert [method.name for method in methods_of(["math:sin"], MethodSettings())] == ["math:sin"]


@pytest.mark.parametrize("key", ["background", "onnx"])
def test_a_file_that_a_configuration_names_counts_by_its_content(tmp_path, key):
    named, config = tmp_path / "named", tmp_path / "mine.yaml"
    config.write_text(f"segmentation: {{{key}: {{file: {named}}}}}")
    missing = method_of(str(config)).settings
    named.write_bytes(b"1")
    before = method_of(str(config)).settings
    named.write_bytes(b"2")
    assert len({missing, before, method_of(str(config)).settings}) == 3


def test_a_colour_takes_the_place_of_the_mask_and_leaves_masks_without_a_picture():
    frame = Frame(image=photo(y=30), mask=mask(y=70))
    for settings, y in ((MethodSettings(), 70.0), (MethodSettings(hsv=(RED,)), 30.0)):
        result = method_of("default", settings).factory()(frame)
        assert result[0].curve(0.5)[1] == pytest.approx(y, abs=0.5)
    alone = method_of("default", MethodSettings(hsv=(RED,))).factory()(Frame(mask=mask(y=70)))
    assert alone[0].curve(0.5)[1] == pytest.approx(70.0, abs=0.5)


def test_the_current_folder_is_on_the_path_for_as_long_as_it_is_needed(tmp_path, monkeypatch):
    import sys

    monkeypatch.chdir(tmp_path)
    before = list(sys.path)
    with current_folder_importable():
        assert sys.path == [str(tmp_path), *before]
        with current_folder_importable():  # as where `python -m` put it there
            assert sys.path == [str(tmp_path), *before]
        assert sys.path == [str(tmp_path), *before]
    assert sys.path == before


@pytest.mark.parametrize("name", ["methods", "method_options", "evaluate"])
def test_processes_of_a_run_may_import_any_of_it_first(name):
    code = f"import dloftbs_lab.commands.{name}; from dloftbs.cli import main; assert 'evaluate' in main.commands"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


class Recorder:
    """A method of somebody else, which keeps the frames that it is given."""

    frames: list = []  # noqa: RUF012

    def start(self, frame, truth):
        self.frames.append(frame)

    def __call__(self, frame):
        self.frames.append(frame)
        return []


def test_a_method_of_others_gets_the_mask_by_colour_as_ours_do(monkeypatch):
    monkeypatch.setattr(Recorder, "frames", [])
    image = np.zeros((40, 60, 3), np.uint8)
    image[10:20] = (30, 20, 210)
    method = Masked(Recorder(), (RED,))
    method.start(Frame(image=image), None)
    method(Frame(image=image))
    method(Frame(image=image, mask=np.eye(40, 60, dtype=bool)))
    method(Frame(mask=np.eye(40, 60, dtype=bool)))
    masks = [np.asarray(frame.mask) > 0 for frame in Recorder.frames]
    assert np.flatnonzero(masks[0].all(axis=1)).tolist() == list(range(10, 20))
    assert np.array_equal(masks[0], masks[1])
    assert np.array_equal(masks[0], masks[2]), "ours take no mask of a file then"
    assert masks[3].sum() == 40
    assert not hasattr(Masked(lambda frame: [], (RED,)), "start")
