"""VTKHDF series: what is written is read back, by h5py and by VTK itself where it is installed."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

from weftform.exchange.vtkhdf import Series

CONNECTIVITY = np.array([0, 1, 4, 3, 1, 2, 5])
OFFSETS = np.array([0, 4, 7])
FLAT = np.array([[i, j, 0.0] for j in (0, 1) for i in (0, 1, 2)])
STEPS = 4


def frame(step):
    points = FLAT + np.array([0.0, 0.0, 0.5 * step])
    return (
        0.1 * step,
        points,
        {"Displacement_mm": points - FLAT, "Height": points[:, 2]},
        {"ShearAngle_deg": np.array([10.0, 20.0]) + step, "WarpDirection": np.eye(3)[:2] * (step + 1)},
    )


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "fields.vtkhdf"
    with Series(path, CONNECTIVITY, OFFSETS, 6, ("displacement_mm",)) as series:
        for step in range(STEPS):
            series.append(*frame(step), displacement_mm=10.0 * step)
    return path


def test_file_holds_what_the_format_asks_for(path):
    with h5py.File(path) as file:
        root = file["VTKHDF"]
        assert list(root.attrs["Version"]) == [2, 0]
        assert root.attrs["Type"] in (b"UnstructuredGrid", "UnstructuredGrid")
        assert root["Types"][:].tolist() == [9, 5]
        assert root["NumberOfConnectivityIds"][:].tolist() == [7]
        assert root["Steps"].attrs["NSteps"] == STEPS
        assert root["Steps/PointOffsets"][:].tolist() == [0, 6, 12, 18]
        assert root["Steps/CellOffsets"][:].tolist() == [[0]] * STEPS
        assert root["Steps/CellDataOffsets/ShearAngle_deg"][:].tolist() == [0, 2, 4, 6]
        np.testing.assert_allclose(root["Steps/Values"][:], [0.0, 0.1, 0.2, 0.3])
        np.testing.assert_array_equal(file["displacement_mm"][:], [0, 10, 20, 30])
        for step in range(STEPS):
            _, points, point_data, cell_data = frame(step)
            np.testing.assert_array_equal(root["Points"][6 * step : 6 * step + 6], points)
            for name, values in point_data.items():
                np.testing.assert_array_equal(root["PointData"][name][6 * step : 6 * step + 6], values)
            for name, values in cell_data.items():
                np.testing.assert_array_equal(root["CellData"][name][2 * step : 2 * step + 2], values)


def test_each_step_is_on_disk_before_the_file_is_closed(tmp_path):
    """A copy made while the file is open, as after a crash, holds the steps so far."""
    path, copy = tmp_path / "a.vtkhdf", tmp_path / "b.vtkhdf"
    series = Series(path, CONNECTIVITY, OFFSETS, 6)
    for step in range(2):
        series.append(*frame(step))
    copy.write_bytes(path.read_bytes())
    series.close()
    with h5py.File(copy) as file:
        assert file["VTKHDF/Steps"].attrs["NSteps"] == 2
        np.testing.assert_array_equal(file["VTKHDF/Points"][6:12], frame(1)[1])


def test_series_goes_on_after_its_last_step(path):
    with Series(path, CONNECTIVITY, OFFSETS, 6, ("displacement_mm",), resume=True) as series:
        assert series.steps == STEPS
        series.append(*frame(STEPS), displacement_mm=40.0)
    with h5py.File(path) as file:
        assert file["VTKHDF/Steps"].attrs["NSteps"] == STEPS + 1
        np.testing.assert_array_equal(file["VTKHDF/Points"][-6:], frame(STEPS)[1])


def test_series_goes_on_where_the_end_of_its_file_is_missing(path):
    """As after a full disk; the last step may be what is missing, so it is written again."""
    with path.open("r+b") as file:
        file.truncate(path.stat().st_size - 100)
    with pytest.raises(OSError, match="truncated"):
        h5py.File(path)
    with Series(path, CONNECTIVITY, OFFSETS, 6, ("displacement_mm",), resume=True) as series:
        assert series.steps == STEPS - 1
        series.append(*frame(STEPS), displacement_mm=40.0)
    with h5py.File(path) as file:
        assert file["VTKHDF/Steps"].attrs["NSteps"] == STEPS
        for place, step in enumerate([*range(STEPS - 1), STEPS]):
            _, points, _, cell_data = frame(step)
            np.testing.assert_array_equal(file["VTKHDF/Points"][6 * place : 6 * place + 6], points)
            for name, values in cell_data.items():
                np.testing.assert_array_equal(file["VTKHDF/CellData"][name][2 * place : 2 * place + 2], values)


def test_series_goes_on_after_a_first_step_that_broke_off(tmp_path, monkeypatch):
    path = tmp_path / "a.vtkhdf"
    extend = Series._extend

    def break_off(series, name, start, values):
        if name.startswith("VTKHDF/CellData"):
            raise OSError("no space left")
        extend(series, name, start, values)

    with Series(path, CONNECTIVITY, OFFSETS, 6) as series, monkeypatch.context() as broken:
        broken.setattr(Series, "_extend", break_off)
        with pytest.raises(OSError, match="no space"):
            series.append(*frame(0))
    with Series(path, CONNECTIVITY, OFFSETS, 6, resume=True) as series:
        assert series.steps == 0
        series.append(*frame(0))
    with h5py.File(path) as file:
        assert file["VTKHDF/Steps"].attrs["NSteps"] == 1
        np.testing.assert_array_equal(file["VTKHDF/Points"][:], frame(0)[1])


def test_vtk_reads_moving_points_and_cell_data(path):
    vtk = pytest.importorskip("vtkmodules.vtkIOHDF")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == STEPS
    for step in range(STEPS):
        reader.SetStep(step)
        reader.Update()
        grid = reader.GetOutputDataObject(0)
        _, points, point_data, cell_data = frame(step)
        assert grid.GetNumberOfCells() == 2
        assert [grid.GetCellType(k) for k in (0, 1)] == [9, 5]
        np.testing.assert_array_equal(vtk_to_numpy(grid.GetPoints().GetData()), points)
        for found, data in ((grid.GetPointData(), point_data), (grid.GetCellData(), cell_data)):
            for name, values in data.items():
                np.testing.assert_array_equal(vtk_to_numpy(found.GetArray(name)), values)
