"""A coloured mesh as the browser takes it, and which vertex of it somebody clicked."""

import numpy as np
from jaxtyping import Float, Int, UInt8


def glb_bytes(
    vertices: Float[np.ndarray, "V 3"],
    faces: Int[np.ndarray, "F 3"],
    colours: UInt8[np.ndarray, "n 3"],
    of_faces: bool,
) -> bytes:
    """The mesh as binary glTF, matt and seen from both sides. `colours`: of its vertices, blended between them, or
    `of_faces`, which do not share vertices then and are drawn flat."""
    from trimesh import Trimesh
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import PBRMaterial

    if of_faces:
        vertices, colours = vertices[faces].reshape(-1, 3), colours.repeat(3, axis=0)
        faces = np.arange(len(vertices)).reshape(-1, 3)
    matt = TextureVisuals(material=PBRMaterial(metallicFactor=0.0, roughnessFactor=1.0, doubleSided=True))
    opaque = np.full((len(colours), 4), 255, dtype=np.uint8)
    opaque[:, :3] = LINEAR[colours]
    matt.vertex_attributes["color"] = opaque
    content = Trimesh(vertices, faces, process=False, visual=matt).export(file_type="glb")
    assert isinstance(content, bytes)
    return content


def _linear(value: Float[np.ndarray, " n"]) -> UInt8[np.ndarray, " n"]:
    share = value / 255
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.rint(255 * light).astype(np.uint8)


LINEAR = _linear(np.arange(256.0))
"""Amount of light for each value of a colour (IEC 61966-2-1, sRGB): glTF has that in its vertices."""


def clicked_corner(
    vertices: Float[np.ndarray, "V 3"],
    faces: Int[np.ndarray, "F 3"],
    origin: Float[np.ndarray, " 3"],
    direction: Float[np.ndarray, " 3"],
) -> tuple[int, int] | None:
    """The face that a ray meets first, and its vertex that is nearest there; None where it passes by."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, vertices[faces].astype(np.float32))
    hit = scene.run(origin[None].astype(np.float32), direction[None].astype(np.float32), output=True)
    face, second, third = (hit[name][0] for name in ("primID", "u", "v"))
    if face < 0:
        return None
    return int(face), int(faces[face, np.argmax([1 - second - third, second, third])])
