"""Image files: kinds by content, order, what cannot be read."""

from __future__ import annotations

import glob
import logging
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from dloftbs import sources
from dloftbs.camera import PinholeCamera
from dloftbs.errors import InputError, SourceError
from dloftbs.sources.image_files import natural_key, sorted_by_name

COLOUR = np.zeros((12, 16, 3), np.uint8)
COLOUR[4:6, 2:14] = (10, 200, 30)
MASK = COLOUR[..., 1]


def save(path: Path, pixels: np.ndarray, *options: int) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    done, data = cv2.imencode(path.suffix, pixels, options)
    assert done
    path.write_bytes(data.tobytes())
    return path


def only(source: sources.Source) -> sources.Frame:
    with source:
        (frame,) = source
    return frame


def test_colour_file_is_an_image(tmp_path):
    camera = PinholeCamera(500, 500, 8, 6)
    frame = only(sources.open(save(tmp_path / "a.png", COLOUR), camera=camera))
    np.testing.assert_array_equal(frame.image, COLOUR)
    assert (frame.mask, frame.depth, frame.stamp) == (None, None, None)
    assert (frame.index, frame.name, frame.camera) == (0, "a.png", camera)


@pytest.mark.parametrize(
    "pixels", [MASK, np.dstack([MASK] * 3), MASK.astype(np.uint16) * 257], ids=["grey", "equal channels", "16 bit"]
)
def test_grey_file_is_a_mask(tmp_path, pixels):
    frame = only(sources.open(str(save(tmp_path / "a.png", pixels))))
    assert frame.image is None
    np.testing.assert_array_equal(frame.mask != 0, MASK != 0)


def test_one_coloured_pixel_makes_an_image(tmp_path):
    # Off the grid of the quick look, so that the thorough one has to find it.
    pixels = np.zeros((40, 40, 3), np.uint8)
    pixels[17, 21] = (0, 0, 1)
    assert only(sources.open(save(tmp_path / "a.png", pixels))).image is not None


def test_kind_overrules_content(tmp_path):
    grey, colour = save(tmp_path / "grey.png", MASK), save(tmp_path / "colour.png", COLOUR)
    np.testing.assert_array_equal(only(sources.open(grey, kind="image")).image, np.dstack([MASK] * 3))
    np.testing.assert_array_equal(only(sources.open(colour, kind="mask")).mask != 0, MASK != 0)


@pytest.mark.parametrize("pixels", [MASK, np.dstack([MASK] * 3)], ids=["grey", "equal channels"])
def test_grey_files_are_images_where_a_colour_is_to_be_found(tmp_path, pixels):
    frame = only(sources.open(save(tmp_path / "a.png", pixels), kind="auto_image"))
    assert frame.mask is None
    np.testing.assert_array_equal(frame.image, np.dstack([MASK] * 3))


