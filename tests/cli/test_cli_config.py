import msgspec
import pytest
from cli.cli_inputs import run

from dloftbs.config import Config, HsvRange


def printed(*arguments):
    return Config.from_dict(msgspec.yaml.decode(run("config", "print", *arguments).stdout))


def test_print_states_everything_and_reads_back():
    assert printed() == Config()
    assert printed("--paper") == Config.paper()
    text = run("config", "print").stdout
    assert all(f"{section}:" in text for section in Config().to_dict())


def test_later_options_override_earlier(tmp_path):
    file = tmp_path / "my.yaml"
    file.write_text("linking: {objects: 2, max_gap_widths: 7}\nsegmentation: {hsv: [{hue: [1, 2]}]}\n")
    assert printed("--set", "segmentation.hsv=170:10") == printed("--hsv", "170:10")
    both = printed("--config", file, "--set", "linking.max_gap_widths=6", "--hsv", "170:10")
    assert both.linking.objects == 2
    assert both.linking.max_gap_widths == 6.0
    assert both.segmentation.hsv == (HsvRange(hue=(170, 10)),)


def test_the_published_method_for_one_cable_is_that_of_the_library(tmp_path):
    file = tmp_path / "one.yaml"
    file.write_text("linking: {objects: 1}\n")
    for one in (("--set", "linking.objects=1"), ("--config", file)):
        assert printed("--paper", *one) == Config.paper(objects=1)
        assert printed("--paper", *one, "--set", "linking.max_cost=3").linking.max_cost == 3.0
    assert printed("--paper", "--config", file, "--set", "linking.objects=2") == Config.paper(objects=2)
    assert "$.linking.objects" in run("config", "print", "--paper", "--set", "linking.objects=x", code=1).stderr


def test_a_file_keeps_of_the_paper_what_it_leaves_out(tmp_path, monkeypatch):
    of_paper = Config().replace({"linking.max_gap_widths": 1.5, "fitting.knots": 5})
    monkeypatch.setattr(Config, "paper", lambda objects=None: of_paper)
    file = tmp_path / "my.yaml"
    file.write_text("fitting: {knots: 9}\n")
    config = printed("--paper", "--config", file)
    assert config.linking.max_gap_widths == 1.5
    assert config.fitting.knots == 9


@pytest.mark.parametrize(
    ("text", "stated"),
    [
        (Config().to_yaml(), "linking.method: bending, but the published method has greedy"),
        ("tracking: {method: motion}", "tracking.method: motion, but the published method has nearest"),
    ],
)
def test_the_paper_refuses_a_file_that_states_another_method(tmp_path, text, stated):
    file = tmp_path / "my.yaml"
    file.write_text(text)
    refused = run("config", "print", "--paper", "--config", file, code=2).stderr
    assert stated in " ".join(refused.split())
    run("config", "print", "--config", file)


def test_the_paper_takes_a_complete_file_of_its_own(tmp_path):
    (tmp_path / "paper.yaml").write_text(Config.paper().replace({"fitting.knots": 9}).to_yaml())
    config = printed("--paper", "--config", tmp_path / "paper.yaml")
    assert config == Config.paper().replace({"fitting.knots": 9})


def test_an_empty_file_changes_nothing(tmp_path):
    (tmp_path / "empty.yaml").write_text("# nothing\n")
    assert printed("--config", tmp_path / "empty.yaml") == Config()


def test_set_takes_sequences():
    config = printed("--set", "segmentation.hsv=[{hue: [170, 10]}, {hue: [50, 60], value: [9, 99]}]")
    assert config.segmentation.hsv == (HsvRange(hue=(170, 10)), HsvRange(hue=(50, 60), value=(9, 99)))


def test_set_takes_the_notation_of_colours():
    assert printed("--set", "segmentation.hsv=100:130") == printed("--hsv", "100:130")
    assert printed("--set", "segmentation.hsv=['100:130', '170:10']") == printed("--hsv", "100:130", "--hsv", "170:10")


def test_the_number_of_objects_has_an_option():
    assert printed("--objects", "2") == Config().replace({"linking.objects": 2})
    assert printed("--objects", "2", "--set", "linking.objects=3").linking.objects == 2
    assert printed("--paper", "--objects", "1") == Config.paper(objects=1)
    assert "--objects" in run("config", "print", "--objects", "0", code=2).stderr


def test_the_least_confidence_of_gaps_is_an_option():
    assert printed("--min-confidence", "0.8") == Config().replace({"linking.min_gap_confidence": 0.8})
    assert printed("--min-confidence", "0").linking.min_gap_confidence == 0.0
    assert "--min-confidence" in run("config", "print", "--min-confidence", "1.5", code=2).stderr
    refused = run("config", "print", "--paper", "--min-confidence", "0.8", code=1).stderr
    assert "min_gap_confidence" in refused


def test_without_a_command_the_defaults_are_explained():
    assert run("config").stdout == run("config", "print").stdout == Config().explain()


def test_the_last_set_of_a_key_counts():
    assert printed("--set", "fitting.knots=9", "--set", "fitting.knots=10").fitting.knots == 10


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("linking.max_price=5", "linking.max_price"),
        ("nothing=5", "nothing"),
        ("fitting.knots=many", "$.fitting.knots"),
        ("fitting.knots=1", "at least 2|2..1000"),
        ("fitting=3", "$.fitting"),
    ],
)
def test_a_wrong_setting_is_bad_input(change, message):
    result = run("config", "print", "--set", change, code=1)
    assert result.stderr.startswith("error: ")
    assert any(part in result.stderr for part in message.split("|"))


def test_check(tmp_path):
    good, bad = tmp_path / "good.yaml", tmp_path / "bad.yaml"
    good.write_text(Config.paper().to_yaml())
    bad.write_text("fitting: {knots: 9, nots: 3}\n")
    assert run("config", "check", good).stdout == f"{good}: ok\n"
    result = run("config", "check", bad, good, tmp_path / "missing.yaml", code=1)
    assert result.stdout == f"{good}: ok\n"
    assert len(result.stderr.splitlines()) == 2
    assert str(bad) in result.stderr
    assert "nots" in result.stderr


def test_a_missing_file_is_bad_input(tmp_path):
    assert "missing.yaml" in run("config", "print", "--config", tmp_path / "missing.yaml", code=1).stderr
