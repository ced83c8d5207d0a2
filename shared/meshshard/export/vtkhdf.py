"""A VTKHDF file for each mesh, for ParaView and VTK: its triangles, with all fields of its vertices and faces.

Specification: https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/vtkhdf_specifications.html
"""

import h5py
import numpy as np

from meshshard.dataset import Dataset
from meshshard.export import Exporter
from meshshard.sample import Sample
from meshshard.schema import PER_FACE, PER_VERTEX

VERSION = (2, 6)
"""The first version of the specification with everything used here, so that older readers have no complaint."""

CELLS = ("Vertices", "Lines", "Polygons", "Strips")
"""Kinds of cells that a PolyData must have, be it none of them."""


def exporter(dataset: Dataset) -> Exporter:  # noqa: ARG001  every data set can be written
    """The format `vtkhdf`."""
    return Exporter(".vtkhdf", vtkhdf_bytes)


def vtkhdf_bytes(sample: Sample) -> bytes:
    """A PolyData in the unit and place of the mesh file. Point and cell data have the names of the shard's fields;
    `face_labels`, or `vertex_labels` or `dihedral` where there are none, are what a viewer colours by."""
    with h5py.File("image", "w", driver="core", backing_store=False, libver="latest") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array(VERSION)
        root.attrs["Type"] = np.bytes_("PolyData")
        _add(root, "NumberOfPoints", np.array([len(sample.vertices)]))
        _add(root, "Points", sample.original_vertices)
        for kind in CELLS:
            _add_cells(root.create_group(kind), sample.faces if kind == "Polygons" else np.empty((0, 3), dtype="i4"))
        for group, fields in (("PointData", PER_VERTEX), ("CellData", PER_FACE)):
            data = root.create_group(group)
            for field in fields:
                values = getattr(sample, field.name)
                if values is not None and field.name not in ("vertices", "faces"):
                    _add(data, field.name, values)
        for group, name in (("CellData", "face_labels"), ("PointData", "vertex_labels"), ("PointData", "dihedral")):
            if name in root[group]:
                root[group][name].attrs["Attribute"] = np.bytes_("Scalars")
                break
        file.flush()
        return bytes(file.id.get_file_image())


def _add_cells(group: h5py.Group, cells: np.ndarray) -> None:
    _add(group, "NumberOfCells", np.array([len(cells)]))
    _add(group, "NumberOfConnectivityIds", np.array([cells.size]))
    _add(group, "Offsets", np.arange(len(cells) + 1) * 3)
    _add(group, "Connectivity", cells.ravel().astype("i8"))


def _add(group: h5py.Group, name: str, values: np.ndarray) -> None:
    # without the time of writing, so that the same mesh gives the same bytes
    group.create_dataset(name, data=values, track_times=False)