@pytest.mark.parametrize("suffix", [".png", ".jpg"])
def test_a_photograph_that_is_read_as_a_mask_is_said_to_be(tmp_path, suffix, caplog):
    rng = np.random.default_rng(0)
    picture = np.clip(np.linspace(40, 160, 96)[None] + rng.normal(0.0, 4.0, (64, 96)), 0, 255).astype(np.uint8)
    only(sources.open(save(tmp_path / f"photo{suffix}", picture)))
    assert "photo" in caplog.text
    assert "read as a mask, but no grey level is frequent enough to be the ground" in caplog.text
    caplog.clear()
    mask = np.zeros((64, 96), np.uint8)
    for y in (5, 25, 45):
        mask[y : y + 9] = 255
    mask = cv2.GaussianBlur(mask, (0, 0), 1.0)
    only(sources.open(save(tmp_path / f"mask{suffix}", mask)))
    only(sources.open(save(tmp_path / f"labels{suffix}", mask // 100)))
    only(sources.open(save(tmp_path / f"read{suffix}", picture), kind="image"))
    assert caplog.text == ""


def test_faint_cable_in_png_counts(tmp_path):
    frame = only(sources.open(save(tmp_path / "a.png", MASK // 200)))
    assert (frame.mask != 0).sum() == 24


def test_ringing_in_jpeg_does_not_count(tmp_path):
    pixels = np.zeros((32, 32), np.uint8)
    pixels[13:19] = 255
    path = save(tmp_path / "a.jpg", pixels, cv2.IMWRITE_JPEG_QUALITY, 60)
    assert (cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) > 0).sum() > (pixels > 0).sum()
    np.testing.assert_array_equal(only(sources.open(path)).mask, pixels > 0)


def test_alpha_is_dropped(tmp_path):
    path = save(tmp_path / "a.png", np.dstack([COLOUR, np.full_like(MASK, 7)]))
    np.testing.assert_array_equal(only(sources.open(path)).image, COLOUR)


def test_16_bit_colour_is_refused(tmp_path):
    with pytest.raises(SourceError, match=r"a\.png.*8 bits.*uint16"):
        only(sources.open(save(tmp_path / "a.png", COLOUR.astype(np.uint16) * 200)))


def test_a_floating_point_mask_is_a_probability(tmp_path):
    soft = np.linspace(0.0, 1.0, MASK.size, dtype=np.float32).reshape(MASK.shape)
    frame = only(sources.open(save(tmp_path / "a.tif", soft)))
    assert frame.mask_is == "probability"
    np.testing.assert_array_equal(frame.mask, np.rint(255.0 * soft).astype(np.uint8))
    with pytest.raises(SourceError, match=r"a\.tif: mask must be a probability in 0\.\.1 .*, got 0\.\.200"):
        only(sources.open(save(tmp_path / "a.tif", MASK.astype(np.float32))))


@pytest.mark.parametrize("where", ["folder", "glob"])
def test_natural_order(tmp_path, where):
    for number in (10, 2, 1):
        save(tmp_path / f"img{number}.png", MASK)
    (tmp_path / "notes.txt").write_text("no image")
    (tmp_path / "._img1.png").write_bytes(b"a Mac's shadow")
    with sources.open(tmp_path if where == "folder" else f"{tmp_path}/*") as source:
        assert source.length == 3
        assert [frame.name for frame in source] == ["img1.png", "img2.png", "img10.png"]
        assert source.skipped == 0


def test_natural_key():
    names = ["a/2.png", "a/b10.png", "a/B9.png", "a b/1.png", "1.png", "01.png", "x.png"]
    order = sorted(map(Path, names), key=natural_key)
    assert [p.as_posix() for p in order] == [
        "01.png",
        "1.png",
        "a/2.png",
        "a/B9.png",
        "a/b10.png",
        "a b/1.png",
        "x.png",
    ]


def test_files_that_are_named_by_times_come_in_their_order(tmp_path):
    stamps = [f"{round(1700000000.05 + k / 30, 4)}" for k in range(40)]
    for stamp in stamps:
        save(tmp_path / f"{stamp}.png", MASK)
    with sources.open(tmp_path) as source:
        assert [frame.name for frame in source] == [f"{stamp}.png" for stamp in stamps]
    versions = [tmp_path / f"{name}.png" for name in ("12345678.9", "12345678.10")]  # too few digits for a time
    assert sorted_by_name(versions) == versions


def test_sequence_keeps_its_order(tmp_path):
    paths = [save(tmp_path / name, MASK) for name in ("b.png", "a.png")]
    with sources.open([paths[0], str(paths[1])]) as source:
        assert [frame.name for frame in source] == ["b.png", "a.png"]


def test_stamps_from_fps(tmp_path):
    for number in range(3):
        save(tmp_path / f"{number}.png", MASK)
    with sources.open(tmp_path, fps=20) as source:
        assert source.fps == 20
        assert [frame.stamp for frame in source] == [0.0, 0.05, 0.1]


def test_non_ascii_folder(tmp_path):
    path = save(tmp_path / "кабель ä" / "é.png", COLOUR)
    assert only(sources.open(path)).name == "é.png"
    assert only(sources.open(path.parent)).name == "é.png"


def test_brackets_in_a_real_name_are_no_pattern(tmp_path):
    assert only(sources.open(save(tmp_path / "a[1].png", MASK))).name == "a[1].png"


@pytest.mark.parametrize("size", [0, 40, -8], ids=["empty", "headless", "cut off"])
@pytest.mark.parametrize("extension", [".png", ".jpg"])
def test_corrupt_file_is_skipped(tmp_path, caplog, size, extension):
    for number in range(4):
        path = save(tmp_path / f"{number}{extension}", COLOUR)
        if number in (1, 2):
            path.write_bytes(path.read_bytes()[:size])
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(tmp_path) as source:
        assert [frame.index for frame in source] == [0, 3]
        assert source.skipped == 2
        assert [frame.index for frame in source] == [0, 3]  # the count begins anew
        assert source.skipped == 2
    assert len(caplog.records) == 4
    assert f"1{extension}" in caplog.text
    assert ("empty" if size == 0 else "cut off") in caplog.text


def test_corrupt_only_file_raises(tmp_path):
    path = tmp_path / "a.png"
    path.write_bytes(b"not a png at all")
    with sources.open(path) as source, pytest.raises(SourceError, match=r"a\.png.*16 bytes"):
        list(source)


def test_jpeg_with_a_thumbnail(tmp_path):
    # The end marker of the thumbnail must not pass for that of the picture.
    data = save(tmp_path / "a.jpg", np.kron(COLOUR, np.ones((8, 8, 1), np.uint8))).read_bytes()
    thumbnail = save(tmp_path / "b.jpg", COLOUR).read_bytes()
    header = b"\xff\xe1" + (len(thumbnail) + 2).to_bytes(2, "big") + thumbnail
    (tmp_path / "a.jpg").write_bytes(data[:2] + header + data[2:])
    assert only(sources.open(tmp_path / "a.jpg")).size == (96, 128)
    (tmp_path / "a.jpg").write_bytes(data[:2] + header + data[2:-40])
    with pytest.raises(SourceError, match="cut off"):
        only(sources.open(tmp_path / "a.jpg"))


def test_absurd_size_is_refused(tmp_path):
    # OpenCV raises, rather than return None, where the header asks for more pixels than it allows.
    data = bytearray(save(tmp_path / "a.png", COLOUR).read_bytes())
    data[16:24] = (60_000).to_bytes(4, "big") * 2
    data[29:33] = zlib.crc32(data[12:29]).to_bytes(4, "big")
    (tmp_path / "a.png").write_bytes(data)
    with pytest.raises(SourceError, match=r"a\.png: must have at most 134217728 pixels, got 60000 x 60000"):
        only(sources.open(tmp_path / "a.png"))


def test_file_that_vanishes_is_skipped(tmp_path, caplog):
    paths = [save(tmp_path / f"{number}.png", MASK) for number in range(3)]
    with sources.open(tmp_path) as source:
        paths[1].unlink()
        assert [frame.index for frame in source] == [0, 2]
    assert "1.png: cannot be read: No such file" in caplog.text


def test_a_link_that_leads_to_nothing_keeps_its_place(tmp_path, caplog):
    for number in (0, 2):
        save(tmp_path / f"{number}.png", np.eye(4, k=number, dtype=np.uint8))
    (tmp_path / "1.png").symlink_to("gone.png")
    for where in (tmp_path, f"{tmp_path}/*.png"):
        with sources.open(where, fps=10) as source:
            assert [(frame.index, frame.stamp, frame.name) for frame in source] == [
                (0, 0.0, "0.png"),
                (2, 0.2, "2.png"),
            ]
            assert source.skipped == 1
        assert "skipped frame 1: " in caplog.text
        assert "1.png: cannot be read: No such file or directory" in caplog.text
        caplog.clear()


def test_missing_and_empty(tmp_path):
    with pytest.raises(SourceError, match=r"no file or folder '.*gone\.png'"):
        sources.open(tmp_path / "gone.png")
    with pytest.raises(SourceError, match=r"no file or folder '.*gone\.png'"):
        sources.open([save(tmp_path / "sub" / "a.png", MASK), tmp_path / "gone.png"])
    with pytest.raises(SourceError, match=r"nothing matches the pattern '.*\*\.png'"):
        sources.open(f"{tmp_path}/*.png")
    with pytest.raises(SourceError, match=r"folder .* no file that ends in \.png, \.jpg.*1 other"):
        sources.open(tmp_path)
    (tmp_path / "a.txt").write_text("")
    with pytest.raises(SourceError, match=r"pattern .* no file that ends in \.png"):
        sources.open(f"{tmp_path}/*.txt")


def test_unreadable_folder(tmp_path, monkeypatch):
    def refuse(path):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "iterdir", refuse)
    with pytest.raises(SourceError, match="cannot be read: Permission denied"):
        sources.open(tmp_path)


def test_closing_ends_the_iteration(tmp_path):
    for number in range(3):
        save(tmp_path / f"{number}.png", MASK)
    source = sources.open(tmp_path)
    frames = iter(source)
    next(frames)
    source.close()
    source.close()
    assert list(frames) == []
    with pytest.raises(SourceError, match="closed"):
        iter(source)


def test_one_file_is_read_at_a_time(tmp_path, monkeypatch):
    for number in range(5):
        save(tmp_path / f"{number}.png", MASK)
    read = []
    original = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: read.append(path.name) or original(path))
    with sources.open(tmp_path) as source:
        frames = iter(source)
        next(frames)
        next(frames)
    assert read == ["0.png", "1.png"]


@pytest.mark.parametrize("jobs", [2, 5])
def test_several_files_decoded_at_the_same_time_give_the_same(tmp_path, caplog, jobs):
    for number in range(12):
        cv2.imwrite(str(tmp_path / f"{number}.png"), np.full((20, 30, 3), (number, 2 * number, 9), np.uint8))
    (tmp_path / "3.png").write_bytes(b"no picture")
    (tmp_path / "11.png").write_bytes(b"")
    read = {}
    for count in (1, jobs):
        caplog.clear()
        with sources.open(tmp_path, jobs=count, fps=10) as source:
            frames = [(frame.index, frame.name, frame.stamp, frame.image.tobytes()) for frame in source]
            read[count] = (frames, source.skipped, [record.getMessage() for record in caplog.records])
    assert read[1] == read[jobs]
    assert read[jobs][1] == 2


@pytest.mark.parametrize("jobs", [0, -1, 1.0, True, None])
def test_jobs_must_be_a_count(tmp_path, jobs):
    with pytest.raises(InputError, match="jobs must be an integer of at least 1"):
        sources.open(tmp_path, jobs=jobs)


def names(pattern, folder):
    with sources.open(str(folder / pattern)) as source:
        return [path.relative_to(folder).as_posix() for path in source.paths]


@pytest.fixture
def tree(tmp_path):
    for name in ("a", "x/b", "x/y/c", "x/y/x/d", ".hidden/e", "x/.f", "z/x/g"):
        save(tmp_path / "tree" / f"{name}.png", MASK)
    return tmp_path / "tree"


@pytest.mark.parametrize(
    "pattern",
    [
        "**/*.png",
        "**",
        "x/**",
        "**/x/**/*.png",
        "*/**/*.png",
        "**/**/*.png",
        "./**/*.png",
        "**/[bc].png",
        "**/x/*",
        "[x]/**/c*",
    ],
)
def test_stars_match_as_in_the_glob_of_python(tree, pattern):
    expected = [Path(match) for match in set(glob.glob(str(tree / pattern), recursive=True))]
    assert set(names(pattern, tree)) == {p.relative_to(tree).as_posix() for p in expected if p.is_file()}


def test_stars_from_the_current_folder(tree, monkeypatch):
    monkeypatch.chdir(tree)
    with sources.open("**/*.png") as source:
        assert [str(path) for path in source.paths] == ["a.png", "x/b.png", "x/y/c.png", "x/y/x/d.png", "z/x/g.png"]


def test_stars_visit_each_folder_once_whatever_links_lead_there(tree, tmp_path):
    save(tmp_path / "elsewhere" / "h.png", MASK)
    (tree / "linked").symlink_to(tmp_path / "elsewhere")
    for i in range(12):  # any way through these is a path of its own
        (tree / f"loop{i}").symlink_to(".")
        (tree / "x" / f"up{i}").symlink_to("..")
        (tmp_path / "elsewhere" / f"back{i}").symlink_to(tree)
    (tree / "itself").symlink_to("itself")
    plain = ["a.png", "x/b.png", "x/y/c.png", "x/y/x/d.png", "z/x/g.png"]
    assert sorted(names("**/*.png", tree)) == sorted([*plain, "linked/h.png"])
    assert names("**/linked/*.png", tree) == ["linked/h.png"]
    assert names("**/linked/**/h.png", tree) == ["linked/h.png"]
    assert sorted(names("**", tree)) == sorted([*plain, "linked/h.png"])


def test_a_name_that_is_too_long_is_no_file(tmp_path):
    for name in ("x" * 300, "x" * 300 + "*", "**/" + "x" * 5000):
        with pytest.raises(SourceError, match=r"there is no file or folder|nothing matches the pattern"):
            sources.open(tmp_path / name)


@pytest.mark.parametrize("option", ["where", "depth", "masks"])
def test_an_empty_text_is_not_the_current_folder(tmp_path, monkeypatch, option):
    save(tmp_path / "a.png", COLOUR)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=f"{option} is an empty text"):
        sources.open(**{"where": "a.png", option: ""})


def names_of(where):
    with sources.open(where) as source:
        return [frame.name for frame in source]


def test_files_of_one_name_in_several_folders_are_named_by_their_paths_below_the_common_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    paths = [save(tmp_path / "a" / name, MASK) for name in ("day1/p.png", "day2/p.png", "q.png")]
    assert names_of("a/**/*.png") == ["day1/p.png", "day2/p.png", "q.png"]
    assert names_of([paths[1], "a/day1/../day1/p.png"]) == ["day2/p.png", "day1/p.png"]
    assert names_of([paths[0], paths[2]]) == ["p.png", "q.png"]
    assert names_of([paths[0], paths[0]]) == ["p.png", "p.png"]


SOFT = np.zeros((40, 120), np.uint8)
SOFT[16:24, 10:110] = 255
SOFT[16:24, 50:70] = 100
"""A network's output, sure of a cable but for its middle, of which half brightness makes two pieces."""


def test_a_probability_keeps_its_values_in_a_lossy_file(tmp_path):
    path = save(tmp_path / "a.jpg", SOFT, cv2.IMWRITE_JPEG_QUALITY, 100)
    frame = only(sources.open(path, mask_is="probability"))
    assert frame.mask_is == "probability"
    assert np.abs(frame.mask.astype(int) - SOFT).max() <= 2
    for mask_is in ("auto", "binary"):
        frame = only(sources.open(path, mask_is=mask_is))
        assert frame.mask_is == mask_is
        np.testing.assert_array_equal(frame.mask != 0, SOFT >= 128)


def test_labels_in_a_lossy_file_are_refused(tmp_path, caplog):
    paths = [save(tmp_path / name, SOFT // 100) for name in ("a.jpg", "b.png")]
    with pytest.raises(SourceError, match=r"a\.jpg: a lossy codec changes numbers: save labels as PNG"):
        only(sources.open(paths[0], mask_is="labels"))
    with sources.open(tmp_path, mask_is="labels") as source:
        (frame,) = source
    assert (frame.index, frame.mask_is) == (1, "labels")
    np.testing.assert_array_equal(frame.instances, SOFT // 100)
    assert "a lossy codec changes numbers" in caplog.text


@pytest.mark.parametrize("where", ["", "b.tif"])
def test_floating_point_files_are_what_is_said_of_them(tmp_path, where):
    for name in ("a.tif", "b.tif"):
        save(tmp_path / name, (SOFT > 0).astype(np.float32) * 0.3)
    for mask_is, least in (("auto", 128), ("binary", 1)):
        with sources.open(tmp_path / where, mask_is=mask_is) as source:
            for frame in source:
                assert np.array_equal(frame.is_cable, SOFT > 0) == (least == 1)
