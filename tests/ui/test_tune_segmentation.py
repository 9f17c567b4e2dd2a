import msgspec
import numpy as np
import pytest
from drawings import draw_cable, wave
from ui.page_client import SIZE, CableSource

import dloftbs
from dloftbs.config import HsvRange, NetworkConfig, PlaneConfig, SegmentationConfig
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs.segmentation.pixel_samples import PixelSample
from dloftbs.ui.tune_document import DrawnStroke, TuneDocument
from dloftbs.ui.tune_segmentation import Translator, strokes_along

CABLE = DrawnStroke(2, ((90.0, 60.0), (110.0, 60.0)), True, 2.0)
GROUND = DrawnStroke(3, ((5.0, 5.0), (60.0, 5.0)), False, 2.0)


def translator(section=SegmentationConfig(), name="cable.mp4", looked_at=None, **options):  # noqa: B008 - frozen
    def frame_of(index):
        if looked_at is not None:
            looked_at.append(index)
        return CableSource().frame(index)

    return Translator(name, frame_of, section, **options)


@pytest.mark.parametrize(
    "section",
    [
        SegmentationConfig(),
        SegmentationConfig(hsv=(HsvRange.parse("170:10"), HsvRange.parse("20:35,0:9,3:4"))),
        SegmentationConfig(plane=PlaneConfig(height_m=0.004, join="or")),
        SegmentationConfig(onnx=NetworkConfig(file="net.onnx")),
        SegmentationConfig(local="darker"),
        SegmentationConfig(background="empty.png", hsv=(HsvRange.parse("170:10"),)),
        SegmentationConfig(mask_is="binary"),
    ],
)
def test_a_section_comes_back_as_it_was(section):
    there = translator(section)
    assert there.section_of(there.first) == section
    assert there.first.is_empty == (not section.is_given)


def test_what_the_page_does_not_change_of_a_colour_is_kept():
    section = translator().section_of(TuneDocument(strokes=(CABLE,)))
    red, green = HsvRange.parse("170:10"), HsvRange.parse("40:80")
    colour = msgspec.structs.replace(section.colour, follow_light=False)
    section = msgspec.structs.replace(section, colour=colour, hsv=(red,))
    there = translator(section)
    assert (there.first.method, there.first.ranges, there.first.kept) == ("strokes", (), True)
    assert there.section_of(there.first) == section
    ranges = msgspec.structs.replace(there.first, method="ranges", ranges=((40, 80, 40, 255, 40, 255),))
    assert there.section_of(ranges) == SegmentationConfig(hsv=(red, green))


def test_strokes_come_back_with_their_frames_and_the_same_colours():
    document = TuneDocument(strokes=(CABLE, GROUND))
    section = translator().section_of(document)
    assert [picture.source for picture in section.colour.pictures] == ["cable.mp4, frame 2", "cable.mp4, frame 3"]
    again = translator(section)
    assert again.first == document
    assert again.section_of(again.first) == section
    other = translator(section, "other.mp4")
    assert (other.first.strokes, len(other.first.others)) == ((), 2)
    assert other.section_of(other.first) == section


def test_frames_whose_strokes_stay_are_not_looked_at_again():
    looked_at = []
    there = translator(looked_at=looked_at)
    there.section_of(TuneDocument(strokes=(CABLE,)))
    there.section_of(TuneDocument(strokes=(CABLE, GROUND)))
    assert looked_at == [2, 3]


@pytest.mark.parametrize("roi", [None, (20, 10, 150, 100)])
def test_stored_colours_stay_until_the_strokes_of_their_frame_change(roi):
    section = translator().section_of(TuneDocument(strokes=(CABLE,), roi=roi))
    looked_at = []
    there = translator(section, looked_at=looked_at, roi=roi)
    first = msgspec.structs.replace(there.first, roi=roi)
    assert there.section_of(first) == section
    (stored, _) = there.section_of(first.with_stroke(GROUND)).colour.pictures
    assert stored == section.colour.pictures[0]
    assert looked_at == [3]
    there.section_of(first.with_stroke(msgspec.structs.replace(CABLE, cable=False)))
    assert looked_at == [3, 2]
    assert there.section_of(first) == section  # undone


