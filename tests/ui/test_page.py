"""The page in a real browser: strokes, sliders, saving, two viewers, sources that end, slow browsers."""

from __future__ import annotations

import re
from contextlib import contextmanager
from threading import Event

import pytest
from ui.page_client import SIZE, CableSource, wait_for
from ui.test_tune_session import along

from dloftbs import Config, Pipeline
from dloftbs.config import SegmentationConfig, Stroke
from dloftbs.segmentation import ColourModel
from dloftbs.ui.frame_store import FrameStore
from dloftbs.ui.server import serve
from dloftbs.ui.tune_session import TuneSession
from dloftbs.ui.view_session import ViewSession

HSV = "5:20,80:255,60:255"


@pytest.fixture(autouse=True)
def one_worker(chromium):
    """Ask for the browser before anything is served."""


@contextmanager
def tuning(target=None, source=None, config=None):
    command = "dloftbs track cable.mp4 --config cable.yaml"
    session = TuneSession(FrameStore(source or CableSource(12)), config or Config(), target, command)
    with serve(session, port=0) as address:
        yield address


@contextmanager
def viewing(source, fps=60.0):
    config = Config(segmentation=SegmentationConfig().with_hsv(HSV))
    session = ViewSession(source, config, source.name, length=source.length, live=source.live, fps=fps)
    with serve(session, port=0) as address:
        yield session, address


def on_screen(page, points):
    """Return where pixels of the frame are shown, in a view that shows it as a whole."""
    box = page.locator("#canvas").bounding_box()
    scale = min(box["width"] / SIZE[1], box["height"] / SIZE[0])
    left = box["x"] + (box["width"] - SIZE[1] * scale) / 2
    top = box["y"] + (box["height"] - SIZE[0] * scale) / 2
    return [(left + (x + 0.5) * scale, top + (y + 0.5) * scale) for x, y in points]


def drag(page, points, *, lift=True):
    first, *rest = on_screen(page, points)
    page.mouse.move(*first)
    page.mouse.down()
    for place in rest:
        page.mouse.move(*place)
    if lift:
        page.mouse.up()


def text_of(page, element):
    return page.locator(element).inner_text()


def wait_for_text(page, element, text):
    page.locator(element, has_text=text).wait_for()


def test_from_strokes_to_a_saved_configuration(open_page, tmp_path):
    target = tmp_path / "cable.yaml"
    with tuning(target) as address:
        page = open_page(address)
        wait_for_text(page, "#hint", "Draw along a cable")
        drag(page, along())
        wait_for_text(page, "#stroke-count", "1 stroke on 1 frame")
        page.locator("#hint").wait_for(state="hidden")  # a curve was found
        page.keyboard.press("n")
        assert page.locator("#tool-not").get_attribute("aria-pressed") == "true"
        drag(page, [(20, 8), (120, 8)])
        wait_for_text(page, "#stroke-count", "2 strokes")
        page.keyboard.press("z")
        wait_for_text(page, "#stroke-count", "1 stroke ")
        page.keyboard.press("Shift+Z")
        wait_for_text(page, "#stroke-count", "2 strokes")
        page.keyboard.press("e")
        drag(page, [(20, 8), (120, 8)])
        wait_for_text(page, "#stroke-count", "1 stroke ")
        page.keyboard.press("ArrowRight")
        wait_for_text(page, "#position", "2 / 12")
        page.keyboard.press("End")
        wait_for_text(page, "#position", "12 / 12")
        page.click("#save")
        wait_for_text(page, "#saved-where", "cable.yaml")
        assert text_of(page, "#command") == "dloftbs track cable.mp4 --config cable.yaml"
    config = Config.from_file(target)
    found = [len(Pipeline(config).detect(CableSource().frame(index))) for index in range(12)]
    assert found == [1] * 12


