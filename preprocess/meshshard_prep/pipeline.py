"""The way of one mesh: arrays, or a file and its labels, to a Sample. Pure: nothing is written or remembered.

Whoever makes the same mesh and recipe give other numbers raises ALGORITHM_VERSION in plan.py.
"""

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import ThreadpoolController

from meshshard.errors import InvalidMesh
from meshshard.files import sha256_of
from meshshard.recipe import Recipe, find_recipe
from meshshard.sample import DIAGNOSTICS, Sample
from meshshard_prep.clean import Mesh, clean
from meshshard_prep.correspondence import correspondence_of
from meshshard_prep.datasets.layout import Entry
from meshshard_prep.features.adjacency import face_adjacency
from meshshard_prep.features.areas import face_areas, vertex_areas
from meshshard_prep.features.bridges import bridged
from meshshard_prep.features.components import components_of
from meshshard_prep.features.dihedral import mean_dihedral, mean_signed_dihedral, official_dihedral
from meshshard_prep.features.edges import Edges, edges_of
from meshshard_prep.features.geodesic import geodesic_features
from meshshard_prep.features.hks import heat_kernel_signature
from meshshard_prep.features.laplacian import laplacian
from meshshard_prep.features.normals import vertex_normals
from meshshard_prep.features.shape_diameter import shape_diameter
from meshshard_prep.features.spectrum import Spectrum, lowest_eigenpairs
from meshshard_prep.formats import parse_mesh
from meshshard_prep.labels import Labels, read_labels
from meshshard_prep.mesh import RawMesh
from meshshard_prep.prepare.deform import deformed
from meshshard_prep.prepare.steps import prepare

MOST_FACES_AT_EDGE = 1000
"""More than any surface has; then the Laplacian of a face takes 30 microseconds at most."""


def compute_features(vertices: ArrayLike, faces: ArrayLike, recipe: str | Recipe = "paper") -> Sample:
    """All features of a triangle mesh: vertices (V,3), faces (F,3) with 0-based indices.

    `recipe` is "paper", "official" or a Recipe. The sample's `hks` is (V, T), unscaled: scaling belongs to training.
    Any triangle mesh is welcome: open, non-manifold, in pieces. InvalidMesh (with a `code`) for what has no
    features: no faces, indices outside, NaN or infinite coordinates, no extent. ValueError for arrays of another
    shape, or faces that are no integers.
    """
    points, triangles = np.array(vertices, dtype=np.float64), np.array(faces)
    if points.ndim != 2 or points.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise ValueError(f"vertices are (V, 3) and faces (F, 3), not {points.shape} and {triangles.shape}")
    if triangles.dtype.kind not in "iu":
        raise ValueError(f"faces are integers, not {triangles.dtype}")
    triangles = triangles.astype(np.int64)
    mesh = RawMesh(vertices=points, faces=triangles, face_source=np.arange(len(triangles)), polygons=len(triangles))
    return features_of(mesh, find_recipe(recipe) if isinstance(recipe, str) else recipe)


def compute_sample(
    entry: Entry, content: bytes, labels: bytes | None, correspondence: bytes | None, recipe: Recipe
) -> Sample:
    """One entry of a data set: the bytes of its mesh file, its label file and its correspondence, to a Sample."""
    mesh = parse_mesh(content, entry.source, entry.path.suffix)
    found = None
    if labels is not None and entry.labels is not None:
        found = read_labels(entry.labels, labels, mesh)
    matched = correspondence_of(entry, correspondence, len(mesh.vertices))
    if entry.deformed:
        seed = [int(sha256_of(content), 16), entry.deformed]
        mesh = deformed(mesh, seed, place=entry.source)
    sample = features_of(mesh, recipe, found, place=entry.source, mesh_label=entry.mesh_label)
    return replace(sample, correspondence=matched)


