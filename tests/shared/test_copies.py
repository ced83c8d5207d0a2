from meshshard.copies import copy_id, most_copies, original_id


def test_ids_of_copies_are_told_from_others():
    assert original_id(copy_id("train/a~b", 12)) == "train/a~b"
    for name in ("train/a", "a~deformed", "a~deformed0", "~deformed1", "a~deformed1.obj", "A~1"):
        assert original_id(name) == name
    assert most_copies(["a", copy_id("a", 1), copy_id("b", 10), copy_id("b", 2)]) == 10
    assert most_copies(["a"]) == 0