def test_a_region_of_interest_is_dragged_or_clicked(open_page, tmp_path):
    target = tmp_path / "cable.yaml"
    with tuning(target) as address:
        page = open_page(address)
        wait_for_text(page, "#hint", "Draw along a cable")
        assert page.locator("#region-clear").is_disabled()
        page.keyboard.press("r")
        wait_for_text(page, "#hint", "Drag a rectangle")
        assert page.locator("#region-box").get_attribute("aria-pressed") == "true"
        drag(page, [(20, 10), (80, 50), (119, 99)])
        page.locator("#region-clear:not([disabled])").wait_for()
        assert page.locator("#region-box").get_attribute("aria-pressed") == "false"  # one rectangle, then strokes again
        drag(page, along())
        wait_for_text(page, "#stroke-count", "1 stroke on 1 frame")
        page.locator("#hint").wait_for(state="hidden")
        page.click("#save")
        wait_for_text(page, "#saved-where", "cable.yaml")
        assert Config.from_file(target).region.roi == (20, 10, 100, 90)
        page.click("#region-polygon")
        for corner in [(10, 10), (140, 12), (120, 100), (30, 90)]:
            drag(page, [corner])
        page.keyboard.press("Enter")
        page.locator("#region-polygon[aria-pressed=false]").wait_for()
        page.click("#save")
        page.locator("#text", has_text="- 140").wait_for(state="attached")
        assert Config.from_file(target).region.roi == ((10, 10), (140, 12), (120, 100), (30, 90))
        page.keyboard.press("p")
        drag(page, [(10, 10)])
        page.keyboard.press("Escape")
        page.locator("#region-polygon[aria-pressed=false]").wait_for()
        page.click("#region-clear")
        page.locator("#region-clear[disabled]").wait_for()
        page.click("#undo")
        page.locator("#region-clear:not([disabled])").wait_for()


def test_sliders_and_a_click_on_the_cable(open_page):
    with tuning() as address:
        page = open_page(address)
        page.click("#method-ranges")
        wait_for_text(page, "#hint", "Click on a cable")
        drag(page, [along()[9]])
        page.locator(".range").wait_for()
        page.locator("#hint").wait_for(state="hidden")
        low = page.get_by_label("Value from, range 1")
        before = int(low.input_value())
        low.focus()
        for _ in range(3):
            page.keyboard.press("ArrowRight")
        wait_for_text(page, ".bounds:nth-of-type(4)", f"{before + 3} to 255")
        assert page.locator("#position").inner_text() == "1 / 12"  # the arrows moved the slider alone
        low.fill("250")
        wait_for_text(page, "#hint", "No curve")
        page.click("text=Remove")
        page.locator(".range").wait_for(state="detached")
        page.click("#undo")
        page.locator(".range").wait_for()


def test_a_late_answer_undoes_no_newer_change(chromium):
    held, routes = [], []

    def hold_states(route):
        routes.append(route)
        is_state = re.compile('"type":"state"').search
        server = route.connect_to_server()
        server.on_message(lambda text: (held.append if isinstance(text, str) and is_state(text) else route.send)(text))

    def answer(page):
        wait_for(lambda: page.wait_for_timeout(20) or held)
        routes[0].send(held.pop(0))
        page.wait_for_timeout(50)  # the page has taken it in

    with tuning() as address, chromium.new_context(viewport={"width": 1000, "height": 700}) as context:
        page = context.new_page()
        page.route_web_socket("**/socket", hold_states)
        page.goto(address.url)
        answer(page)
        for button in ("#method-ranges", "#add-range"):
            page.click(button)
            answer(page)
        low = page.get_by_label("Value from, range 1")
        before = int(low.input_value())
        low.focus()
        for count in (1, 2):
            page.keyboard.press("ArrowRight")
            wait_for(lambda count=count: page.wait_for_timeout(20) or len(held) == count)
        answer(page)  # to the first
        assert low.input_value() == str(before + 2)
        page.keyboard.press("ArrowRight")
        for _ in range(2):
            answer(page)
        assert low.input_value() == str(before + 3)
        assert text_of(page, ".bounds:nth-of-type(4)").endswith(f"{before + 3} to 255")
        page.click("#undo")
        answer(page)
        assert low.input_value() == str(before + 2)


def test_the_guess_the_help_sheet_and_the_layers(open_page):
    with tuning() as address:
        page = open_page(address)
        page.locator("#accept").wait_for()
        page.keyboard.press("?")
        wait_for_text(page, "#keys", "Brush smaller, larger")
        page.keyboard.press("Escape")
        page.keyboard.press("g")
        wait_for_text(page, "#stroke-count", "on 1 frame")
        page.keyboard.press("2")
        assert page.locator("#show-mask").get_attribute("aria-pressed") == "false"
        size = page.locator("#brush-size").inner_text()
        page.keyboard.press("]")
        assert page.locator("#brush-size").inner_text() != size
        page.keyboard.press("+")
        page.keyboard.press("0")


