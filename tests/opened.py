"""Opens shards in a process of its own, with limits, so that a crash of HDF5 is seen and named by its file."""

import os
import resource
import subprocess
import sys
from pathlib import Path


def opened(paths: list[Path], seconds: float = 60, memory: int = 256 * 2**20) -> list[str]:
    """What opening each shard and reading all of it came to: "whole", or the sentence of InvalidShard. AssertionError
    that names the file at which the process died, hung, or raised another exception. `memory`: bytes it may take
    beyond what its libraries did."""
    child = subprocess.Popen(
        [sys.executable, __file__, str(memory)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
    )
    try:
        text, _ = child.communicate("\n".join(map(str, paths)), timeout=seconds)
    except subprocess.TimeoutExpired:
        child.kill()
        text, _ = child.communicate()
        text += "it did not end in time"
    lines = text.splitlines()
    if child.returncode != 0 or len(lines) != len(paths):
        done = len([line for line in lines if line.startswith(("whole", "InvalidShard"))])
        names = [path.name for path in paths] + ["at its end"]
        raise AssertionError(f"{names[done]}: exit status {child.returncode}: " + "\n".join(lines[done:]))
    return lines


def main() -> None:
    """Paths come on the standard input, a line for each goes out."""
    from meshshard.errors import InvalidShard
    from meshshard.reader import Shard

    memory = int(sys.argv[1])
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + memory, size + memory))
    for path in sys.stdin.read().splitlines():
        try:
            shard = Shard(Path(path))
            for row in range(len(shard)):
                check(shard[row], len(shard.classes))
            result = "whole"
        except InvalidShard as error:
            result = f"InvalidShard: {error}"
        print(result.encode("unicode_escape").decode(), flush=True)


def check(sample, classes: int) -> None:
    """A sample that nobody would stumble over, whatever its numbers are."""
    vertices, faces = len(sample.vertices), len(sample.faces)
    for name in ("vertex_normals", "dihedral", "hks", "vertex_areas"):
        assert len(getattr(sample, name)) == vertices, name
    for name in ("face_adjacency", "face_source"):
        assert len(getattr(sample, name)) == faces, name
    assert ((sample.faces >= 0) & (sample.faces < vertices)).all()
    assert ((sample.face_adjacency >= -1) & (sample.face_adjacency < faces)).all()
    assert sample.face_labels is None or ((sample.face_labels >= -1) & (sample.face_labels < classes)).all()
    assert -1 <= sample.mesh_label < classes
    assert sample.hks.shape[1] == len(sample.times)
    assert len(sample.digest) == 64


if __name__ == "__main__":
    main()
