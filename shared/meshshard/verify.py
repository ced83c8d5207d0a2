"""Is a folder of shards whole? Every finding is a sentence; none means yes."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from meshshard.dataset import Dataset
from meshshard.errors import InvalidShard, UsageError
from meshshard.files import TEMPORARY_PREFIX, sha256_of_file
from meshshard.index import ShardEntry, read_index


def verify(folder: Path, *, full: bool = False) -> list[str]:
    """Findings of one folder. Quick: index, sizes, sha256 of every shard. Full: also every array of every sample."""
    try:
        index = read_index(folder)
    except (InvalidShard, UsageError) as error:
        return [str(error)]
    dataset = Dataset(folder, index)
    findings = []
    for place, entry in enumerate(index.shards):
        found = list(_shard_findings(folder / entry.file, entry))
        findings += found or (list(_sample_findings(dataset, place)) if full else [])
    named = {entry.file for entry in index.shards}
    findings += [
        f"{path}: no part of the data set; left over, delete it"
        for path in sorted(folder.glob("*"))
        if (path.suffix == ".h5" and path.name not in named) or path.name.startswith(TEMPORARY_PREFIX)
    ]
    return findings


def _shard_findings(path: Path, entry: ShardEntry) -> Iterator[str]:
    try:
        yield from _file_findings(path, entry)
    except OSError as error:
        yield f"{path}: it cannot be read: {error.strerror}"


def _file_findings(path: Path, entry: ShardEntry) -> Iterator[str]:
    if not path.is_file():
        yield f"{path}: the index names this shard and it is not there"
    elif (size := path.stat().st_size) != entry.bytes:
        yield f"{path}: {size} bytes, the index says {entry.bytes}"
    elif (found := sha256_of_file(path)) != entry.sha256:
        yield f"{path}: its sha256 is {found}, the index says {entry.sha256}"


def _sample_findings(dataset: Dataset, place: int) -> Iterator[str]:
    try:
        shard = dataset.shard(place)
    except InvalidShard as error:
        yield str(error)
        return
    for row in range(len(shard)):
        sample = shard[row]
        if sample.digest != shard.stored_digest(row):
            yield f"{shard.path}: {sample.id}: its arrays do not match their stored digest"
        for name in ("vertices", "vertex_normals", "dihedral", "hks", "vertex_areas"):
            if not np.isfinite(getattr(sample, name)).all():
                yield f"{shard.path}: {sample.id}: {name} is not finite"