def test_two_browsers_see_the_same_strokes(open_page):
    with tuning() as address:
        one, two = open_page(address), open_page(address)
        wait_for_text(two, "#hint", "Draw along")
        drag(one, along())
        wait_for_text(two, "#stroke-count", "1 stroke")
        two.close()
        drag(one, [(20, 110), (60, 110)])
        wait_for_text(one, "#stroke-count", "2 strokes")


def test_strokes_on_other_pictures_are_told_and_can_be_cleared(open_page):
    model = ColourModel.fit(CableSource().frame(0).image, [Stroke(points=along())], source="other.mp4, frame 0")
    config = Config(segmentation=SegmentationConfig(colour=model.to_config()))
    with tuning(config=config) as address:
        page = open_page(address)
        wait_for_text(page, "#stroke-count", "strokes on other pictures")
        page.click("#clear")
        wait_for_text(page, "#stroke-count", "No strokes yet")


def saved_text(page):
    page.click("#save")
    page.locator("#text", has_text="sample").wait_for(state="attached")
    return page.locator("#text").text_content()


def test_a_stroke_belongs_to_the_frame_that_is_shown_while_the_next_is_on_its_way(open_page):
    reached, go_on = Event(), Event()

    class Slow(CableSource):
        def frame(self, index):
            if index == 1:
                reached.set()
                go_on.wait(20.0)
            return super().frame(index)

    with tuning(source=Slow(12)) as address:
        page = open_page(address)
        wait_for_text(page, "#hint", "Draw along a cable")
        assert reached.wait(20.0)
        page.keyboard.press("ArrowRight")
        drag(page, along())
        go_on.set()
        wait_for_text(page, "#stroke-count", "1 stroke on 1 frame")
        assert "source: cable.mp4, frame 0" in saved_text(page)
        wait_for_text(page, "#position", "1 / 12")


def test_drawing_stops_the_playback(open_page):
    with tuning(source=CableSource(400)) as address:
        page = open_page(address)
        wait_for_text(page, "#hint", "Draw along a cable")
        page.keyboard.press("Space")
        page.locator("#position", has_not_text=re.compile("^1 /")).wait_for()
        first, *rest = on_screen(page, along())
        page.mouse.move(*first)
        page.mouse.down()
        held = text_of(page, "#position")
        for place in rest:
            page.mouse.move(*place)
            page.wait_for_timeout(40)
        page.mouse.up()
        wait_for_text(page, "#stroke-count", "1 stroke on 1 frame")
        assert f"source: cable.mp4, frame {int(held.split()[0]) - 1}\n" in saved_text(page)
        assert text_of(page, "#position") == held


def test_drawing_on_a_camera_holds_the_frame_that_is_shown(open_page):
    go_on = Event()

    class Camera(CableSource):
        def frame(self, index):
            if index == 3:
                go_on.wait(20.0)
            return super().frame(index)

    with tuning(source=Camera(12, live=True)) as address:
        page = open_page(address)
        wait_for_text(page, "#position", "3 /")
        drag(page, along(0.06), lift=False)
        page.locator("#live[aria-pressed=false]").wait_for()
        go_on.set()
        page.wait_for_timeout(500)
        page.mouse.up()
        wait_for_text(page, "#stroke-count", "1 stroke on 1 frame")
        assert "source: cable.mp4, frame 2" in saved_text(page)
        wait_for_text(page, "#position", "3 /")


def test_a_finger_draws_on_a_phone(open_page):
    with tuning() as address:
        page = open_page(address, viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
        wait_for_text(page, "#hint", "Draw along")
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        touch = page.context.new_cdp_session(page)
        places = [{"x": x, "y": y} for x, y in on_screen(page, along())]
        touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": places[:1]})
        for place in places[1:]:
            touch.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [place]})
        touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        wait_for_text(page, "#stroke-count", "1 stroke on 1 frame")


