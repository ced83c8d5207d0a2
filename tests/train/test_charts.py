"""Lines as what an SVG needs."""

import math
import re

import pytest

from meshshard_train.report.charts import DASHES, HEIGHT, WIDTH, Line, chart


def places(path):
    """Of each part of a path its points."""
    return [[tuple(map(float, point.split())) for point in part.split("L")] for part in path.split("M")[1:]]


def test_points_stand_where_the_numbers_of_the_axes_say():
    drawn = chart("loss", "epoch", [Line("loss", [(0, 2.0), (1, 1.0), (2, 0.0)])], {"best": 2})
    ((first, _, last),) = places(drawn["lines"][0]["path"])
    at = {(tick["text"]): float(tick["at"]) for tick in drawn["x_ticks"]}
    up = {(tick["text"]): float(tick["at"]) for tick in drawn["y_ticks"]}
    assert first == (at["0"], up["2"])
    assert last == (at["2"], up["0"])
    assert drawn["marks"] == [{"at": f"{at['2']:.1f}", "text": "best"}]
    assert drawn["summary"] == "loss: from 2 at epoch 0 to 0 at 2, least 0, most 2"


@pytest.mark.parametrize("values", [[5.0], [0.0, 0.0], [-3.5, 1e6], [1e-9, 3e-9], [0.2, 0.21, 0.205]])
def test_everything_is_within_the_picture(values):
    drawn = chart("a", "x", [Line("a", list(enumerate(values)))])
    numbers = [float(n) for n in re.findall(r"-?[\d.]+", drawn["lines"][0]["path"])]
    assert all(0 <= x <= WIDTH for x in numbers[::2])
    assert all(0 <= y <= HEIGHT for y in numbers[1::2])
    assert 2 <= len(drawn["y_ticks"]) <= 7


def test_epochs_are_whole_numbers():
    drawn = chart("a", "epoch", [Line("a", [(0, 1.0), (1, 2.0), (2, 3.0)])])
    assert [tick["text"] for tick in drawn["x_ticks"]] == ["0", "1", "2"]


def test_what_is_no_number_leaves_a_gap():
    drawn = chart("a", "x", [Line("a", [(0, 1.0), (1, 2.0), (2, math.nan), (3, 1.0), (4, math.inf)])])
    assert [len(part) for part in places(drawn["lines"][0]["path"])] == [2, 2]  # a point alone is a stroke
    assert chart("a", "x", [Line("b", [(0, math.nan)])]) == {"title": "a", "summary": "a: no numbers", "lines": []}
    some = chart("a", "x", [Line("b", [(0, 1.0)]), Line("c", [(0, math.nan)])])
    assert some["summary"].endswith("; a, c: no numbers")


def test_lines_are_told_apart_without_colour():
    drawn = chart("a", "x", [Line(str(n), [(0, n), (1, n)]) for n in range(len(DASHES))])
    assert [line["dash"] for line in drawn["lines"]] == list(DASHES)
    assert len(set(DASHES)) == len(DASHES)
