"""Is a folder of shards whole? Every finding is a sentence; none means yes."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from meshshard.cache import open_shard
from meshshard.errors import InvalidShard, UsageError
from meshshard.files import TEMPORARY_PREFIX, sha256_of_file
from meshshard.index import ShardEntry, read_index


def verify(folder: Path, *, full: bool = False) -> list[str]:
    """Findings of one folder. Quick: index, sizes, sha256 of every shard. Full: also every array of every sample."""
    try:
        index = read_index(folder)
    except (InvalidShard, UsageError) as error:
        return [str(error)]
    findings = []
    start = 0
    for entry in index.shards:
        found = list(_shard_findings(folder / entry.file, entry))
        if full and not found:
            found = list(_sample_findings(folder / entry.file, entry, index.ids[start:], index.keys[start:]))
        findings += found
        start += entry.meshes
    if not (start == len(index.ids) == len(index.keys) == len(index.splits)):
        findings.append(f"{folder}: the index names {len(index.ids)} samples and its shards hold {start}")
    named = {entry.file for entry in index.shards}
    findings += [
        f"{path}: no part of the data set; left over, delete it"
        for path in sorted(folder.glob("*"))
        if (path.suffix == ".h5" and path.name not in named) or path.name.startswith(TEMPORARY_PREFIX)
    ]
    return findings


def _shard_findings(path: Path, entry: ShardEntry) -> Iterator[str]:
    if not path.is_file():
        yield f"{path}: the index names this shard and it is not there"
    elif (size := path.stat().st_size) != entry.bytes:
        yield f"{path}: {size} bytes, the index says {entry.bytes}"
    elif (found := sha256_of_file(path)) != entry.sha256:
        yield f"{path}: its sha256 is {found}, the index says {entry.sha256}"


def _sample_findings(path: Path, entry: ShardEntry, ids: tuple[str, ...], keys: tuple[str, ...]) -> Iterator[str]:
    shard = open_shard(path, entry.sha256)
    try:
        if len(shard) != entry.meshes:
            yield f"{path}: {len(shard)} meshes, the index says {entry.meshes}"
            return
        classes = len(shard.classes)
        for row in range(len(shard)):
            sample = shard[row]
            place = f"{path}: {sample.id}"
            if (sample.id, sample.key) != (ids[row], keys[row]):
                yield f"{place}: the index has {ids[row]} in its place"
            if sample.digest != shard.stored_digest(row):
                yield f"{place}: its arrays do not match their stored digest"
            if len(sample.faces) and (sample.faces.min() < 0 or sample.faces.max() >= len(sample.vertices)):
                yield f"{place}: a face names a vertex outside 0..{len(sample.vertices) - 1}"
            for name in ("vertices", "vertex_normals", "dihedral", "hks", "vertex_areas"):
                if not np.isfinite(getattr(sample, name)).all():
                    yield f"{place}: {name} is not finite"
            for name in ("face_labels", "vertex_labels"):
                labels = getattr(sample, name)
                if labels is not None and len(labels) and (labels.min() < -1 or labels.max() >= classes):
                    yield f"{place}: {name} outside -1..{classes - 1}"
            if not -1 <= sample.mesh_label < classes:
                yield f"{place}: mesh_label {sample.mesh_label} outside -1..{classes - 1}"
    except InvalidShard as error:
        yield str(error)
