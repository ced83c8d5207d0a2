"""What can be wrong with a mesh, a label file, a folder or a shard, and how it is said."""

REFUSALS = {
    # reading
    "empty-file": "The file holds no bytes, or only white space.",
    "not-a-mesh": "The content is something else: a Git-LFS pointer, a web page, an archive, an image, a program.",
    "unsupported-format": "A mesh format, or a variant of one, that is not read here.",
    "bad-encoding": "The text is not UTF-8 (UTF-16, or bytes that no text has).",
    "bad-line": "A line does not follow the format's grammar.",
    "bad-number": "A coordinate or count is not a finite decimal number.",
    "bad-face": "A face has fewer than three corners, or a corner that is no integer.",
    "index-out-of-range": "A face names a vertex that the file does not have.",
    "truncated": "The file ends before what its header or its last line promises.",
    "extra-data": "The file goes on after everything its header promises.",
    "unreadable": "The operating system would not let the file be read, or it is no regular file.",
    "bad-name": "The name of the file is not UTF-8.",
    # geometry
    "no-vertices": "The mesh has no vertices.",
    "no-faces": "The mesh has no faces, or none with three different corners.",
    "not-finite": "A coordinate is NaN or infinite.",
    "no-extent": "All vertices that faces use lie in one point, or so far apart that squares overflow.",
    "far-vertex": "A vertex that no face uses lies so far away that its position overflows float32.",
    "crowded-edge": "More than 1000 faces share an edge (after welding).",
    "laplacian-not-finite": "The Laplacian of the recipe has NaN or infinite entries on this mesh.",
    "inexact-hks": "The error bound of the heat kernel signature exceeds the recipe's tolerance.",
    "bad-spectrum": "The eigenpairs asked for could not be computed to their tolerance, or not all were found.",
    # labels
    "no-labels": "The label file that the layout asks for is not there.",
    "bad-label": "The label file is not what its form says, or a label is none of the data set's classes.",
    "not-triangles": "Labels of edges are asked for, and the mesh has faces of more than three corners.",
    "label-count": "The label file has as many labels as the mesh has neither faces, nor edges, nor vertices.",
    # correspondence
    "no-correspondence": "The file that says which vertex is which of a template is not there.",
    "bad-correspondence": "A line of that file is not a vertex of the mesh.",
    "correspondence-count": "A mesh names more or fewer vertices than its data set's template has.",
}
"""Stable code of every refusal -> what it means. docs/refusals.md is checked against this table."""

FAILURES = {
    "crashed": "The process that computed the mesh died, and a second one too: a fault in a library.",
    "killed": "The process that computed the mesh was killed, and a second one too: often the system had no memory.",
    "time-limit": "Computing took longer than --time-limit.",
    "memory-limit": "Computing needs more memory than --memory-limit.",
    "error": "The program raised an error that it should not.",
    "changed": "The file changed while the run went on.",
    "lost": "Its worker was lost several times, and nothing came back.",
}
"""Stable code of every failure -> what it means: the mesh broke no rule, and the next run tries it again."""


class MeshshardError(Exception):
    """Base of every error meshshard raises on purpose. Its text is meant to be read by a person."""


class InvalidMesh(MeshshardError):
    """A mesh or its labels break a rule; the mesh is refused and the rest of the work goes on.

    `code` is a key of REFUSALS; `rule` says what should hold, `found` the values that do not, `place` the file
    (and line), `advice` what to do.
    """

    def __init__(self, code: str, rule: str, found: str, *, place: str = "", advice: str = "") -> None:
        assert code in REFUSALS, code
        self.code, self.rule, self.found, self.place, self.advice = code, rule, found, place, advice
        where = f"{place}: " if place else ""
        then = f". {advice[0].upper()}{advice[1:]}" if advice else ""
        super().__init__(f"{where}{rule}, but {found}{then} [{code}]")

    def __reduce__(self) -> tuple[object, ...]:
        """Exceptions with keyword arguments do not pickle by themselves; workers send these home."""
        return _rebuild, (self.code, self.rule, self.found, self.place, self.advice)


def _rebuild(code: str, rule: str, found: str, place: str, advice: str) -> InvalidMesh:
    return InvalidMesh(code, rule, found, place=place, advice=advice)


class InvalidShard(MeshshardError):
    """A shard or an index is damaged, hostile, or not of this format."""


class UsageError(MeshshardError):
    """What was asked for cannot be done; the text says what to type instead."""
