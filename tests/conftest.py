"""Where the research data and a browser are, and what is skipped without them."""

import os
import shutil
import signal
from pathlib import Path

import pytest
from research_data import DATA

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
SOFTWARE_WEBGL = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")

# Tests run side by side, a process a core. Set here, before the processes begin that xdist starts and load BLAS.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# in the background of a shell Ctrl-C is ignored, and so it would be by every process that a test starts
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def browser():
    """A Chromium without a window, for tests marked `browser`."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=[*SOFTWARE_WEBGL, "--no-sandbox"])
        yield chromium
        chromium.close()


@pytest.fixture(scope="session")
def data_root() -> Path:
    """The folder of the research data; only tests marked `data` may ask for it."""
    return DATA


def pytest_collection_modifyitems(items):
    for item in items:
        if "data" in item.keywords and not DATA.is_dir():
            item.add_marker(pytest.mark.skip(reason="no research data; set MESHSHARD_DATA to its folder"))
        if "browser" in item.keywords and CHROMIUM is None:
            item.add_marker(pytest.mark.skip(reason="no Chromium"))


@pytest.fixture
def measured(record_property):
    """Call it with a goal's name and a figure: `make soak` prints the lines, docs/reliability.md quotes them."""
    return lambda goal, figure: record_property("measured", f"{goal}: {figure}")


def pytest_terminal_summary(terminalreporter):
    reports = [report for name in ("passed", "failed") for report in terminalreporter.stats.get(name, [])]
    for line in sorted({text for report in reports for key, text in report.user_properties if key == "measured"}):
        terminalreporter.write_line(line)
    skipped = terminalreporter.stats.get("skipped", [])
    if not DATA.is_dir():
        count = sum("data" in report.keywords for report in skipped)
        terminalreporter.write_line(f"{count} tests need the research data and were skipped: set MESHSHARD_DATA")
    if CHROMIUM is None:
        count = sum("browser" in report.keywords for report in skipped)
        terminalreporter.write_line(f"{count} tests need a browser and were skipped: install chromium")
