"""Real files of many origins, read by the package and by short parsers that share nothing with it."""

import csv
import re
import struct

import numpy as np
import pytest
from ply_files import LETTERS
from research_data import DATA

from meshshard.errors import InvalidMesh
from meshshard.mesh_files import MESH_SUFFIXES
from meshshard_prep.formats import read_mesh

pytestmark = pytest.mark.data

REFUSED_FOR_A_REASON = {
    "valid/gpytoolbox__fandisk.obj": "not-a-mesh",  # a browser saved it as a web archive, the mesh is inside a page
    "odd/cgal__prim.off": "extra-data",  # the header promises 7 faces, 8 follow
}
READ_FOR_A_REASON = {
    "broken/trimesh__whitespace.off": (8, 6),  # white space before the keyword, and counts glued to it
}


def data(part, files):
    folder = DATA / part
    if not folder.is_dir():
        pytest.skip(f"{files} files not read: no folder {folder}; MESHSHARD_DATA names where the data is")
    return folder


def corpus(folder):
    """(file, path, vertices, polygons) of the manifest; the counts are None where its reader refused the file."""
    root = data("mesh_corpus", 372)
    with (root / "MANIFEST.tsv").open(newline="") as manifest:
        for row in csv.DictReader(manifest, delimiter="\t", quoting=csv.QUOTE_NONE):
            if row["file"].startswith(folder):
                counts = (int(row["V"]), int(row["F"])) if row["V"] else None
                yield row["file"], root / row["file"], counts


def counts_or_code(path):
    try:
        mesh = read_mesh(path)
    except InvalidMesh as error:
        return error.code
    assert np.array_equal(np.unique(mesh.face_source), np.arange(mesh.polygons))
    return len(mesh.vertices), mesh.polygons


@pytest.mark.parametrize("folder", ["valid", "odd"])
def test_usable_files_are_read_whole(folder):
    expected, found = {}, {}
    for file, path, counts in corpus(folder):
        is_mesh = path.suffix.lower() in MESH_SUFFIXES
        expected[file] = REFUSED_FOR_A_REASON.get(file, counts if is_mesh else "unsupported-format")
        found[file] = counts_or_code(path)
    assert found == expected
    assert len(found) > 100


def test_broken_files_are_refused():
    found = {file: counts_or_code(path) for file, path, _ in corpus("broken")}
    assert {file: counts for file, counts in found.items() if isinstance(counts, tuple)} == READ_FOR_A_REASON
    assert len(found) == 83


def naive_obj(content):
    text = re.sub(r"\\\s*\n", " ", content.decode().replace("\r\n", "\n"))
    vertices, polygons = [], []
    for line in text.splitlines():
        keyword, *words = line.split("#")[0].split() or [""]
        if keyword == "v":
            vertices.append([float(word) for word in words[:3]])
        elif keyword == "f":
            indices = [int(word.split("/")[0]) for word in words]
            polygons.append([i - 1 if i > 0 else len(vertices) + i for i in indices])
    return vertices, polygons


def naive_off(content):
    numbers = re.sub(r"#.*|[A-Z]*OFF", " ", content.decode()).split("\n")
    lines = [[float(word) for word in line.split()] for line in numbers if line.strip()]
    count = int(lines[0][0])
    faces = lines[1 + count :]
    return [line[:3] for line in lines[1 : 1 + count]], [
        [int(i) for i in line[1 : 1 + int(line[0])]] for line in faces
    ]


def naive_ply(content):
    """Takes the properties one by one off a single list of words or of bytes."""
    header, body = re.split(rb"end_header\r?\n", content, maxsplit=1)
    lines = [line.split() for line in header.decode("latin-1").splitlines()]
    form = next(line[1] for line in lines if line[:1] == ["format"])
    words, at = iter(body.split()), 0

    def take(kind):
        nonlocal at
        if form == "ascii":
            word = float(next(words))
            return np.float32(word) if LETTERS[kind] == "f" else word
        code = (">" if "big" in form else "<") + LETTERS[kind]
        at += struct.calcsize(code)
        return struct.unpack_from(code, body, at - struct.calcsize(code))[0]

    vertices, polygons = [], []
    elements = [line for line in lines if line[:1] in (["element"], ["property"])]
    while elements:
        _, element, count = elements.pop(0)
        properties = []
        while elements and elements[0][0] == "property":
            properties.append(elements.pop(0)[1:])
        for _ in range(int(count)):
            row = {}
            for *kind, name in properties:
                row[name] = [take(kind[2]) for _ in range(int(take(kind[1])))] if kind[0] == "list" else take(kind[0])
            if element == "vertex":
                vertices.append([row["x"], row["y"], row["z"]])
            elif element == "face":
                polygons.append([int(i) for i in row.get("vertex_indices", row.get("vertex_index"))])
    return vertices, polygons


NAIVE = {".obj": naive_obj, ".off": naive_off, ".ply": naive_ply}


def assert_same_as_naive(path):
    mesh = read_mesh(path)
    vertices, polygons = NAIVE[path.suffix](path.read_bytes())
    assert np.array_equal(mesh.vertices, np.array(vertices, dtype=np.float64)), path
    fans = [[p[0], p[k], p[k + 1]] for p in polygons for k in range(1, len(p) - 1)]
    assert mesh.faces.tolist() == fans, path
    assert mesh.face_source.tolist() == [i for i, p in enumerate(polygons) for _ in p[2:]], path
    assert mesh.polygons == len(polygons), path


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
@pytest.mark.parametrize("folder", ["valid", "odd"])
def test_usable_files_equal_a_naive_parse(folder, suffix):
    for file, path, _ in corpus(folder):
        if path.suffix == suffix and file not in REFUSED_FOR_A_REASON:
            assert_same_as_naive(path)


@pytest.mark.parametrize(
    ("part", "pattern", "files"),
    [
        ("human_seg", "t*/*.obj", 399),
        ("shrec_16", "*/*/*.obj", 600),
        ("modelnet9", "*/*/*.obj", 180),
        ("coseg_sample", "*/shapes/*.off", 27),
    ],
)
def test_data_sets_equal_a_naive_parse(part, pattern, files):
    found = sorted(data(part, files).glob(pattern))
    assert len(found) == files
    for path in found[::5]:
        assert_same_as_naive(path)
