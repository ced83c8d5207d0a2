"""Reports and data cards in a browser: for all readers, on light and dark screens, small ones, and paper."""

import shutil
from dataclasses import replace

import pytest
from accessible import findings
from finished import finished_run
from samples import sample, toy_dataset, write_dataset

from meshshard_train.commands.report import report
from meshshard_train.recipes import paper
from meshshard_train.seeds import folder_of, write_seeds

pytestmark = pytest.mark.browser

CONFIG = paper("segmentation", width=16, epochs=2, batch_vertices=100, precision="fp32")
KINDS = ("run", "seeds", "shards", "unlabelled", "unfinished")


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """A page of each kind."""
    root = tmp_path_factory.mktemp("pages")
    shards = toy_dataset(root / "shards")
    finished_run(shards, root / "run", CONFIG)
    every = [finished_run(shards, folder_of(root / "seeds", seed), replace(CONFIG, seed=seed)) for seed in (0, 1)]
    write_seeds(root / "seeds", every)
    shutil.copytree(root / "run", root / "unfinished")
    (root / "unfinished" / "results.json").unlink()
    write_dataset(root / "unlabelled", [sample(0, labels=None)], [""], task="unlabelled", classes=())
    for kind in KINDS:
        report(str(root / kind), out=root / f"{kind}.html")
    return root


@pytest.fixture
def shown(browser, pages):
    """Opens a page, and takes down what it asks for and complains of."""
    opened, said = [], []

    def show(kind, **options):
        window = browser.new_page(**options)
        opened.append(window)
        window.on("console", lambda message: said.append(message.text))
        window.on(
            "request",
            lambda request: None if request.url.startswith(("file:", "data:")) else said.append(request.url),
        )
        window.goto((pages / f"{kind}.html").as_uri())
        return window

    yield show
    assert said == []
    for window in opened:
        window.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("kind", KINDS)
def test_nothing_keeps_anybody_out(shown, kind, scheme, tmp_path):
    window = shown(kind, color_scheme=scheme)
    assert findings(window) == []
    window.screenshot(path=tmp_path / f"{kind}-{scheme}.png", full_page=True)
    back = window.evaluate("getComputedStyle(document.body).backgroundColor")
    assert back == {"light": "rgb(255, 255, 255)", "dark": "rgb(22, 24, 28)"}[scheme]


@pytest.mark.parametrize("kind", KINDS)
def test_on_paper_and_on_a_phone_nothing_is_cut_off(shown, kind, tmp_path):
    window = shown(kind, viewport={"width": 360, "height": 700}, color_scheme="dark")
    width = "document.documentElement.scrollWidth"
    assert window.evaluate(width) <= 360
    window.set_viewport_size({"width": 720, "height": 1000})
    window.emulate_media(media="print")
    assert window.evaluate(width) <= 720
    hidden = (
        "[...document.querySelectorAll('.scroll')].filter(e => e.scrollWidth > e.clientWidth).map(e => e.ariaLabel)"
    )
    assert window.evaluate(hidden) == []
    assert window.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    window.pdf(path=tmp_path / "page.pdf", format="A4")


def test_the_keyboard_reaches_parts_and_tables(shown):
    window = shown("run")
    focused = "document.activeElement.textContent.trim() || document.activeElement.tagName"
    window.keyboard.press("Tab")
    assert window.evaluate(focused) == "Results"
    window.keyboard.press("Tab")
    window.keyboard.press("Enter")
    assert window.url.endswith("#curves")
    assert -1 < window.evaluate("document.getElementById('curves').getBoundingClientRect().top") < 720
    window.goto(window.url.split("#")[0])
    reached = set()
    for _ in range(30):
        window.keyboard.press("Tab")
        reached.add(window.evaluate("document.activeElement.getAttribute('aria-label')"))
    assert {text.split(",")[0] for text in reached if text} >= {"All figures", "val", "test", "Confusion matrix"}
