"""Each file of the corpus is stored, or refused with a code of the list: goal R1."""

import pytest
from effort import times

from meshshard import open_dataset
from meshshard.errors import REFUSALS
from meshshard.recipe import RECIPES
from meshshard.verify import verify
from meshshard_prep.datasets.layout import Entry, RawDataset
from meshshard_prep.run import run

FILES = 372
LARGEST = times(40_000, 10**9)
"""Bytes. Larger ones are for the long form: together they take longer than the rest."""


@pytest.mark.soak
@pytest.mark.data
def test_in_is_stored_and_refused(data_root, tmp_path, measured):
    root = data_root / "mesh_corpus"
    names = sorted(p.relative_to(root).as_posix() for p in root.glob("*/*") if p.stat().st_size <= LARGEST)
    entries = tuple(Entry(id=name, path=root / name, source=name) for name in names)
    corpus = RawDataset(name="corpus", task="unlabelled", classes=(), entries=entries)
    index = run(corpus, tmp_path, RECIPES["paper"], jobs=1).index

    assert index.failed == ()
    assert sorted([*index.ids, *(entry.id for entry in index.refused)]) == names
    assert {entry.code for entry in index.refused} <= set(REFUSALS)
    assert all(entry.code in entry.message and entry.source in entry.message for entry in index.refused)
    assert len(names) > times(290, FILES - 1)
    assert len(index.ids) > 0.55 * len(names)
    assert len({entry.code for entry in index.refused}) >= 10
    unread = {entry.source for entry in index.refused if entry.code == "unsupported-format"}
    assert sum(name.lower().endswith(".stl") for name in unread) > 30
    assert not [name for name in index.ids if name.lower().endswith(".stl")]

    assert verify(tmp_path, full=True) == []
    assert len(open_dataset(tmp_path)) == len(index.ids)
    measured("R1", f"corpus: {len(names)} in = {len(index.ids)} stored + {len(index.refused)} refused + 0 failed")
