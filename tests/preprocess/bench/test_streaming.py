import json

import pytest

from meshshard_prep.bench import streaming


def test_every_figure_is_measured_and_on_the_page(tmp_path):
    figures = streaming.streaming(vertices=60, meshes=8, shards=2, many=40)
    assert (figures["many"], figures["many_shards"]) == (40, 5)
    assert all(value > 0 for value in figures.values())
    streaming.write(tmp_path, figures | {"processor": "abacus", "versions": {"numpy": "2"}})
    page = (tmp_path / "streaming.md").read_text()
    assert "abacus. numpy 2." in page
    assert f"`dataset[number]` | {figures['ours_us']:.1f} | 1 |" in page
    assert f"| {figures['ours_us'] / figures['memmap_us']:.2f} |" in page
    assert json.loads((tmp_path / "streaming.json").read_text())["npz_us"] == pytest.approx(figures["npz_us"])
