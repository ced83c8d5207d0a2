"""Every face label that is stored equals that of a parse that shares no line with the project's: goal R2."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from effort import times
from shapes import FAMILY, write_labels, write_obj

from meshshard import open_dataset
from meshshard.recipe import RECIPES
from meshshard_prep.datasets import read_dataset
from meshshard_prep.run import run

LIGHT = replace(RECIPES["paper"], name="light", times=(0.1, 1.0), hks_tolerance=1e-2)
"""Labels are what counts here; this computes in less time."""


def polygons(path):
    """Corners of each face, and its line's place among the faces, of an OBJ or OFF file of one statement a line."""
    lines = [line.split() for line in path.read_text().splitlines() if line.strip() and line[0] != "#"]
    if path.suffix == ".obj":
        return [[int(word.split("/")[0]) for word in words[1:]] for words in lines if words[0] == "f"]
    vertices, faces = map(int, lines[1][:2])
    return [[int(word) for word in words[1 : 1 + int(words[0])]] for words in lines[2 + vertices :][:faces]]


def of_faces(path, labels, first):
    """A label a polygon, repeated for each triangle of its fan; `first` is the first class's integer."""
    values = [int(line) for line in labels.read_text().split()]
    faces = polygons(path)
    assert len(values) == len(faces)
    fan = [value for value, face in zip(values, faces, strict=True) for _ in face[2:]]
    return [value if value == -1 else value - first for value in fan]


def of_edges(path, labels, first):
    """What two of three edges say, edges numbered as they are met."""
    values = [int(line) for line in labels.read_text().split()]
    numbers, result = {}, []
    for a, b, c in polygons(path):
        sides = [numbers.setdefault(frozenset(edge), len(numbers)) for edge in ((a, b), (b, c), (c, a))]
        label, votes = Counter(values[side] for side in sides).most_common(1)[0]
        result.append(label - first if votes > 1 and label != -1 else -1)
    assert len(numbers) == len(values)
    return result


def assert_stored(dataset, out, parse, first):
    """Faces whose stored label was compared; all are equal."""
    report = run(dataset, out, LIGHT, jobs=1)
    assert report.ok
    paths = {entry.id: entry for entry in dataset.entries}
    compared = 0
    for sample in open_dataset(out):
        entry = paths[sample.id]
        expected = parse(entry.path, entry.labels.path, first)
        np.testing.assert_array_equal(sample.face_labels, expected, err_msg=sample.id)
        compared += len(sample.face_labels)
    return compared


@pytest.mark.soak
@pytest.mark.data
def test_human_seg(data_root, tmp_path, measured):
    dataset = read_dataset("human_seg", data_root / "human_seg")
    dataset = replace(dataset, entries=dataset.entries[:: times(20, 1)])
    faces = assert_stored(dataset, tmp_path, of_edges, 1)
    measured("R2", f"human_seg: {faces:,} stored labels of {len(dataset.entries)} meshes equal another parse")


@pytest.mark.soak
@pytest.mark.data
@pytest.mark.parametrize("shape", ["chairs", "tele-aliens"])
def test_coseg_as_it_was_published(shape, data_root, tmp_path, measured):
    # <set>/shapes/<id>.off and <set>/gt/<id>.seg; a folder of links puts them side by side
    raw = tmp_path / "raw"
    raw.mkdir()
    source = data_root / "coseg_sample" / shape
    meshes = sorted(source.glob("shapes/*.off"), key=lambda path: path.stat().st_size)
    for path in (*meshes[: times(3, 100)], *source.glob("gt/*.seg")):
        (raw / path.name).symlink_to(path)
    dataset = read_dataset(str(raw))
    faces = assert_stored(dataset, tmp_path / "out", of_faces, 1)
    assert len(dataset.classes) == {"chairs": 3, "tele-aliens": 4}[shape]
    measured(
        "R2", f"coseg_sample/{shape}: {faces:,} stored labels of {len(dataset.entries)} meshes equal another parse"
    )


def off_of_polygons(path, vertices, faces):
    """The triangles, and every other one as a quad with its first corner twice at the end, or a pentagon."""
    rows = [list(face) + [face[0]] * (number % 3) for number, face in enumerate(faces.tolist())]
    lines = ["OFF", f"{len(vertices)} {len(rows)} 0", *(" ".join(map(repr, row)) for row in vertices.tolist())]
    path.write_text("\n".join([*lines, *(" ".join(map(str, [len(row), *row])) for row in rows), ""]))


@pytest.mark.soak
@pytest.mark.parametrize("domain", ["face", "edge"])
def test_generated_meshes_with_random_labels(domain, tmp_path, measured):
    rng = np.random.default_rng(0)
    classes = np.array([-1, 2, 3, 5, 9])
    raw = tmp_path / "raw"
    raw.mkdir()
    for name, (vertices, faces) in FAMILY.items():
        for suffix in (".obj", ".off"):
            path = raw / f"{name}-{suffix[1:]}{suffix}"
            if suffix == ".off" and domain == "face":
                off_of_polygons(path, vertices, faces)
            else:
                path = path.with_suffix(".obj")
                write_obj(path, vertices, faces[rng.permutation(len(faces))])
            ends = {frozenset(pair) for face in polygons(path) for pair in zip(face, np.roll(face, 1), strict=True)}
            count = len(polygons(path)) if domain == "face" else len(ends)
            labels = classes[rng.integers(len(classes), size=count)]
            labels[:5] = classes[: len(labels[:5])]  # every class is there, so that their numbers are known
            write_labels(path.with_suffix(".seg"), labels)
    file = tmp_path / "set.toml"
    file.write_text(f'raw = "raw"\n[labels]\ndomain = "{domain}"\n')
    dataset = read_dataset(str(file))
    assert dataset.classes == ("2", "3", "5", "9")
    number = {-1: -1, 2: 0, 3: 1, 5: 2, 9: 3}

    def parse(path, labels, first):
        values = (of_faces if domain == "face" else of_edges)(path, labels, first)
        return [number[value] for value in values]

    faces = assert_stored(dataset, tmp_path / "out", parse, 0)
    measured("R2", f"generated, labels of {domain}s: {faces:,} stored labels of {len(dataset.entries)} meshes equal")
