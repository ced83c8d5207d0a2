"""The only place that imports pymeshlab, which is GPL: `python -m meshshard_prep.prepare.quadric`.

Nothing else here links with it: meshshard starts this program and talks with it through a pipe (`isolation.py`),
arrays in, arrays out. It comes with the extra `simplify`, and meshshard works without it.
"""

import numpy as np
from jaxtyping import Float64, Int64

from meshshard.errors import UsageError


def load() -> None:
    """UsageError: pymeshlab is not there, or cannot be loaded."""
    try:
        import pymeshlab  # noqa: F401
    except ImportError as error:
        raise UsageError(
            f"simplify needs pymeshlab, and it cannot be loaded ({error}): pip install 'meshshard[simplify]'"
        ) from error


def collapse(
    vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"], target: int
) -> tuple[Float64[np.ndarray, "W 3"], Int64[np.ndarray, "G 3"]]:
    """Collapse edges, the least quadric error first (Garland and Heckbert 1997), down to `target` faces.

    The settings never differ between two calls: pymeshlab keeps those of the last one, so that a result would depend
    on what came before. Without `preservetopology` thin parts collapse to faces that lie on each other;
    `preserveboundary` would forbid every collapse at a border, whose place boundary quadrics keep anyway.
    """
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
    meshes.meshing_decimation_quadric_edge_collapse(
        targetfacenum=target,
        targetperc=0.0,
        qualitythr=0.3,
        preserveboundary=False,
        boundaryweight=1.0,
        preservenormal=True,
        preservetopology=True,
        optimalplacement=True,
        planarquadric=False,
        qualityweight=False,
        autoclean=True,
        selected=False,
    )
    found = meshes.current_mesh()
    return found.vertex_matrix(), found.face_matrix().astype(np.int64)


if __name__ == "__main__":
    from meshshard_prep.isolated import main

    main()