def test_a_draft_beside_stored_strokes_looks_at_its_own_frame_alone():
    section = translator().section_of(TuneDocument(strokes=(CABLE,)))
    looked_at = []
    there = translator(section, looked_at=looked_at)
    draft = there.draft_of(there.first.with_stroke(GROUND))
    assert looked_at == [3]
    assert draft(CableSource().frame(2)).sum() > 500


def test_stored_strokes_on_a_camera_are_on_pictures_that_are_gone():
    section = translator(name="camera 0").section_of(TuneDocument(strokes=(CABLE,)))
    there = translator(section, "camera 0", live=True)
    assert (there.first.strokes, there.first.others) == ((), section.colour.pictures)
    assert there.section_of(there.first) == section


def test_of_two_pictures_of_one_frame_both_are_kept():
    section = translator().section_of(TuneDocument(strokes=(CABLE,)))
    colour = msgspec.structs.replace(section.colour, pictures=2 * section.colour.pictures)
    twice = msgspec.structs.replace(section, colour=colour)
    there = translator(twice)
    assert (len(there.first.strokes), len(there.first.others)) == (1, 1)
    assert there.section_of(there.first) == twice


def test_strokes_on_many_frames_keep_as_many_samples_as_on_two():
    strokes = [msgspec.structs.replace(CABLE, frame=index) for index in range(8)]
    section = translator().section_of(TuneDocument(strokes=tuple(strokes)))
    assert translator(section).section_of(translator(section).first) == section  # once is enough
    samples = [PixelSample.from_text(picture.pixels) for picture in section.colour.pictures]
    assert sum(kind.shape[1] for sample in samples for kind in sample.kinds) <= 2 * (1200 + 400 + 400 + 2400)


def test_strokes_on_ground_alone_are_samples_as_wide_as_the_cables_of_other_frames():
    there, first = translator(), TuneDocument(strokes=(GROUND,))
    assert there.section_of(first).colour is None
    section = there.section_of(TuneDocument(strokes=(GROUND, CABLE)))
    cable, ground = (PixelSample.from_text(picture.pixels) for picture in section.colour.pictures)
    assert (cable.shows_cables, ground.shows_cables) == (True, False)
    assert ground.width_px == pytest.approx(cable.width_px)
    assert section == translator().section_of(TuneDocument(strokes=(CABLE, GROUND)))
    assert translator(section).section_of(translator(section).first) == section


def test_parts_beside_the_image_are_left_out():
    outside = DrawnStroke(2, ((-5.0, 60.0), (90.0, 60.0), (5e4, 60.0), (110.0, 60.0)), True, 2.0)
    (picture,) = translator().section_of(TuneDocument(strokes=(outside,))).colour.pictures
    assert picture.cable == ("90,60", "110,60")
    assert translator().section_of(TuneDocument(strokes=(DrawnStroke(2, ((-5.0, 0.0),), True, 2.0),))).colour is None


def test_a_stroke_to_the_last_pixel_of_a_large_frame_is_drafted():
    image = np.full((1080, 1920, 3), 100, np.uint8)
    image[493:508] = (40, 30, 200)
    large = Frame(image=image)
    there = Translator("large", lambda index: large, SegmentationConfig())
    stroke = DrawnStroke(0, ((1500.0, 500.0), (1919.0, 500.0)), True, 4.0)
    mask = there.draft_of(TuneDocument(strokes=(stroke,)))(large)
    assert mask[495:506].all()
    assert not mask[:490].any()


def test_a_document_that_says_nothing_makes_no_mask():
    with pytest.raises(InputError, match="draw a stroke"):
        translator().segmenter_of(TuneDocument(strokes=(GROUND,)))


def test_strokes_along_curves_stay_on_what_is_seen():
    mask = draw_cable(wave(SIZE), 7, SIZE)
    mask[:, 95:104] = 0
    image = np.full((*SIZE, 3), 90, np.uint8)
    image[mask > 0] = 30
    image[:, 95:104] = (10, 200, 10)  # hides the cable
    strokes = strokes_along(4, dloftbs.detect(mask, image=image))
    assert len(strokes) == 2
    for stroke in strokes:
        assert (stroke.frame, stroke.cable) == (4, True)
        assert 1.0 <= stroke.radius_px < 3.5
        columns, rows = np.round(stroke.points).astype(int).T
        assert mask[rows, columns].mean() > 0.9
