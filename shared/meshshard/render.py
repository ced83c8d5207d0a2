"""Pictures of meshes without display and GPU: Embree finds the face that a ray meets."""

from dataclasses import dataclass
from io import BytesIO
from itertools import product

import numpy as np
from jaxtyping import Float, Int, UInt8

LIGHT = np.array([-0.4, 0.6, 0.7]) / np.linalg.norm([-0.4, 0.6, 0.7])
"""Where it comes from, to the right, upwards and towards the camera: it turns with the camera."""

AMBIENT = 0.45
"""Share of its colour that a face in the dark keeps: labels stay readable."""

RAYS = 3
"""For each pixel, along each of its sides."""

MARGIN = 1.04
TO_SCREEN = np.array([[0, 0, -1]], dtype=np.float32)


@dataclass(frozen=True, kw_only=True)
class View:
    """Where the camera is, in degrees: in front on the z axis, then turned towards x, then raised towards y, which is
    up. It sees parallel rays."""

    azimuth: float = 35.0
    elevation: float = 18.0

    @property
    def axes(self) -> Float[np.ndarray, "3 3"]:
        """Unit vectors to the right of the picture, to its top, and to the camera, as rows."""
        turn, rise = np.deg2rad([self.azimuth, self.elevation])
        right = np.array([np.cos(turn), 0.0, -np.sin(turn)])
        back = np.array([np.sin(turn) * np.cos(rise), np.sin(rise), np.cos(turn) * np.cos(rise)])
        return np.stack([right, np.cross(back, right), back])


def render(
    vertices: Float[np.ndarray, "V 3"],
    faces: Int[np.ndarray, "F 3"],
    colours: UInt8[np.ndarray, "F 3"] | UInt8[np.ndarray, "F 3 3"],
    *,
    size: int = 240,
    view: View = View(),
) -> UInt8[np.ndarray, "size size 4"]:
    """A square picture of a mesh that fills it: red, green, blue and opacity, first row on top.

    `colours` are of faces, or of their corners and blended between them: colours of vertices are given as
    `colours[faces]`. Faces are lit from both sides and drawn flat. Vertices that no face uses do not count. What the
    mesh does not cover is transparent.
    """
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    points = (vertices @ view.axes.T)[faces]
    low, high = points.min(axis=(0, 1)), points.max(axis=(0, 1))
    reach = MARGIN * max(high[0] - low[0], high[1] - low[1]) / 2 or 1.0
    corners = ((points - (low + high) / 2) / reach).astype(np.float32)  # into a square from -1 to 1
    brightness = _brightness(corners)
    scene = EmbreeScene(robust=True)  # a ray along an edge hits one of its faces
    TriangleMesh(scene, corners)
    left, above = ((1 - (high - low)[:2] / 2 / reach) * size / 2).astype(int)  # pixels that nothing is in
    columns, rows = np.arange(left, size - left), np.arange(above, size - above)[:, None]
    light = np.zeros((rows.size * columns.size, 4))
    origins = np.full((rows.size, columns.size, 3), 1 + corners[..., 2].max(), dtype=np.float32)
    inside = (np.arange(RAYS) + 0.5) / RAYS
    for down, across in product(inside, inside):  # one ray a pixel at a time
        origins[..., 0] = (columns + across) * 2 / size - 1
        origins[..., 1] = 1 - (rows + down) * 2 / size
        hits = scene.run(origins.reshape(-1, 3), TO_SCREEN, output=True)
        met = np.flatnonzero(hits["primID"] >= 0)
        face, second, third = (hits[name][met] for name in ("primID", "u", "v"))
        seen = colours[face]
        if seen.ndim == 3:
            seen = np.einsum("nc,ncd->nd", np.stack([1 - second - third, second, third], axis=1), seen)
        light[met, :3] += seen * brightness[face, None]
        light[met, 3] += 1
    covered = np.maximum(light[:, 3:], 1)
    pixels = np.hstack([light[:, :3] / covered, 255 / RAYS**2 * light[:, 3:]])
    picture = np.zeros((size, size, 4), dtype=np.uint8)
    picture[rows, columns] = np.rint(pixels).clip(0, 255).reshape(rows.size, columns.size, 4)
    return picture


def _brightness(corners: Float[np.ndarray, "F 3 3"]) -> Float[np.ndarray, " F"]:
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals *= np.where(normals[:, 2:] < 0, -1, 1)  # towards the camera
    length = np.linalg.norm(normals, axis=1)
    lit = np.clip(normals @ LIGHT, 0, None) / np.where(length > 0, length, 1)
    return AMBIENT + (1 - AMBIENT) * lit


def png_bytes(picture: UInt8[np.ndarray, "height width 4"], *, small: bool = False) -> bytes:
    """A picture as a PNG file. `small`: with the 256 colours that suit it best, in a third of the bytes."""
    from PIL import Image

    file, image = BytesIO(), Image.fromarray(picture)
    if small:
        image = image.quantize(256, method=Image.Quantize.FASTOCTREE)
    image.save(file, "PNG", optimize=True)
    return file.getvalue()
