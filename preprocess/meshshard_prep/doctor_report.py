"""A diagnosis in words."""

import math
from typing import Any

from meshshard_prep.doctor import Diagnosis
from meshshard_prep.lost import Lost


def rows(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Everything that was found about one mesh: name and value, the verdict last."""
    found = diagnosis.found
    result = [("mesh", diagnosis.source)]
    if "bytes" in found:
        result.append(("file", f"{found.get('format', 'of no format that is read')}, {found['bytes']} bytes"))
    if "vertices" in found:
        result.append(("vertices", str(found["vertices"])))
        result.append(("faces", f"{found['polygons']} polygons, {found['triangles']} triangles"))
    if "prepared" in found:
        prepared = found["prepared"]
        result.append(("prepared", f"{prepared['vertices']} vertices, {prepared['triangles']} triangles"))
    if "counts" in found:
        result += _geometry(found)
    if "labels" in found:
        labels = found["labels"]
        shares = ", ".join(f"{value}: {count}" for value, count in labels["lines"].items())
        result.append(("labels", f"{labels['file']}, one a {labels['domain']}; {shares}"))
        result += [("labels stored", labels["rule"])] if "rule" in labels else []
    if "offered" in found:
        forms = (f"{labels['form']} {labels['name']}".strip() for labels in found["offered"])
        result.append(("could be labels", ", ".join(forms)))
    return [*result, ("verdict", verdict(diagnosis))]


def verdict(diagnosis: Diagnosis) -> str:
    """Stored with its bound, or refused with the reason."""
    if isinstance(diagnosis.refusal, Lost):
        return f"failed: {diagnosis.refusal} [{diagnosis.refusal.code}]"
    if diagnosis.refusal:
        return f"refused: {diagnosis.refusal}"
    hks = diagnosis.found["hks"]
    return f"usable: relative error of hks at most {hks['error_bound']:.1e}, with {hks['poles']} poles"


def oddities(diagnosis: Diagnosis) -> str:
    """What is not as in a closed, clean surface of one piece, in a line."""
    found = diagnosis.found
    if "counts" not in found:
        return ""
    counts = found["counts"]
    numbers = {
        "pieces": len(found["piece_faces"]) if len(found["piece_faces"]) > 1 else 0,
        "boundary edges": counts["boundary_edges"],
        "non-manifold edges": counts["nonmanifold_edges"],
        "bow-tie vertices": found["bowtie_vertices"],
        "edges whose faces disagree": found["disagreeing_edges"],
        "pieces inside out": found["inside_out_pieces"],
        "vertices welded": counts["welded_vertices"],
        "vertices without a face": counts["unreferenced_vertices"],
        "faces left out": counts["degenerate_faces"],
        "faces without area": counts["zero_area_faces"],
        "duplicate faces": found["duplicate_faces"],
        "vertices that float32 merges": found["float32_collisions"],
    }
    return ", ".join(f"{count} {name}" for name, count in numbers.items() if count)


def _geometry(found: dict[str, Any]) -> list[tuple[str, str]]:
    counts, pieces = found["counts"], found["piece_faces"]
    most = ", ".join(map(str, pieces[:8])) + (", ..." if len(pieces) > 8 else "")
    sides = " x ".join(f"{high - low:.4g}" for low, high in zip(found["low"], found["high"], strict=True))
    genus = "no genus" if found["genus"] is None else f"genus {found['genus']}"
    turned = "orientable" if found["orientable"] else "not orientable"
    ratio = "infinite: an edge has no length" if math.isinf(found["edge_ratio"]) else f"{found['edge_ratio']:.4g}"
    return [
        (
            "working copy",
            f"{counts['welded_vertices']} vertices welded, {counts['degenerate_faces']} degenerate faces left out, "
            f"{counts['unreferenced_vertices']} vertices without a face left out",
        ),
        ("odd faces", f"{counts['zero_area_faces']} without area, {found['duplicate_faces']} duplicate"),
        ("pieces", f"{len(pieces)}, {found['closed_pieces']} closed; faces: {most}"),
        ("boundary", f"{counts['boundary_edges']} edges in {found['boundary_loops']} loops"),
        ("non-manifold", f"{counts['nonmanifold_edges']} edges, {found['bowtie_vertices']} bow-tie vertices"),
        (
            "orientation",
            f"{turned}, {found['disagreeing_edges']} edges whose faces disagree, "
            f"{found['inside_out_pieces']} pieces inside out",
        ),
        ("topology", f"Euler characteristic {found['euler_characteristic']}, {genus}"),
        ("size", f"{sides}, radius {found['radius']:.4g} around {' '.join(f'{x:.4g}' for x in found['centre'])}"),
        ("edges", f"longest / shortest {ratio}, {found['float32_collisions']} vertices that float32 merges"),
    ]
