"""Which files, or parts of mesh files, hold labels: they must be readable and as many as something of the mesh."""

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from meshshard.errors import InvalidMesh
from meshshard_prep.counts import Counts
from meshshard_prep.datasets.layout import DOMAINS, Entry
from meshshard_prep.labels import FORMS, UNLABELLED, Written
from meshshard_prep.labels.forms import offered
from meshshard_prep.scan.names import Pattern

SAMPLE = 8
"""Meshes that are looked at first. What is labels in none of them is none."""

MOST_DISTINCT = 64
"""With more distinct labels than that, each must be there ten times: else they are numbers of something else. Names
must be there twice: else they are lines of some text."""

LEAST_SHARE = 0.5
"""Share of the meshes that must hold labels themselves for these to be meant."""

TEXT_FORMS = ("lines", "psb", "last-column")
"""What a text file may be, the simplest first."""

_FORM_OF_SUFFIX = {".npy": ("npy",), ".json": ("json",)}

Told = Callable[[int, int], None]


@dataclass(frozen=True, kw_only=True)
class Labelling:
    """One way in which meshes have labels. `pattern`: as labels.files takes it, empty for labels in the mesh file.
    `fits`: domain -> meshes whose count fits. `of`: source of such a mesh -> its labels. `odd`: files that are no
    labels of their mesh, with the reason. `missing`: meshes without such a file; `sharing`: those whose file is an
    earlier one's too."""

    pattern: str
    form: str
    name: str
    fits: Mapping[str, int]
    of: Mapping[str, frozenset[int | str]]
    odd: tuple[str, ...]
    missing: tuple[str, ...]
    sharing: tuple[str, ...] = ()

    @property
    def domains(self) -> tuple[str, ...]:
        """What the labels may be of: more than one, where counts fit twice as often."""
        most = max(self.fits.values())
        return tuple(domain for domain in DOMAINS if self.fits[domain] == most)

    @property
    def values(self) -> dict[int | str, int]:
        """Label -> how many meshes have it, rising."""
        counted = Counter(value for values in self.of.values() for value in values)
        return {value: counted[value] for value in sorted(counted, key=lambda value: (isinstance(value, str), value))}


def labels_in_files(root: Path, pattern: Pattern, counts: Mapping[str, Counts], told: Told) -> Labelling | None:
    """The labelling that the files of a pattern are, or None."""
    suffix = Path(pattern.text).suffix.lower()
    for form in _FORM_OF_SUFFIX.get(suffix, TEXT_FORMS):

        def read(mesh: str, form: str = form) -> Written:
            path = root / pattern.files[mesh]
            return FORMS[form](path.read_bytes(), "", pattern.files[mesh])

        there = [mesh for mesh in counts if mesh in pattern.files]
        if any(_fit(read, mesh, counts[mesh])[0] for mesh in _sample(there)):
            found = labelling_of(pattern.text, form, "", read, there, counts, told)
            if found is not None:
                return replace(found, sharing=_sharing(there, pattern.files))
    return None


def _sharing(meshes: Sequence[str], files: Mapping[str, str]) -> tuple[str, ...]:
    first = {files[mesh]: mesh for mesh in reversed(meshes)}
    return tuple(mesh for mesh in meshes if first[files[mesh]] != mesh)


def labels_in_meshes(entries: Sequence[Entry], counts: Mapping[str, Counts], told: Told) -> list[Labelling]:
    """The labellings that mesh files hold themselves, at least LEAST_SHARE of them: groups of a few are no labels."""
    paths = {entry.source: entry.path for entry in entries}
    ways = Counter(
        (form, name)
        for source in _sample(list(counts))
        for form, name, _ in offered(paths[source].read_bytes(), paths[source].suffix)
    )
    found = []
    for form, name in ways:

        def read(mesh: str, form: str = form, name: str = name) -> Written:
            return FORMS[form](paths[mesh].read_bytes(), name, mesh)

        labelling = labelling_of("", form, name, read, list(counts), counts, told)
        found += [labelling] if labelling and len(labelling.of) >= LEAST_SHARE * len(counts) else []
    return found


def _sample(meshes: Sequence[str]) -> Sequence[str]:
    """A few, spread evenly."""
    return meshes[:: max(len(meshes) // SAMPLE, 1)][:SAMPLE]


def labelling_of(
    pattern: str,
    form: str,
    name: str,
    read: Callable[[str], Written],
    meshes: Sequence[str],
    counts: Mapping[str, Counts],
    told: Told,
) -> Labelling | None:
    """What is found in some of the meshes, all that have such a file; None where these are no labels."""
    fits = dict.fromkeys(DOMAINS, 0)
    of: dict[str, frozenset[int | str]] = {}
    odd = []
    total = 0
    for done, mesh in enumerate(meshes, start=1):
        domains, values, found = _fit(read, mesh, counts[mesh])
        for domain in domains:
            fits[domain] += 1
        if domains:
            of[mesh], total = values, total + counts[mesh].faces
        else:
            odd.append(found)
        told(done, len(meshes))
    distinct = {value for values in of.values() for value in values}
    most = total // 10 if len(distinct) > MOST_DISTINCT else total // 2
    if not of or (len(distinct) > most and not _few_numbers(distinct)):
        return None
    there = set(meshes)
    missing = tuple(mesh for mesh in counts if mesh not in there)
    return Labelling(pattern=pattern, form=form, name=name, fits=fits, of=of, odd=tuple(odd), missing=missing)


def _few_numbers(values: Collection[int | str]) -> bool:
    """Each may be there once and be a label all the same."""
    return len(values) <= MOST_DISTINCT and all(isinstance(value, int) for value in values)


def _fit(
    read: Callable[[str], Written], mesh: str, counts: Counts
) -> tuple[tuple[str, ...], frozenset[int | str], str]:
    """What the labels of a mesh may be of, which there are, and, where they are of nothing, the reason."""
    try:
        written = read(mesh)
    except (InvalidMesh, OSError) as error:
        return (), frozenset(), f"{mesh}: {error}"
    values = frozenset(written.values) - {UNLABELLED, ""}
    fits: tuple[str, ...]
    if written.numbers is not None:
        fits = ("face",) if len(written.numbers) and written.numbers.max() < counts.faces else ()
    else:
        fits = tuple(fit for fit in counts.fits(len(written.which)) if written.domain in ("", fit))
    size = f"{counts.faces} faces and {counts.vertices} vertices"
    return (fits, values, "") if fits and values else ((), values, f"{mesh}: {len(written.which)} labels, {size}")
