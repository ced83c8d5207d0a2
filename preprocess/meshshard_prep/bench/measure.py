"""What is measured: CPU time of ours and of the peer's, interleaved, medians; errors; scaling; memory."""

import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import scipy.linalg
from jaxtyping import Float64, Int64
from scipy.spatial import ConvexHull

from meshshard.recipe import RECIPES
from meshshard_prep.bench import peer
from meshshard_prep.features.adjacency import face_adjacency
from meshshard_prep.features.dihedral import mean_dihedral
from meshshard_prep.features.edges import Edges, edges_of
from meshshard_prep.features.hks import heat_kernel_signature
from meshshard_prep.features.laplacian import laplacian
from meshshard_prep.features.normals import face_normals, vertex_normals
from meshshard_prep.formats import read_mesh
from meshshard_prep.pipeline import compute_features, features_of

OFFICIAL = RECIPES["official"]
SIZES = {252: 11, 752: 7, 2500: 2, 9000: 3, 50_000: 2}
"""Vertices -> rounds."""

TURN = 0.1
"""Shorter calls are repeated: one after the other is how a data set is prepared."""

FEW_PAIRS = 300
FULL_UP_TO = 2500
"""Beyond, the peer takes FEW_PAIRS eigenpairs, which is what people do, and no dense reference is computed."""

MILLION = 500_002
"""Vertices of a closed surface with a million faces."""


def blob(vertices: int) -> tuple[Float64[np.ndarray, "V 3"], Int64[np.ndarray, "F 3"]]:
    """A smooth closed surface of any number of vertices: a spiral of points on a sphere, its hull, and bumps."""
    rank = np.arange(vertices) + 0.5
    height, angle = 1 - 2 * rank / vertices, np.pi * (1 + np.sqrt(5)) * rank
    points = np.stack([np.cos(angle), np.sin(angle), height], axis=1)
    points[:, :2] *= np.sqrt(1 - height**2)[:, None]
    hull = ConvexHull(points)
    faces = hull.simplices.astype(np.int64)
    inward = np.einsum("fi,fi->f", hull.equations[:, :3], face_normals(points, faces)) < 0
    faces = np.where(inward[:, None], faces[:, ::-1], faces)
    x, y, z = points.T
    radius = 0.7 + 0.2 * np.sin(3 * x + 1) * np.cos(2 * y) + 0.1 * np.sin(5 * z + 2 * x)
    points = points * radius[:, None]
    points -= points.mean(axis=0)
    return points / np.linalg.norm(points, axis=1).max(), faces


def peer_pairs(size: int) -> int:
    """Eigenpairs that the peer takes."""
    return size - 3 if size <= FULL_UP_TO else FEW_PAIRS


def interleaved(rounds: int, *calls: Callable[[], Any]) -> list[float]:
    """Median CPU seconds of each call. They take turns, each repeated until its turn lasts TURN seconds."""
    spent: list[list[float]] = [[] for _ in calls]
    for _ in range(rounds):
        for call, times in zip(calls, spent, strict=True):
            start, repeats = time.process_time(), 0
            while repeats == 0 or time.process_time() - start < TURN:
                call()
                repeats += 1
            times.append((time.process_time() - start) / repeats)
    return [statistics.median(times) for times in spent]


def hks_rows(sizes: dict[int, int]) -> Iterator[dict[str, Any]]:
    """HKS alone, from the same Laplacian and mass; `sizes` is vertices -> rounds."""
    heat_kernel_signature(*peer.operators(*blob(100)), OFFICIAL.times)  # compiled
    for size, rounds in sizes.items():
        yield _hks_row(size, rounds)


def _hks_row(size: int, rounds: int) -> dict[str, Any]:
    stiffness, mass = peer.operators(*blob(size))
    times = OFFICIAL.times
    pairs = peer_pairs(size)
    peer_time, our_time = interleaved(
        rounds,
        lambda: peer.heat_kernel_signature(stiffness, mass, times, pairs),
        lambda: heat_kernel_signature(stiffness, mass, times),
    )
    ours = heat_kernel_signature(stiffness, mass, times)
    row: dict[str, Any] = {
        "vertices": size,
        "rounds": rounds,
        "peer_pairs": pairs,
        "peer_ms": 1e3 * peer_time,
        "ours_ms": 1e3 * our_time,
        "ratio": peer_time / our_time,
        "bound": ours.error_bound,
    }
    if size <= FULL_UP_TO:
        root = 1 / np.sqrt(mass)
        values, vectors = scipy.linalg.eigh(root[:, None] * stiffness.toarray() * root)
        full = np.square(root[:, None] * vectors) @ np.exp(-np.outer(values, times))
        theirs = peer.heat_kernel_signature(stiffness, mass, times, pairs)
        row["ours_error"] = float(np.abs(ours.values / full - 1).max())
        row["peer_error"] = float(np.abs(theirs / full - 1).max())
    return row


