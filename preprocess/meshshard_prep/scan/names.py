"""Which files belong to which mesh, by their names: the patterns that labels.files of a TOML file takes."""

import posixpath
import re
from collections import Counter, defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

from meshshard_prep.datasets.own.labels import filled_in

MOST_CUTS = 3
"""How many parts of a file's name may be more than the mesh's name."""

MOST_PATTERNS = 30
"""Patterns are tried in the order of how many files suggest them; later ones belong to a few files."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Pattern:
    """`text`: as labels.files takes it. `files`: mesh -> its file, both as paths below the root."""

    text: str
    files: dict[str, str]


def patterns_of(meshes: Sequence[str], others: Collection[str]) -> list[Pattern]:
    """Patterns by which other files belong to meshes, those of most meshes first; a file belongs to one pattern."""
    by_stem: dict[str, list[str]] = defaultdict(list)
    for mesh in meshes:
        by_stem[PurePosixPath(mesh).stem].append(mesh)
    suggested: Counter[str] = Counter(text for other in others for text in _suggestions(other, by_stem))
    suggested.update(_in_folders(meshes, others))
    left = set(others)
    found = []
    tried = [text for text, _ in suggested.most_common(MOST_PATTERNS)]
    while tried:
        covered = {text: _files(text, meshes, left) for text in tried}
        # files, not meshes: chairs/1 and vases/1 do not share a file
        best = min(tried, key=lambda text: (-len({*covered[text].values()}), _rank(text)))
        if not covered[best]:
            break
        found.append(Pattern(text=best, files=covered[best]))
        left -= set(covered[best].values())
        tried.remove(best)
    return found


def _files(text: str, meshes: Sequence[str], there: Collection[str]) -> dict[str, str]:
    return {mesh: place for mesh in meshes if (place := filled_in(text, mesh)) in there}


def _suggestions(other: str, by_stem: dict[str, list[str]]) -> list[str]:
    """Patterns that lead from the nearest mesh of its name to a file."""
    path = PurePosixPath(other)
    for stem in _stems(path.name):
        if stem in by_stem:
            break
    else:
        return []
    mesh = PurePosixPath(min(by_stem[stem], key=lambda mesh: (_distance(mesh, other), mesh)))
    name = re.sub(re.escape(mesh.name), "{name}", path.name, count=1)
    if name == path.name:
        name = path.name.replace(stem, "{stem}", 1)
    if "{" in path.name or "{" in str(path.parent):
        return []  # would be a placeholder
    if path.parent == mesh.parent:
        return [f"{{folder}}/{name}"] + ([name] if path.parent == PurePosixPath(".") else [])
    there = posixpath.relpath(path.parent.as_posix(), mesh.parent.as_posix())
    found = [(path.parent / name).as_posix(), f"{{folder}}/{there}/{name}"]
    mirrored = len(path.parts) > 2 and path.parts[1:-1] == mesh.parts[1:-1]
    return [*found, f"{path.parts[0]}/{{below}}/{name}"] if mirrored else found


def _rank(text: str) -> tuple[bool, bool, int, str]:
    """Of patterns for as many files, those with the mesh in them come first, then those below, then the shorter."""
    return not re.search(r"\{(stem|name)\}", text), "/.." in text, len(text), text


def _in_folders(meshes: Sequence[str], others: Collection[str]) -> Counter[str]:
    """Patterns of files that are called alike in the folders of several meshes, one mesh each: labels.txt beside
    mesh.obj. With how many there are."""
    folders = Counter(posixpath.dirname(mesh) for mesh in meshes)
    names = Counter(
        posixpath.basename(other) for other in others if folders[posixpath.dirname(other)] == 1 and "{" not in other
    )
    return Counter({f"{{folder}}/{name}": count for name, count in names.items() if count > 1})


def _stems(name: str) -> list[str]:
    """What may be the stem of its mesh: the name less its suffixes, and less parts at its end or at its beginning."""
    stem = name[: name.index(".", 1)] if "." in name[1:] else name
    dotted = name.rsplit(".", 1)[0]
    cuts = [dotted, stem]
    for start in (dotted, stem):
        ends = [match.start() for match in re.finditer(r"[-_. ]", start)]
        cuts += [start[:end] for end in ends[::-1][:MOST_CUTS]] + [start[end + 1 :] for end in ends[:MOST_CUTS]]
    return [cut for cut in dict.fromkeys(cuts) if cut]


def _distance(mesh: str, other: str) -> int:
    """How many folders lie between two files."""
    return len(
        PurePosixPath(posixpath.relpath(posixpath.dirname(other) or ".", posixpath.dirname(mesh) or ".")).parts
    )
