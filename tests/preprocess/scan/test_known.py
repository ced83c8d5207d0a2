"""A folder is told to be a known data set only where it is laid out like one."""

import shutil

import pytest
from shapes import box, write_labels, write_obj

from meshshard_prep.datasets import ADAPTERS
from meshshard_prep.datasets.folder import mesh_entries
from meshshard_prep.scan.known import known_as, meshes_of

NUMBERS = sorted({meshes_of(name) for name in ADAPTERS if 0 < meshes_of(name) <= 400})


@pytest.mark.parametrize("number", [1, *NUMBERS])
def test_the_number_of_meshes_alone_makes_no_data_set(tmp_path, number):
    write_obj(tmp_path / "0.off", *box())
    for other in range(1, number):
        (tmp_path / f"{other}.off").symlink_to(tmp_path / "0.off")
    assert known_as(tmp_path, mesh_entries(tmp_path)) == ("", "")


def human_seg(root, train, test):
    for split, count in (("train", train), ("test", test)):
        for number in range(count):
            write_obj(root / split / f"{split}{number}.obj", *box())
            write_labels(root / "seg" / f"{split}{number}.eseg", [1] * 18)


def test_layout_and_numbers_make_a_data_set(tmp_path):
    human_seg(tmp_path, 381, 18)
    assert known_as(tmp_path, mesh_entries(tmp_path)) == ("human_seg", "")
    (tmp_path / "seg" / "test0.eseg").unlink()
    assert known_as(tmp_path, mesh_entries(tmp_path)) == ("", "")


def test_a_layout_that_several_have_says_nothing(tmp_path):
    human_seg(tmp_path, 3, 2)
    assert known_as(tmp_path, mesh_entries(tmp_path)) == ("", "")


def test_a_layout_that_one_has_is_named(tmp_path):
    for name in ("chairs", "vases"):
        write_obj(tmp_path / name / "shapes" / "1.off", *box())
        write_labels(tmp_path / name / "gt" / "1.seg", [1] * 12)
    assert known_as(tmp_path, mesh_entries(tmp_path)) == ("", "coseg_original")
    shutil.copytree(tmp_path / "vases" / "shapes", tmp_path / "more")
    assert known_as(tmp_path, mesh_entries(tmp_path)) == ("", "")
