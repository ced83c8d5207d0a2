"""The page in a browser."""

import io
import re
import threading
import time

import numpy as np
import pytest
from PIL import Image
from samples import sample, write_dataset

from meshshard import open_dataset
from meshshard.view.opinion import Judge, Opinion
from meshshard.view.page import Page
from meshshard.view.serving import Server

pytestmark = pytest.mark.browser

SCENE = {"x": 260, "y": 160, "width": 690, "height": 690}
"""Of a window of 1280 by 860: what is between the panels, below messages."""

MISLABELLED, MESHES = 9, 14


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    """Where a page answers, of a network that is right everywhere; one mesh has labels in disorder."""
    samples = [sample(n, level=2 + n % 2) for n in range(MESHES)]
    truth = [mesh.face_labels.copy() for mesh in samples]
    samples[MISLABELLED].face_labels[:] = np.roll(truth[MISLABELLED], len(truth[MISLABELLED]) // 3)
    splits = ["train"] * 8 + ["val"] * 3 + ["test"] * 3
    folder = write_dataset(tmp_path_factory.mktemp("shards"), samples, splits, cuts=(12,))
    (folder / "shard-1.h5").write_bytes(b"damaged")
    dataset = open_dataset(folder)

    def opinions(numbers):
        for number in numbers:
            right = samples[number].face_labels == truth[number]
            yield Opinion(truth[number], float(right.mean()))

    names = {"name": "run", "classes": dataset.classes, "colours": (), "element": "faces", "score": "accuracy"}
    server = Server("127.0.0.1", 0, verbose=False)
    page = Page(server, dataset, Judge(**names, opinions=opinions))
    threading.Thread(target=page.work, daemon=True).start()
    yield f"http://127.0.0.1:{server.get_port()}"
    server.stop()


@pytest.fixture(scope="module")
def said():
    """Errors on the browser's console, and requests that leave this machine."""
    return []


@pytest.fixture(scope="module")
def page(browser, address, said):
    window = browser.new_page(viewport={"width": 1280, "height": 860})
    window.on("console", lambda message: said.append(message.text) if message.type == "error" else None)
    window.on("pageerror", lambda error: said.append(str(error)))
    local = (address, "data:", "blob:")
    window.on("request", lambda request: None if request.url.startswith(local) else said.append(request.url))
    window.goto(address)
    window.get_by_role("button", name="Save PNG").wait_for()
    until(lambda: (seen(window) < 250).any())
    yield window
    window.close()


def until(true, seconds=20):
    """Wait for it."""
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "it did not become true in time"
        time.sleep(0.1)


def seen(page):
    """The scene, (690, 690, 3)."""
    return np.array(Image.open(io.BytesIO(page.screenshot(clip=SCENE))).convert("RGB"))


def choose(page, control, value):
    page.get_by_label(control, exact=True).click()
    page.get_by_role("option", name=value, exact=True).click()


def changed_by(page, act):
    """The scene after something was done, as soon as it is another one."""
    before = seen(page)
    act()
    until(lambda: (seen(page) != before).any())
    return seen(page)


def test_the_mislabelled_mesh_is_the_first_with_its_score_and_a_picture(page):
    first = page.get_by_role("button", name=re.compile(r"mesh\d"))
    until(lambda: first.first.inner_text().endswith(f" % · mesh{MISLABELLED:03}"))
    assert first.count() == 6
    assert page.get_by_text(f"{MESHES} of {MESHES} meshes").is_visible()

    def pictures():
        return page.evaluate(
            "[...document.images].filter(i => i.src.startsWith('blob:') && i.complete).map(i => i.naturalWidth)"
        )

    until(lambda: pictures() == [208] * 6)  # label and prediction
    first.first.click()
    page.get_by_text(re.compile("val, .* vertices, .* faces; accuracy")).wait_for()
    assert page.get_by_text(f"mesh{MISLABELLED:03}", exact=True).is_visible()


def test_label_and_prediction_are_side_by_side(page):
    covered = (seen(page) < 250).any(axis=(0, 2))
    assert covered[100:300].any()
    assert not covered[340:350].any()
    assert covered[400:600].any()


def test_the_mesh_is_in_the_middle_again_when_it_is_alone(page):
    changed_by(page, lambda: choose(page, "beside it", "nothing"))
    until(lambda: abs(np.flatnonzero((seen(page) < 250).any(axis=(0, 2))).mean() - 345) < 10)
    changed_by(page, lambda: choose(page, "beside it", "prediction"))


@pytest.mark.parametrize("what", ["errors", "heat kernel signature", "mean dihedral angle", "normals"])
def test_colours_and_legend_follow_the_choice(page, what):
    changed_by(page, lambda: choose(page, "colour", what))
    assert page.locator("b", has_text=re.compile(f"^{what}$")).is_visible()


def test_colours_follow_the_time(page):
    changed_by(page, lambda: choose(page, "colour", "heat kernel signature"))
    assert page.get_by_text("at t = 0.01 squared radii").is_visible()
    track = page.locator(".mantine-Slider-track").nth(1).bounding_box()
    changed_by(page, lambda: page.mouse.click(track["x"] + track["width"] / 2, track["y"] + track["height"] / 2))
    page.get_by_text(re.compile(r"at t = 0\.1\d* squared radii|at t = 0\.08\d* squared radii")).wait_for()


def test_a_wireframe_is_drawn(page):
    wires = page.get_by_label("wireframe", exact=True)
    plain = seen(page)
    drawn = changed_by(page, lambda: wires.click(force=True))
    until(lambda: (seen(page).max(axis=2) < 60).sum() > 100)
    assert drawn.shape == plain.shape
    changed_by(page, lambda: wires.click(force=True))


def test_names_of_controls_are_as_dark_as_other_words(page):
    shade = "element => getComputedStyle(element).color"
    name = page.locator("label", has_text=re.compile("^wireframe$"))
    assert name.evaluate(shade) == page.get_by_text("Click a vertex").evaluate(shade) == "rgb(0, 0, 0)"


def test_the_page_can_be_dark(page):
    dark = page.get_by_role("checkbox", name="dark", exact=True)
    assert seen(page)[0, 0].min() > 200
    dark.click(force=True)
    until(lambda: seen(page)[0, 0].max() < 80)
    dark.click(force=True)
    until(lambda: seen(page)[0, 0].min() > 200)


def test_a_click_on_the_mesh_plots_its_vertex(page):
    choose(page, "beside it", "nothing")
    until(lambda: (seen(page)[300:390, 300:390] < 250).any(axis=2).all())
    time.sleep(0.5)
    page.mouse.click(SCENE["x"] + 345, SCENE["y"] + 270)
    page.get_by_text(re.compile(r"vertex \d+: mean dihedral angle")).wait_for()
    assert page.get_by_text(re.compile(r"face \d+: label (low|middle|high)")).is_visible()
    assert page.locator(".uplot canvas").is_visible()
    until(lambda: magenta(page) > 20)
    changed_by(page, lambda: choose(page, "colour", "mean dihedral angle"))
    time.sleep(0.5)
    assert page.get_by_text(re.compile(r"vertex \d+: mean dihedral angle")).is_visible()
    assert magenta(page) > 20


def magenta(page):
    """Pixels of the mark."""
    red, green, blue = np.moveaxis(seen(page).astype(int), -1, 0)
    return ((red - green > 60) & (blue - green > 60) & (abs(red - blue) < 40)).sum()


def test_the_scene_is_saved_as_png(page):
    with page.expect_download() as download:
        page.get_by_role("button", name="Save PNG").click()
    assert download.value.suggested_filename == f"mesh{MISLABELLED:03}.png"
    picture = np.array(Image.open(download.value.path()))
    assert 0.1 < (picture[..., 3] > 0).mean() < 0.9


def test_meshes_are_found_by_words_and_one_after_the_other(page):
    find = page.locator(".mantine-TextInput-input").first
    find.fill("train")
    page.get_by_text(f"8 of {MESHES} meshes").wait_for()
    page.get_by_role("button", name="next", exact=True).click()
    page.get_by_text(re.compile("train, .* faces")).wait_for()
    find.fill("")


def test_a_damaged_shard_is_told_and_the_page_goes_on(page):
    page.locator(".mantine-TextInput-input").first.fill("mesh013")
    page.get_by_role("button", name=re.compile("mesh013")).click()
    alert = page.get_by_role("alert").filter(has_text="shard-1.h5")
    alert.wait_for()
    page.locator(".mantine-TextInput-input").first.fill("mesh001")
    page.get_by_role("button", name=re.compile("mesh001")).click()
    alert.wait_for(state="detached")


def test_the_console_has_no_errors_and_nothing_is_loaded_from_elsewhere(said):
    assert said == []
