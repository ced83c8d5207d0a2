import numpy as np
import pytest
from shapes import sphere

from meshshard.errors import InvalidMesh, UsageError
from meshshard_prep.datasets.layout import LabelFile
from meshshard_prep.features.edges import edges_of
from meshshard_prep.labels import FORMS, class_table, labels_of
from meshshard_prep.mesh import RawMesh

ALL = ("face", "edge", "vertex")


def raw(vertices, faces, face_source=None):
    source = np.arange(len(faces)) if face_source is None else np.array(face_source)
    return RawMesh(vertices=vertices, faces=faces, face_source=source, polygons=int(source.max()) + 1)


def parse_labels(content, classes, place):
    return FORMS["lines"](content, "", place).classes(classes)


def files(*paths):
    return [LabelFile(path=path) for path in paths]


def test_lines_become_class_indices():
    assert parse_labels(b"\xef\xbb\xbf3\n1\r\n 2 \n\n", {1: 0, 2: 1, 3: 2}, "x.seg").tolist() == [2, 0, 1]


@pytest.mark.parametrize("content", [b"1\nhead\n", b"1\n9\n", b"1\n1.5\n", b"1\n\n1\n", b"1\n\xff\n", b"1\n0_2\n"])
def test_a_line_that_is_no_class_is_refused_with_its_number(content):
    with pytest.raises(InvalidMesh, match=r"x.seg:2: a label is one of -1, 1, 2, but .*\[bad-label\]"):
        parse_labels(content, {1: 0, 2: 1}, "x.seg")


def test_whole_numbers_that_numpy_wrote_are_integers():
    written = FORMS["lines"](b"1.000000000000000000e+00\n2.\n-1.0E+00\n+3\n1.5\n1e3\n1_0\nnan\n1e400\n", "", "x")
    assert written.values == (1, 2, -1, 3, "1.5", 1000, "1_0", "nan", "1e400")
    assert FORMS["lines"](b"9" * 5000, "", "x").values == ("9" * 5000,)


def test_the_domain_is_found_by_count():
    vertices, faces = sphere(1)
    mesh, edges = raw(vertices, faces), len(edges_of(faces).ends)
    assert labels_of(mesh, np.arange(len(faces)), ALL, "").domain == "face"
    assert labels_of(mesh, np.zeros(edges, dtype=int), ALL, "").domain == "edge"
    assert labels_of(mesh, np.arange(len(vertices)), ALL, "").vertices.tolist() == list(range(len(vertices)))


@pytest.mark.parametrize("count", [0, 1, 31, 33])
def test_other_counts_are_refused_with_both_numbers(count):
    with pytest.raises(InvalidMesh, match=rf"32 \(faces\) or 48 \(edges\), but it has {count}\..*\[label-count\]"):
        labels_of(raw(*sphere(1)), np.zeros(count, dtype=int), ("face", "edge"), "x.seg")


def test_a_count_that_fits_twice_is_refused():
    vertices = np.zeros((3, 3))
    mesh = raw(vertices, np.array([[0, 1, 2]]))
    with pytest.raises(InvalidMesh, match=r"labels.domain in the data set's TOML"):
        labels_of(mesh, np.zeros(3, dtype=int), ALL, "")


def test_polygon_labels_go_to_their_triangles():
    mesh = raw(np.zeros((6, 3)), np.array([[0, 1, 2], [0, 2, 3], [3, 4, 5]]), [0, 0, 1])
    assert labels_of(mesh, np.array([7, 4]), ("face",), "").faces.tolist() == [7, 7, 4]


def test_edge_labels_are_for_triangles():
    quads = raw(np.zeros((5, 3)), np.array([[0, 1, 2], [0, 2, 3], [2, 3, 4]]), [0, 0, 1])
    with pytest.raises(InvalidMesh, match=r"each of the mesh's 2 \(faces\), but it has 7\. "):
        labels_of(quads, np.zeros(7, dtype=int), ("edge",), "")


def test_minus_one_is_unlabelled():
    assert parse_labels(b"-1\n4\n", {4: 0}, "").tolist() == [-1, 0]


def test_files_that_cannot_be_read_are_left_to_the_run(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "a").write_text("1\n")
    assert class_table(files(tmp_path / "folder", tmp_path / "a"), (), tmp_path) == (("1",), {1: 0})


def test_class_table_from_files(tmp_path):
    (tmp_path / "a").write_text("3\n1\n-1\n")
    (tmp_path / "b").write_text("7\nnonsense\n")
    assert class_table(files(tmp_path / "a", tmp_path / "b"), (), tmp_path) == (("1", "3", "7"), {1: 0, 3: 1, 7: 2})
    with pytest.raises(UsageError, match=r"2 class names, but the label files hold the labels \[1, 3, 7\]"):
        class_table(files(tmp_path / "a", tmp_path / "b"), ("x", "y"), tmp_path)


def test_more_classes_than_a_label_can_count(tmp_path):
    (tmp_path / "a").write_text("\n".join(map(str, range(2**15 - 1))))
    assert max(class_table(files(tmp_path / "a"), (), tmp_path)[1].values()) == np.iinfo(np.int16).max - 1
    (tmp_path / "b").write_text("40000\n40001\n")
    with pytest.raises(UsageError, match=r"32769 distinct labels, and a data set has 32768 classes at most"):
        class_table(files(tmp_path / "a", tmp_path / "b"), (), tmp_path)