def features_of(
    raw: RawMesh, recipe: Recipe, labels: Labels | None = None, *, place: str = "", mesh_label: int = -1
) -> Sample:
    """Prepare a mesh as the recipe says, clean it, compute the features of its working copy, and bring them back to
    every vertex of the prepared mesh: of the file, where the recipe has no steps. Labels are those of the file."""
    prepared = prepare(raw, labels, recipe, place=place)
    raw, labels = prepared.mesh, prepared.labels
    mesh = clean(raw.vertices, raw.faces, weld=recipe.weld, place=place)
    edges = edges_of(mesh.faces)
    _check_crowding(edges, place)
    components, component_of = components_of(edges, len(mesh.vertices))
    counts = dict.fromkeys(DIAGNOSTICS, 0) | prepared.counts | counts_of(mesh, edges)
    counts |= {"components": components, "unlabelled": _unlabelled(labels)}
    try:
        # One thread: the last bits of BLAS's results depend on how many there are, and workers share the cores.
        with _loaded_libraries().limit(limits=1):
            stiffness, mass = laplacian(mesh.vertices, mesh.faces, recipe)
            counts["raised_areas"] = int((mass > vertex_areas(mesh.vertices, mesh.faces)).sum())
            if recipe.components == "bridged" and components > 1:
                stiffness, counts["bridges"] = bridged(stiffness, mesh.vertices, edges, component_of)
            hks = heat_kernel_signature(stiffness, mass, recipe.times, tolerance=recipe.hks_tolerance)
            spectrum = lowest_eigenpairs(stiffness, mass, recipe.spectrum) if recipe.spectrum else None
    except InvalidMesh as error:
        raise InvalidMesh(error.code, error.rule, error.found, place=place, advice=error.advice) from error
    adjacency = face_adjacency(edges)
    vertex_normal = mesh.to_vertices(vertex_normals(mesh.vertices, mesh.faces))
    counts["undefined_normals"] = int((~vertex_normal.any(axis=1)).sum())
    counts["cut_clusters"] = int(spectrum is not None and spectrum.cut)
    return Sample(
        vertices=mesh.positions.astype(np.float32),
        vertex_normals=vertex_normal.astype(np.float32),
        dihedral=mesh.to_vertices(mean_dihedral(mesh.vertices, mesh.faces, edges)).astype(np.float32),
        hks=mesh.to_vertices(hks.values).astype(np.float32),
        vertex_areas=vertex_areas(mesh.positions, raw.faces).astype(np.float32),
        **_optional_features(mesh, edges, adjacency, spectrum, recipe),
        **_global_features(mesh, component_of, recipe),
        faces=raw.faces.astype(np.int32),
        face_adjacency=_adjacency_of_file(mesh, adjacency).astype(np.int32),
        face_source=raw.face_source.astype(np.int32),
        face_labels=labels.faces if labels else None,
        vertex_labels=labels.vertices if labels else None,
        label_rule=labels.rule if labels else "",
        polygons=raw.polygons,
        vertex_source=None if prepared.vertex_source is None else prepared.vertex_source.astype(np.int32),
        label_domain=labels.domain if labels else "mesh" if mesh_label >= 0 else "",
        mesh_label=mesh_label,
        times=np.array(recipe.times),
        centre=mesh.centre,
        scale=mesh.scale,
        hks_poles=hks.poles,
        hks_error_bound=hks.error_bound,
        diagnostics=counts,
    )


def _check_crowding(edges: Edges, place: str) -> None:
    """The robust Laplacian takes time as the square of the faces at an edge: no mesh may hold up a run with that."""
    most = int(edges.count.max())
    if most > MOST_FACES_AT_EDGE:
        raise InvalidMesh(
            "crowded-edge",
            f"an edge has at most {MOST_FACES_AT_EDGE} faces",
            f"one has {most}",
            place=place,
            advice="remove faces that are there many times, or vertices that were merged and should not have been",
        )


@lru_cache
def _loaded_libraries() -> ThreadpoolController:
    """Finding them takes longer than a small mesh."""
    return ThreadpoolController()


def _optional_features(
    mesh: Mesh, edges: Edges, adjacency: np.ndarray, spectrum: Spectrum | None, recipe: Recipe
) -> dict[str, Any]:
    """What the recipe asks for beyond the standard fields, as fields of a sample."""
    found: dict[str, Any] = {}
    if recipe.signed_dihedral:
        signed = mean_signed_dihedral(mesh.vertices, mesh.faces, edges)
        found["dihedral_signed"] = mesh.to_vertices(signed).astype(np.float32)
    if recipe.official_dihedral:
        official = official_dihedral(mesh.vertices, mesh.faces, adjacency)
        found["dihedral_official"] = mesh.to_vertices(official).astype(np.float32)
    if spectrum is not None:
        # every mesh of a shard has as many columns, also one with fewer vertices
        missing = recipe.spectrum - len(spectrum.values)
        found["eigenvalues"] = np.pad(spectrum.values, (0, missing), constant_values=np.nan)
        found["eigenvectors"] = np.pad(mesh.to_vertices(spectrum.modes), ((0, 0), (0, missing))).astype(np.float32)
    return found


def _global_features(mesh: Mesh, component_of: np.ndarray, recipe: Recipe) -> dict[str, Any]:
    """Of these what the recipe asks for, by field: features that look at the whole mesh from each vertex."""
    found, areas = {}, vertex_areas(mesh.vertices, mesh.faces)
    if recipe.geodesic:
        found["geodesic"] = geodesic_features(mesh.vertices, mesh.faces, areas)
    if recipe.shape_diameter:
        normals = vertex_normals(mesh.vertices, mesh.faces)
        found["shape_diameter"] = shape_diameter(mesh.vertices, mesh.faces, normals, areas, component_of)
    return {name: mesh.to_vertices(values).astype(np.float32) for name, values in found.items()}


def _adjacency_of_file(mesh: Mesh, adjacency: np.ndarray) -> np.ndarray:
    """Adjacency of the working faces as rows and numbers of the file's triangles; -1 around degenerate ones."""
    result = np.full(mesh.original_faces.shape, -1)
    result[mesh.face_map] = np.where(adjacency < 0, -1, mesh.face_map[adjacency])
    return result


def counts_of(mesh: Mesh, edges: Edges) -> dict[str, int]:
    """What was repaired on the working copy, and what is odd about it and stays, under the names of `DIAGNOSTICS`."""
    return {
        "unreferenced_vertices": int((mesh.vertex_map < 0).sum()),
        "welded_vertices": mesh.welded_vertices,
        "degenerate_faces": len(mesh.original_faces) - len(mesh.faces),
        "zero_area_faces": int((face_areas(mesh.vertices, mesh.faces) == 0).sum()),
        "boundary_edges": int((edges.count == 1).sum()),
        "nonmanifold_edges": int((edges.count > 2).sum()),
    }


def _unlabelled(labels: Labels | None) -> int:
    found = None if labels is None else labels.faces if labels.faces is not None else labels.vertices
    return 0 if found is None else int((found < 0).sum())
