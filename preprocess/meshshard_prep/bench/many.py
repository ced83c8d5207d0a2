"""A run over thousands of small generated meshes: rate, overhead, and memory of each kind of process. Linux only."""

import json
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from meshshard.errors import UsageError
from meshshard_prep.bench.measure import blob

VERTICES = 252
"""Manifold40's meshes have 500 faces."""

ROLES = {b"meshshard_prep.isolated": "isolated", b"popen_loky_posix": "worker", b"resource_tracker": "tracker"}
"""A word of the command line -> what kind of process has it; the others are the parent."""


def many_meshes(count: int, workers: int = 2, scratch: Path | None = None) -> dict[str, Any]:
    """`meshshard features` on `count` generated meshes, in programs of its own, and a second time with all stored.

    `overhead`: workers times elapsed seconds, over the seconds that the meshes took themselves, minus one.
    `peak_mb`: the highest resident memory of a process of each kind; `parent_mb`: the parent's, over time.
    `scratch`: a folder for raw files and shards, by default the system's.
    """
    folder = Path(tempfile.mkdtemp(prefix="meshshard-bench-", dir=scratch))
    try:
        write_meshes(folder / "raw", count)
        first, memory = _features(folder, workers)
        second, _ = _features(folder, workers)
    finally:
        shutil.rmtree(folder)
    assert (first["stored"], second["computed"]) == (count, 0)
    return {
        "meshes": count,
        "vertices": VERTICES,
        "workers": workers,
        "seconds": first["seconds"],
        "meshes_per_second": count / first["seconds"],
        "mesh_ms": 1e3 * first["mesh_seconds"] / count,
        "overhead": workers * first["seconds"] / first["mesh_seconds"] - 1,
        "bytes_per_mesh": first["bytes"] / count,
        "again_seconds": second["seconds"],
        **memory,
    }


def write_meshes(folder: Path, count: int) -> None:
    """Meshes of one connectivity, each with bumps of its own."""
    folder.mkdir(parents=True)
    points, faces = blob(VERTICES)
    face_lines = "\n".join(f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist())
    rng = np.random.default_rng(0)
    for number in range(count):
        radius = 1 + 0.3 * np.sin(points @ rng.normal(size=3) * 3 + rng.random())
        lines = "\n".join(f"v {x:.7f} {y:.7f} {z:.7f}" for x, y, z in (points * radius[:, None]).tolist())
        (folder / f"{number:06}.obj").write_text(f"{lines}\n{face_lines}\n")


def _features(folder: Path, workers: int) -> tuple[dict[str, Any], dict[str, Any]]:
    words = ["features", str(folder / "raw"), "--out", str(folder / "out"), "--jobs", str(workers), "--json"]
    program = [sys.executable, "-m", "meshshard", *words]
    peaks: dict[str, float] = {}
    parent: list[float] = []
    output = folder / "output.json"
    with output.open("w") as file, subprocess.Popen(program, stdout=file, stderr=subprocess.DEVNULL) as process:
        while process.poll() is None:
            time.sleep(1)
            for role, peak, resident in _memory_of_family(process.pid):
                peaks[role] = max(peak, peaks.get(role, 0))
                if role == "parent":
                    parent.append(round(resident, 1))
    if process.returncode != 0:
        raise UsageError(f"meshshard {' '.join(words)}: exit status {process.returncode}")
    course = parent[:: max(len(parent) // 10, 1)]
    return json.loads(output.read_text()), {"peak_mb": peaks, "parent_mb": course}


def _memory_of_family(root: int) -> list[tuple[str, float, float]]:
    """Kind, peak and present resident megabytes of a process and all its descendants."""
    parents: dict[int, int] = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            parents[int(path.parent.name)] = int(path.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue  # it ended meanwhile
    family = {root}
    while more := {child for child, parent in parents.items() if parent in family} - family:
        family |= more
    found = []
    for pid in family:
        try:
            words = Path(f"/proc/{pid}/cmdline").read_bytes()
            fields = dict(line.split(":", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines())
            peak, resident = (int(fields[name].split()[0]) / 1024 for name in ("VmHWM", "VmRSS"))
        except (OSError, KeyError):
            continue
        found.append((next((kind for word, kind in ROLES.items() if word in words), "parent"), peak, resident))
    return found
