"""Networks as files for other programs: ONNX, or a program of torch.export. A file is run before it is published."""

import io
import json
import logging
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from meshshard import open_dataset
from meshshard.errors import MeshshardError, UsageError
from meshshard.files import publish
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.portable import OUTPUTS, Portable

TOLERANCE = 1e-4
"""Largest difference between a file's outputs and the network's."""

Fields = dict[str, Tensor]


def write_model(best: Checkpoint, form: str, out: Path) -> dict[str, Any]:
    """Export the network of a checkpoint to a file, and tell what it takes, what it gives, and how exact it is.

    UsageError: no such format; or the file's outputs are not those of the network, and then none is left.
    """
    if form not in FORMATS:
        raise UsageError(f"--to is {' or '.join(FORMATS)}, not {form!r}")
    encode, opened = FORMATS[form]
    portable, meshes = Portable(best).eval(), check_meshes(best)
    file = encode(portable, metadata_of(best))
    difference = largest_difference(portable, opened(file), meshes)
    if not difference <= TOLERANCE:
        raise UsageError(
            f"the {form} file gives other results than the network: they differ by up to {difference:.2g}, and "
            f"{TOLERANCE:g} is allowed; {out} was not written; try the other format, or another torch or onnxruntime"
        )
    out.parent.mkdir(parents=True, exist_ok=True)
    publish(out, file)
    return {
        "file": str(out),
        "format": form,
        "bytes": len(file),
        "inputs": {name: list(values.shape[1:]) for name, values in meshes[0].items()},
        "output": dict(zip(("name", "meaning"), OUTPUTS[best.config.task], strict=True)),
        "largest_difference": difference,
        "checked": [mesh["hks"].shape[0] for mesh in meshes],
    }


def metadata_of(best: Checkpoint) -> dict[str, str]:
    """What the file says about itself."""
    return {
        "classes": json.dumps(list(best.classes), ensure_ascii=False),
        "output": " ".join(OUTPUTS[best.config.task]),
        "recipe": best.recipe.to_json(),
        "config": best.config.to_json(),
        "content_sha256": best.content_sha256,
        "splits_sha256": best.splits_sha256,
    }


def check_meshes(best: Checkpoint) -> list[Fields]:
    """Random meshes of two sizes; and the smallest and the largest of the data set, where it still is."""
    portable = Portable(best)
    meshes = [portable.random_fields(50, 96, seed=0), portable.random_fields(333, 700, seed=1)]
    try:
        dataset = open_dataset(best.state["folder"])
    except (MeshshardError, OSError):
        return meshes
    if best.clashes(dataset):
        return meshes
    sizes = dataset.vertex_counts
    ends = {min(range(len(sizes)), key=sizes.__getitem__), max(range(len(sizes)), key=sizes.__getitem__)}
    return meshes + [portable.fields_of(dataset[number]) for number in sorted(ends)]


@torch.no_grad()
def largest_difference(portable: Portable, run: Callable[[Fields], Tensor], meshes: Sequence[Fields]) -> float:
    """Between the outputs of a file and of the network, the largest over some meshes; NaN counts as infinite."""
    found = [(run(mesh) - portable(**mesh)).abs().max().nan_to_num(torch.inf, torch.inf) for mesh in meshes]
    return float(max(found))


def program_of(portable: Portable) -> torch.export.ExportedProgram:
    """The network as a graph for any number of vertices and faces, without where on this machine its code lies."""
    vertices, faces = torch.export.Dim("vertices"), torch.export.Dim("faces")
    example = portable.random_fields(50, 96, seed=0)
    sizes = {name: {0: faces if name == "faces" else vertices} for name in example}
    with torch.no_grad():
        program = torch.export.export(portable, (), kwargs=example, dynamic_shapes=sizes)
    for node in program.graph.nodes:
        node.meta.pop("stack_trace", None)
    return program


def torch_file(portable: Portable, metadata: dict[str, str]) -> bytes:
    """A .pt2 file; the metadata is its extra file `meshshard.json`."""
    file = io.BytesIO()
    torch.export.save(program_of(portable), file, extra_files={"meshshard.json": json.dumps(metadata)})
    return file.getvalue()


def opened_torch(file: bytes) -> Callable[[Fields], Tensor]:
    """Run it with torch.export."""
    program = torch.export.load(io.BytesIO(file)).module()
    return lambda mesh: program(**mesh)


def onnx_file(portable: Portable, metadata: dict[str, str]) -> bytes:
    """An ONNX file of the exporter's own opset. Nothing is rewritten: who runs it optimises it, and much faster."""
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)  # it tells that torchvision is not there
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)  # torch about itself
        program = torch.onnx.export(
            program_of(portable),
            dynamo=True,
            verbose=False,
            optimize=False,
            input_names=portable.inputs,
            output_names=[OUTPUTS[portable.config.task][0]],
        )
    assert program is not None
    for node in program.model.graph:
        node.metadata_props.clear()  # where in the network it is, a paragraph each
    program.model.metadata_props.update(metadata)
    return program.model_proto.SerializeToString()


def opened_onnx(file: bytes) -> Callable[[Fields], Tensor]:
    """Run it with onnxruntime, on the processor."""
    import onnxruntime

    session = onnxruntime.InferenceSession(file, providers=["CPUExecutionProvider"])
    return lambda mesh: torch.from_numpy(session.run(None, {name: mesh[name].numpy() for name in mesh})[0])


FORMATS = {"onnx": (onnx_file, opened_onnx), "torch": (torch_file, opened_torch)}
"""Name -> how a network is written, and how a file is run."""
