"""Pictures show all that they are about."""

import numpy as np
import pytest
from PIL import Image
from shapes import box

from meshshard_train.pictures import Tile, gallery


@pytest.mark.usefixtures("fine_pictures")
@pytest.mark.parametrize("size", [2.4, 4.0])
def test_the_legend_of_one_mesh_is_not_cut_off(tmp_path, size):
    vertices, faces = box()
    names = ["upper arm", "lower arm", "a longer name", "torso", "head"]
    tile = Tile(title="a", vertices=vertices, faces=faces, labels=np.arange(len(faces)) % len(names))
    gallery(tmp_path / "a.png", [tile], names, columns=1, title="a box", size=size)
    with Image.open(tmp_path / "a.png") as picture:
        pixels = np.asarray(picture.convert("L"))
    assert (pixels[:, [0, 1, -2, -1]] == 255).all()
    assert (pixels[-round(0.5 * len(pixels) / size) :] < 100).any()  # it is there