def path_rows(sizes: dict[int, int]) -> Iterator[dict[str, Any]]:
    """The whole way of a file on one core, from its bytes on the disk to a Sample; `sizes` is vertices -> rounds."""
    recipe = RECIPES["paper"]
    with tempfile.TemporaryDirectory() as folder:
        for size, rounds in sizes.items():
            path = write_blob(Path(folder), size)
            peer_time, our_time = (
                1e3 * seconds
                for seconds in interleaved(
                    rounds,
                    partial(peer.prepare, path, recipe.times, peer_pairs(size)),
                    partial(_sample, path),
                )
            )
            ratio = peer_time / our_time
            yield {"vertices": size, "rounds": rounds, "peer_ms": peer_time, "ours_ms": our_time, "ratio": ratio}


def parts(size: int = 752) -> dict[str, float]:
    """CPU milliseconds of the steps of one mesh, and of dihedral angles, normals and adjacency together."""
    recipe = RECIPES["paper"]
    with tempfile.TemporaryDirectory() as folder:
        path = write_blob(Path(folder), size)
        vertices, faces = blob(size)
        edges = edges_of(faces)

        def light() -> None:
            again = Edges(edges.ends, edges.of_face, edges.count)
            face_adjacency(again)
            mean_dihedral(vertices, faces, again)
            vertex_normals(vertices, faces)

        calls: dict[str, Callable[[], Any]] = {
            "file to arrays": partial(read_mesh, path),
            "Laplacian": partial(laplacian, vertices, faces, recipe),
            "HKS": partial(heat_kernel_signature, *laplacian(vertices, faces, recipe), recipe.times),
            "edges": partial(edges_of, faces),
            "dihedral, normals, adjacency": light,
            "everything": partial(_sample, path),
        }
        return {name: 1e3 * seconds for name, seconds in zip(calls, interleaved(5, *calls.values()), strict=True)}


def worker_row(size: int = 752) -> dict[str, Any]:
    """Elapsed milliseconds a mesh with one and with two workers, in turn."""
    with tempfile.TemporaryDirectory() as folder:
        path = write_blob(Path(folder), size)
        rounds = [[_wall(path, workers, 200 * workers) for workers in (1, 2)] for _ in range(5)]
    one, two = (1e3 * statistics.median(times) for times in zip(*rounds, strict=True))
    return {"one_ms": one, "two_ms": two, "scaling": one / two}


def write_blob(folder: Path, size: int) -> Path:
    """`blob` as an OBJ file."""
    vertices, faces = blob(size)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
    path = folder / f"blob{size}.obj"
    path.write_text("\n".join(lines))
    return path


def _wall(path: Path, workers: int, meshes: int) -> float:
    """Seconds a mesh once the workers are up: people have thousands of meshes."""
    with joblib.Parallel(n_jobs=workers, batch_size=5) as parallel:
        parallel(joblib.delayed(_sample)(path) for _ in range(10 * workers))
        start = time.perf_counter()
        parallel(joblib.delayed(_sample)(path) for _ in range(meshes))
        return (time.perf_counter() - start) / meshes


def _sample(path: Path) -> float:
    return features_of(read_mesh(path), RECIPES["paper"]).hks_error_bound


def large_mesh() -> dict[str, Any]:
    """A million faces, in a process of its own: seconds and peak memory of all features."""
    script = "from meshshard_prep.bench.measure import _large; _large()"
    words = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout.split()
    return dict(zip(("faces", "seconds", "gigabytes", "bound"), map(float, words), strict=True))


def _large() -> None:
    vertices, faces = blob(MILLION)
    compute_features(*blob(100))
    start = time.process_time()
    sample = compute_features(vertices, faces)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(len(faces), time.process_time() - start, peak, sample.hks_error_bound)
