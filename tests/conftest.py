"""Where the research data is, and what is skipped without it."""

from pathlib import Path

import pytest
from research_data import DATA


@pytest.fixture(scope="session")
def data_root() -> Path:
    """The folder of the research data; only tests marked `data` may ask for it."""
    return DATA


def pytest_collection_modifyitems(items):
    if not DATA.is_dir():
        for item in items:
            if "data" in item.keywords:
                item.add_marker(pytest.mark.skip(reason="no research data; set MESHSHARD_DATA to its folder"))


@pytest.fixture
def measured(record_property):
    """Call it with a goal's name and a figure: `make soak` prints the lines, docs/reliability.md quotes them."""
    return lambda goal, figure: record_property("measured", f"{goal}: {figure}")


def pytest_terminal_summary(terminalreporter):
    reports = [report for name in ("passed", "failed") for report in terminalreporter.stats.get(name, [])]
    for line in sorted({text for report in reports for key, text in report.user_properties if key == "measured"}):
        terminalreporter.write_line(line)
    if not DATA.is_dir():
        count = sum("data" in report.keywords for report in terminalreporter.stats.get("skipped", []))
        terminalreporter.write_line(f"{count} tests need the research data and were skipped: set MESHSHARD_DATA")
