import numpy as np
import pytest
from samples import sample

from meshshard.export.vtkhdf import vtkhdf_bytes
from meshshard.schema import PER_FACE, PER_VERTEX

RNG = np.random.default_rng(0)
EVERYTHING = {
    "dihedral_signed": RNG.random(18).astype("f4"),
    "dihedral_official": RNG.random((18, 3)).astype("f4"),
    "eigenvectors": RNG.random((18, 5)).astype("f4"),
    "eigenvalues": np.arange(5.0),
    "vertex_labels": RNG.integers(-1, 3, 18).astype("i2"),
}


def by_vtk(path):
    """The PolyData that VTK's own reader makes of a file; an error of the reader fails the test."""
    from vtkmodules.vtkIOHDF import vtkHDFReader

    reader = vtkHDFReader()
    complaints = []
    for kind in ("ErrorEvent", "WarningEvent"):
        reader.AddObserver(kind, lambda _, event: complaints.append(event))
    assert reader.CanReadFile(str(path))
    reader.SetFileName(str(path))
    reader.Update()
    assert complaints == []
    return reader.GetOutputDataObject(0)


def array(data):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return vtk_to_numpy(data)


@pytest.mark.parametrize("values", [{}, EVERYTHING, {"labels": None}], ids=["labelled", "everything", "bare"])
def test_vtk_reads_the_mesh_and_every_field(tmp_path, values):
    mesh = sample(1, **values)
    (tmp_path / "mesh.vtkhdf").write_bytes(vtkhdf_bytes(mesh))
    found = by_vtk(tmp_path / "mesh.vtkhdf")
    assert found.GetClassName() == "vtkPolyData"
    np.testing.assert_array_equal(array(found.GetPoints().GetData()), mesh.original_vertices)
    assert (found.GetNumberOfVerts(), found.GetNumberOfLines(), found.GetNumberOfStrips()) == (0, 0, 0)
    np.testing.assert_array_equal(array(found.GetPolys().GetConnectivityArray()).reshape(-1, 3), mesh.faces)
    np.testing.assert_array_equal(array(found.GetPolys().GetOffsetsArray()), 3 * np.arange(len(mesh.faces) + 1))
    for data, fields in ((found.GetPointData(), PER_VERTEX), (found.GetCellData(), PER_FACE)):
        there = {f.name for f in fields if getattr(mesh, f.name) is not None} - {"vertices", "faces"}
        assert {data.GetArrayName(number) for number in range(data.GetNumberOfArrays())} == there
        for name in there:
            expected = getattr(mesh, name)
            np.testing.assert_array_equal(array(data.GetArray(name)), expected)
            assert array(data.GetArray(name)).dtype == expected.dtype


@pytest.mark.parametrize(
    ("values", "cells", "points"),
    [
        (EVERYTHING, "face_labels", None),
        (EVERYTHING | {"labels": None}, None, "vertex_labels"),
        ({"labels": None}, None, "dihedral"),
    ],
)
def test_a_viewer_colours_by_labels_where_there_are_some(tmp_path, values, cells, points):
    (tmp_path / "mesh.vtkhdf").write_bytes(vtkhdf_bytes(sample(1, **values)))
    found = by_vtk(tmp_path / "mesh.vtkhdf")
    chosen = [
        data.GetScalars() and data.GetScalars().GetName() for data in (found.GetCellData(), found.GetPointData())
    ]
    assert chosen == [cells, points]


def test_the_same_mesh_gives_the_same_bytes():
    first = vtkhdf_bytes(sample(1))
    assert vtkhdf_bytes(sample(1)) == first
