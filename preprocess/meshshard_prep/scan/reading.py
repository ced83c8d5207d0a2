"""What the findings of a folder are taken to mean, and where they have another reading."""

from dataclasses import dataclass

from meshshard_prep.scan.folders import ClassFolders
from meshshard_prep.scan.labels import Labelling
from meshshard_prep.scan.look import Findings


@dataclass(frozen=True, kw_only=True)
class Reading:
    """`kind`: "labels", "class list", "class folders" or "none". `labelling`: of kind "labels". `others`: labellings
    that fit as many meshes and may be meant instead. `doubt`: why the user should look, or empty."""

    kind: str
    labelling: Labelling | None = None
    others: tuple[Labelling, ...] = ()
    doubt: str = ""


def read_findings(findings: Findings) -> Reading:
    """Label files come first, then a list of classes, then folders that must be classes, then labels in the meshes,
    then folders that may be classes."""
    in_files = [labelling for labelling in findings.labellings if labelling.pattern]
    in_meshes = [labelling for labelling in findings.labellings if not labelling.pattern]
    folders = findings.folders
    if in_files:
        return _labels(in_files, findings.sets)
    if findings.lists.classes:
        return Reading(kind="class list")
    if folders and (folders.sure or not in_meshes):
        return Reading(kind="class folders", doubt=_doubt_of(folders))
    if in_meshes:
        return _labels(in_meshes, ())
    return Reading(kind="none")


def _doubt_of(folders: ClassFolders) -> str:
    if folders.outermost:
        return "are these folders classes, or the outermost ones, or none? Keep the line that is meant"
    return "" if folders.sure else "are these folders classes? If not, remove this line and the table [classes]"


def _labels(labellings: list[Labelling], sets: tuple[str, ...]) -> Reading:
    best, *rest = labellings
    others = tuple(labelling for labelling in rest if len(labelling.of) == len(best.of))
    if others:
        doubt = "several files or properties fit; keep the one that is meant"
    elif len(best.domains) > 1:
        doubt = f"counts fit {' and '.join(best.domains)} alike; keep the one that is meant"
    elif sets:
        doubt = (
            f"do labels of {' and '.join(sets)} mean the same? Then give them the same names: "
            "what has one name is one class"
        )
    else:
        doubt = ""
    return Reading(kind="labels", labelling=best, others=others, doubt=doubt)
