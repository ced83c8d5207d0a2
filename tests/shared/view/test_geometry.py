"""What the browser is given, and what is clicked."""

import json

import numpy as np
from shapes import box

from meshshard.view.geometry import LINEAR, clicked_corner, glb_bytes


def parts(glb):
    """The JSON and the binary part of a GLB file."""
    size = int.from_bytes(glb[12:16], "little")
    return json.loads(glb[20 : 20 + size]), glb[20 + size + 8 :]


def colours_in(glb):
    table, binary = parts(glb)
    place = table["accessors"][table["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"]]
    view = table["bufferViews"][place["bufferView"]]
    start = view["byteOffset"]
    return np.frombuffer(binary[start : start + view["byteLength"]], dtype=np.uint8).reshape(-1, 4)


def test_colours_of_vertices_stay_and_those_of_faces_part_the_faces():
    vertices, faces = box()
    of_vertices = np.arange(24, dtype=np.uint8).reshape(8, 3) * 10
    found = colours_in(glb_bytes(vertices, faces, of_vertices, False))
    np.testing.assert_array_equal(found[:, :3], LINEAR[of_vertices])
    assert (found[:, 3] == 255).all()
    of_faces = np.arange(36, dtype=np.uint8).reshape(12, 3) * 7
    found = colours_in(glb_bytes(vertices, faces, of_faces, True))
    np.testing.assert_array_equal(found[:, :3], LINEAR[of_faces].repeat(3, axis=0))


def test_light_of_a_colour():
    assert LINEAR[[0, 255]].tolist() == [0, 255]
    assert LINEAR[188] == 128  # half the light is the colour 188


def test_the_face_in_front_and_its_nearest_corner_are_clicked():
    vertices, faces = box()
    down = np.array([0.0, 0.0, -1.0])
    face, vertex = clicked_corner(vertices, faces, np.array([0.9, 0.8, 5.0]), down)
    assert (vertices[faces[face], 2] == 1).all()
    assert vertices[vertex].tolist() == [1, 1, 1]
    assert clicked_corner(vertices, faces, np.array([1.9, 0.8, 5.0]), down) is None
