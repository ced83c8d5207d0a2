import numpy as np
import pytest
from shapes import write_obj

from meshshard.recipe import RECIPES
from meshshard_prep.bench import peer, report
from meshshard_prep.bench.measure import blob, hks_rows, interleaved, parts, path_rows
from meshshard_prep.features.edges import edges_of
from meshshard_prep.features.normals import face_normals
from meshshard_prep.pipeline import compute_features

FIGURES = {
    "processor": "abacus",
    "versions": {"numpy": "2"},
    "few_pairs": 300,
    "full_up_to": 2500,
    "hks": [
        {
            "vertices": 252,
            "peer_pairs": 249,
            "peer_ms": 40.0,
            "ours_ms": 2.0,
            "ratio": 20.0,
            "bound": 1e-6,
            "ours_error": 2e-7,
            "peer_error": 0.1,
        },
        {"vertices": 9000, "peer_pairs": 300, "peer_ms": 5000.0, "ours_ms": 250.0, "ratio": 20.0, "bound": 1e-6},
    ],
    "path": [{"vertices": 752, "peer_ms": 900.0, "ours_ms": 10.0, "ratio": 90.0}],
    "parts": {"HKS": 6.0, "everything": 10.0},
    "workers": {"one_ms": 10.0, "two_ms": 5.1, "scaling": 1.96},
    "large": {"faces": 1e6, "seconds": 300.0, "gigabytes": 4.0, "bound": 1e-6},
}


@pytest.mark.parametrize("size", [20, 252, 2500])
def test_blob_is_a_closed_surface_wound_outward(size):
    vertices, faces = blob(size)
    assert (len(vertices), len(faces)) == (size, 2 * size - 4)
    assert (edges_of(faces).count == 2).all()
    centres = vertices[faces].mean(axis=1)
    assert np.einsum("fi,fi->", face_normals(vertices, faces), centres) / 6 > 0.5  # its volume


def test_hks_row_measures_both_and_their_errors():
    (row,) = hks_rows({60: 1})
    assert row["ratio"] == pytest.approx(row["peer_ms"] / row["ours_ms"])
    assert row["ours_error"] <= row["bound"] <= 1e-5
    assert row["peer_error"] < 1  # three pairs of sixty are missing


def test_path_row_and_parts():
    (row,) = path_rows({60: 1})
    assert row["ratio"] == pytest.approx(row["peer_ms"] / row["ours_ms"])
    spent = parts(60)
    assert all(value > 0 for value in spent.values())
    assert spent["HKS"] < spent["everything"]


def test_turns_are_taken_in_turn():
    calls = []
    interleaved(2, lambda: calls.append("a"), lambda: calls.append("b"))
    assert calls[0] == "a"
    assert calls[-1] == "b"
    assert "".join(calls).count("ba") == 1


def test_peer_prepares_the_published_channels(tmp_path):
    """But for its spectrum without the last three pairs, it gives what recipe `official` gives."""
    vertices, faces = blob(300)
    write_obj(tmp_path / "blob.obj", vertices, faces)
    _, _, dihedral, hks = peer.prepare(tmp_path / "blob.obj", RECIPES["official"].times, 297)
    ours = compute_features(vertices, faces, "official")
    np.testing.assert_allclose(dihedral.mean(axis=1), ours.dihedral_official.mean(axis=1), rtol=1e-5)
    np.testing.assert_allclose(hks[:, 8:], ours.hks[:, 8:], rtol=1e-5)


def test_report_has_every_figure(tmp_path):
    report.write(tmp_path, FIGURES)
    page = (tmp_path / "hks.md").read_text()
    assert "| 252 | 40 | 2 | 20.0 | 2.0e-07 | 1.0e-06 | 1.0e-01 |" in page
    assert "| 9000 | 5000 | 250 | 20.0 |  | 1.0e-06 |  |" in page
    assert "| 752 | 900 | 10 | 90.0 |" in page
    assert "HKS 6.00 ms, everything 10.00 ms. With two workers 5.1 ms a mesh elapsed, 1.96 times" in page
    assert "A mesh of 1,000,000 faces: all features in 300 s" in page
    assert "abacus" in page
    assert {path.name for path in tmp_path.iterdir()} == {"hks.json", "hks.md", "hks.png"}
    assert "faces:" not in report.page({k: v for k, v in FIGURES.items() if k != "large"})
