"""A NumPy archive for each mesh: every field of its sample under its name."""

import io
from dataclasses import fields

import numpy as np

from meshshard.dataset import Dataset
from meshshard.export import Exporter
from meshshard.sample import Sample


def exporter(dataset: Dataset) -> Exporter:
    """The format `npz`."""
    names = {"classes": np.array(dataset.classes, dtype=str), "recipe": np.array(dataset.recipe.to_json())}
    return Exporter(".npz", lambda sample: npz_bytes(fields_of(sample) | names))


def fields_of(sample: Sample) -> dict[str, np.ndarray]:
    """Field -> array, each diagnostic under its own name; optional fields that the sample lacks are left out."""
    values = {f.name: getattr(sample, f.name) for f in fields(sample) if f.name != "diagnostics"}
    return {
        name: np.asarray(value) for name, value in (values | dict(sample.diagnostics)).items() if value is not None
    }


def npz_bytes(arrays: dict[str, np.ndarray]) -> bytes:
    """An archive that `numpy.load` opens without pickle; the same arrays give the same bytes."""
    if objects := [name for name, array in arrays.items() if array.dtype.hasobject]:
        raise ValueError(f"{objects} would be pickled")
    stream = io.BytesIO()
    np.savez(stream, **arrays)  # type: ignore[arg-type]  # a keyword could be allow_pickle, a bool
    return stream.getvalue()
