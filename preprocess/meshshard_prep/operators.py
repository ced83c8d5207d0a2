"""What DiffusionNet (Sharp, Attaiki, Crane and Ovsjanikov 2022) computes for a mesh, from a shard with eigenvectors.

Operators live on the working copy, which has no vertex twice and none unused: `vertex_map` leads there.
"""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float64, Int64

from meshshard import Dataset, InvalidMesh, Recipe, Sample, UsageError
from meshshard.export import Exporter
from meshshard.export.npz import npz_bytes
from meshshard_prep.clean import Mesh, clean
from meshshard_prep.features.bridges import bridged
from meshshard_prep.features.components import components_of
from meshshard_prep.features.edges import edges_of
from meshshard_prep.features.laplacian import laplacian
from meshshard_prep.features.normals import cross, vertex_normals

TOLERANCE = 1e-4
"""How far stored eigenpairs may be from the Laplacian of the stored, rounded vertices; usual are 1e-6."""

RIDGE = 1e-5
"""Keeps a gradient finite where all edges of a vertex are parallel. Relative to their squared lengths: the published
code adds as much itself, which takes 3 % from the gradients of a mesh with edges of 1/100."""


def exporter(dataset: Dataset) -> Exporter:
    """The format `diffusionnet`. UsageError: the data set has no eigenvectors."""
    recipe = dataset.recipe
    if not recipe.spectrum:
        raise UsageError(
            f"{dataset.folder} holds no eigenvectors, and DiffusionNet needs them; type the command that made it "
            f"again, with --spectrum 128, then export {dataset.name}/{recipe.name}-spectrum128"
        )
    return Exporter(".npz", lambda sample: npz_bytes(operators_of(sample, recipe)))


def operators_of(sample: Sample, recipe: Recipe) -> dict[str, np.ndarray]:
    """Arrays under the names of the published code's cache; W vertices and G faces of the working copy, K pairs.

    verts (W,3), faces (G,3), frames (W,3,3): x, y and normal of each vertex; mass (W,); L, gradX and gradY: sparse
    (W,W), compressed columns as NAME_data, _indices, _indptr, _shape; evals (K,), evecs (W,K), k_eig. Besides,
    vertex_map (V,): working vertex of each vertex of the file, -1 where no face uses it; face_map (G,): the file's
    triangle of each face. Numbers are float32, lengths are radii.

    InvalidMesh: the stored eigenpairs are not those of the Laplacian of the stored vertices.
    """
    assert sample.eigenvalues is not None
    assert sample.eigenvectors is not None
    mesh = clean(sample.vertices.astype(np.float64), sample.faces.astype(np.int64), weld=recipe.weld, place=sample.id)
    stiffness, mass = _laplacian(mesh, recipe)
    working, first = np.unique(mesh.vertex_map, return_index=True)
    first = first[working >= 0]
    known = np.isfinite(sample.eigenvalues)
    values, modes = sample.eigenvalues[known], sample.eigenvectors[first][:, known]
    _check(stiffness, mass, values, modes.astype(np.float64), sample.id)
    frames = tangent_frames(vertex_normals(mesh.vertices, mesh.faces))
    sparse = {"L": stiffness}
    sparse["gradX"], sparse["gradY"] = gradient(mesh.vertices, edges_of(mesh.faces).ends, frames)
    arrays = {"verts": sample.vertices[first], "frames": frames, "mass": mass, "evals": values, "evecs": modes}
    for name, matrix in sparse.items():
        arrays[f"{name}_data"] = matrix.data
    arrays = {name: array.astype(np.float32) for name, array in arrays.items()}
    for name, matrix in sparse.items():
        arrays |= {f"{name}_indices": matrix.indices, f"{name}_indptr": matrix.indptr}
        arrays[f"{name}_shape"] = np.array(matrix.shape)
    whole = {"faces": mesh.faces, "vertex_map": mesh.vertex_map, "face_map": mesh.face_map}
    return arrays | whole | {"k_eig": np.array(len(values))}


def _laplacian(mesh: Mesh, recipe: Recipe) -> tuple[sp.csc_matrix, Float64[np.ndarray, " W"]]:
    stiffness, mass = laplacian(mesh.vertices, mesh.faces, recipe)
    edges = edges_of(mesh.faces)
    components, component_of = components_of(edges, len(mesh.vertices))
    if recipe.components == "bridged" and components > 1:
        stiffness, _ = bridged(stiffness, mesh.vertices, edges, component_of)
    return stiffness, mass


def _check(
    stiffness: sp.csc_matrix,
    mass: Float64[np.ndarray, " W"],
    values: Float64[np.ndarray, " K"],
    modes: Float64[np.ndarray, "W K"],
    place: str,
) -> None:
    """By energies: residuals would be those of rounding the modes to float32."""
    lengths = modes.T @ (mass[:, None] * modes) - np.eye(len(values))
    energies = (modes.T @ (stiffness @ modes) - np.diag(values)) / np.maximum(1.0, values)
    worst = max(np.abs(lengths).max(), np.abs(energies).max())
    if not worst <= TOLERANCE:
        raise InvalidMesh(
            "bad-spectrum",
            f"stored eigenpairs are those of the stored vertices to {TOLERANCE:.0e}",
            f"they miss by {worst:.1e}",
            place=place,
            advice="look for vertices that rounding to float32 made equal, and merge them",
        )


def tangent_frames(normals: Float64[np.ndarray, "V 3"]) -> Float64[np.ndarray, "V 3 3"]:
    """Rows x, y and normal, orthonormal and right-handed, at each vertex; x is the first axis brought into the
    tangent plane, or the second where the normal is within 26 degrees of the first. An undefined normal is the third.
    """
    normal = np.where(normals.any(axis=1, keepdims=True), normals, [0.0, 0.0, 1.0])
    axis = np.where(np.abs(normal[:, :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    x = axis - normal * np.einsum("vi,vi->v", axis, normal)[:, None]
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, cross(normal, x), normal], axis=1)


def gradient(
    vertices: Float64[np.ndarray, "V 3"], ends: Int64[np.ndarray, "E 2"], frames: Float64[np.ndarray, "V 3 3"]
) -> tuple[sp.csc_matrix, sp.csc_matrix]:
    """Matrices (V,V) that give the x and y components, in each vertex's frame, of the gradient of a function: the one
    that fits the differences along the vertex's edges best, by least squares."""
    tail, head = np.concatenate([ends, ends[:, ::-1]]).T
    steps = vertices[head] - vertices[tail]
    x, y = np.einsum("eki,ei->ke", frames[tail, :2], steps)
    ridge = RIDGE * np.square(steps).sum(axis=1)
    products = (x * x + ridge, x * y, y * y + ridge)
    xx, xy, yy = (np.bincount(tail, product, minlength=len(vertices)) for product in products)
    determinant = (xx * yy - xy * xy)[tail]
    weight_x = (yy[tail] * x - xy[tail] * y) / determinant
    weight_y = (xx[tail] * y - xy[tail] * x) / determinant
    return _differences(weight_x, tail, head, len(vertices)), _differences(weight_y, tail, head, len(vertices))


def _differences(
    weights: Float64[np.ndarray, " E"], tail: Int64[np.ndarray, " E"], head: Int64[np.ndarray, " E"], size: int
) -> sp.csc_matrix:
    """The matrix that takes a function to the weighted sum of its differences f(head) - f(tail) at each tail."""
    total = np.bincount(tail, weights, minlength=size)
    return sp.csc_matrix(sp.coo_array((weights, (tail, head)), shape=(size, size)) - sp.diags_array(total))
