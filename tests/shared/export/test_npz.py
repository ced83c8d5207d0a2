import io
from dataclasses import fields

import numpy as np
import pytest
from samples import sample, toy_dataset

from meshshard import open_dataset
from meshshard.export.npz import exporter, npz_bytes


def test_every_field_is_there_without_pickle(tmp_path):
    dataset = open_dataset(toy_dataset(tmp_path))
    encode = exporter(dataset).encode
    for number in range(3):
        expected = dataset[number]
        with np.load(io.BytesIO(encode(expected)), allow_pickle=False) as archive:
            for field in fields(expected):
                value = getattr(expected, field.name)
                if field.name == "diagnostics":
                    assert {name: archive[name].item() for name in value} == value
                elif value is None:
                    assert field.name not in archive
                else:
                    np.testing.assert_array_equal(archive[field.name], value)
            assert archive["classes"].tolist() == ["low", "middle", "high"]
            assert archive["recipe"].item() == dataset.recipe.to_json()
            assert archive["hks"].dtype == np.float32


def test_the_same_mesh_gives_the_same_bytes(tmp_path, monkeypatch):
    encode = exporter(open_dataset(toy_dataset(tmp_path))).encode
    first = encode(sample(1))
    monkeypatch.setattr("time.time", lambda: 2e9)
    monkeypatch.setattr("time.localtime", lambda *_: (2033, 5, 18, 3, 33, 20, 2, 138, 0))
    assert encode(sample(1)) == first


def test_objects_are_never_pickled():
    with pytest.raises(ValueError, match=r"\['b'\] would be pickled"):
        npz_bytes({"a": np.zeros(1), "b": np.array([None])})