@pytest.mark.parametrize("cancelled", [False, True])
def test_a_second_finger_takes_back_what_the_first_began(open_page, cancelled):
    with tuning() as address:
        page = open_page(address, viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
        page.locator("#accept").wait_for()
        touch = page.context.new_cdp_session(page)
        places = [{"x": x, "y": y, "id": 0} for x, y in on_screen(page, along())]
        touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": places[:1]})
        for place in places[1:]:
            touch.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [place]})
        page.locator("#accept").wait_for(state="hidden")  # the mask is the draft's
        if cancelled:
            touch.send("Input.dispatchTouchEvent", {"type": "touchCancel", "touchPoints": []})
        else:
            both = [places[-1], {**places[0], "id": 1}]
            touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": both})
            touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        page.locator("#accept").wait_for()
        assert text_of(page, "#stroke-count") == "No strokes yet."


def test_two_fingers_on_a_camera_leave_it_live(open_page):
    with tuning(source=CableSource(400, live=True)) as address:
        page = open_page(address, viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
        page.locator("#live[aria-pressed=true]").wait_for()
        wait_for_text(page, "#hint", "Draw along a cable")
        touch = page.context.new_cdp_session(page)
        first, *_, last = [{"x": x, "y": y, "id": 0} for x, y in on_screen(page, along())]
        touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [first]})
        touch.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [last]})
        page.locator("#live[aria-pressed=false]").wait_for()
        touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [last, {**first, "id": 1}]})
        page.locator("#live[aria-pressed=true]").wait_for()
        touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        assert text_of(page, "#stroke-count") == "No strokes yet."


def test_a_recording_that_ends_can_be_stepped_looped_and_begun_again(open_page):
    with viewing(CableSource(30)) as (session, address):
        page = open_page(address)
        wait_for_text(page, "#hint", "The source has ended")
        wait_for_text(page, "#objects", "#1")
        wait_for_text(page, "#position", "30 / 30")
        wait_for_text(page, "#legend", "tracking")
        page.keyboard.press("ArrowRight")  # the step waits for the beginning
        page.click("#restart")
        wait_for_text(page, "#position", "1 / 30")
        page.click("#next")
        wait_for_text(page, "#position", "2 / 30")
        page.keyboard.press("l")
        page.keyboard.press("Space")
        page.locator("#loop[aria-pressed=true]").wait_for()
        page.locator("#hint").wait_for(state="hidden")
        page.close()
        wait_for(lambda: len(session.audience) == 0)


def test_play_at_the_end_begins_anew_and_goes_on(open_page):
    with viewing(CableSource(6), fps=5.0) as (_, address):
        page = open_page(address)
        wait_for_text(page, "#hint", "The source has ended")
        page.click("#restart")
        page.locator("#hint").wait_for(state="hidden")
        for _ in range(7):  # steps, after which it holds
            page.click("#next")
        wait_for_text(page, "#hint", "The source has ended")
        page.click("#play")
        page.locator("#hint").wait_for(state="hidden")
        wait_for_text(page, "#hint", "The source has ended")


def test_a_slow_browser_sees_the_newest_frame_and_holds_nobody_up(open_page):
    with viewing(CableSource(90)) as (_, address):
        slow = open_page(address)
        slow.context.new_cdp_session(slow).send("Emulation.setCPUThrottlingRate", {"rate": 20})
        fast = open_page(address)
        for page in (fast, slow):
            wait_for_text(page, "#position", "90 / 90")
            wait_for_text(page, "#hint", "ended")


def test_a_command_that_ends_is_told(open_page):
    with viewing(CableSource(5)) as (_, address):
        page = open_page(address)
        wait_for_text(page, "#hint", "ended")
    wait_for_text(page, "#offline", "Not connected")


def test_the_field_for_cables_and_the_legend_of_the_strip(open_page):
    with tuning() as address:
        page = open_page(address)
        page.locator("#accept").wait_for()
        page.keyboard.press("g")
        wait_for_text(page, "#strip-legend", "Blue: 1, as in most frames")
        page.fill("#cables", "2")
        page.keyboard.press("Enter")
        page.click("#save")
        wait_for_text(page, "#command", "--objects 2")
        assert "objects: 2" in page.locator("#text").text_content()
