"""VTKHDF time series of an unstructured grid whose points move and whose cells stay (VTK file format 2.0).

Written step by step: each step is on disk when :meth:`Series.append` returns, so a crash keeps what was written.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from types import TracebackType
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

TRIANGLE, QUAD = 5, 9

CUT_SHORT = re.compile(r"truncated file: eof = \d+, .*stored_eof = (\d+)")
"""What HDF5 says of a file that ends before it should."""


def _reopened(path: Path) -> tuple[h5py.File, bool]:
    """A file to go on with, and whether it was whole.

    Where a disk was full the end of a file is missing, and HDF5 refuses it; made as long as it should be it opens, with all that
    had reached the disk before.
    """
    try:
        return h5py.File(path, "r+"), True
    except OSError as problem:
        cut = CUT_SHORT.search(str(problem))
        if cut is None:
            raise
        os.truncate(path, int(cut.group(1)))
        return h5py.File(path, "r+"), False


class Series:
    """A VTKHDF file that grows by one step at a time.

    Parameters
    ----------
    path
        File to create, or to open where ``resume`` is true.
    connectivity, offsets
        Point indices of the polygons, one after the other, and where each starts (and the last ends).
    points
        Number of points.
    scalars
        Names of numbers kept for each step beside the grid (readers of VTKHDF ignore them).
    resume
        Open an existing file and go on after its last step.
    """

    def __init__(
        self,
        path: Path,
        connectivity: NDArray[np.int64],
        offsets: NDArray[np.int64],
        points: int,
        scalars: tuple[str, ...] = (),
        *,
        resume: bool = False,
    ) -> None:
        self.points = points
        self.steps: int
        """Steps in the file."""
        self.cells = len(offsets) - 1
        self._found: dict[str, Any] = {}
        if resume:
            self._file, whole = _reopened(path)
            self._root = self._file["VTKHDF"]
            # of a file whose end is missing, the last step was being written
            self.steps = max(int(self._root["Steps"].attrs["NSteps"]) - (not whole), 0)
            return
        self.steps = 0
        self._file = h5py.File(path, "w")
        root = self._root = self._file.create_group("VTKHDF", track_order=True)
        root.attrs["Version"] = np.array([2, 0], np.int64)
        root.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", 16))
        root["NumberOfPoints"] = np.array([points], np.int64)
        root["NumberOfCells"] = np.array([self.cells], np.int64)
        root["NumberOfConnectivityIds"] = np.array([len(connectivity)], np.int64)
        root["Connectivity"] = connectivity.astype(np.int64)
        root["Offsets"] = offsets.astype(np.int64)
        root["Types"] = np.where(np.diff(offsets) == 3, TRIANGLE, QUAD).astype(np.uint8)
        self._growing(root, "Points", 3, points)
        root.create_group("PointData")
        root.create_group("CellData")
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = np.int64(0)
        steps.create_dataset("Values", (0,), np.float64, maxshape=(None,), chunks=(64,))
        for name in ("PartOffsets", "NumberOfParts", "PointOffsets"):
            steps.create_dataset(name, (0,), np.int64, maxshape=(None,), chunks=(64,))
        for name in ("CellOffsets", "ConnectivityIdOffsets"):
            steps.create_dataset(name, (0, 1), np.int64, maxshape=(None, 1), chunks=(64, 1))
        steps.create_group("PointDataOffsets")
        steps.create_group("CellDataOffsets")
        for name in scalars:
            self._file.create_dataset(name, (0,), np.float64, maxshape=(None,), chunks=(64,))
        self._file.flush()

    def __enter__(self) -> Series:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @staticmethod
    def _growing(group: Any, name: str, components: int, rows: int) -> Any:
        """A dataset that grows along its first axis, one chunk per step."""
        shape = (0,) if components == 1 else (0, components)
        chunk = (max(rows, 1), *shape[1:])
        return group.create_dataset(name, shape, np.float64, maxshape=(None, *shape[1:]), chunks=chunk)

    def append(
        self,
        time: float,
        points: Floats,
        point_data: dict[str, Floats],
        cell_data: dict[str, Floats],
        **scalars: float,
    ) -> None:
        """Write one step: positions [points, 3] and fields with one row per point or cell."""
        root, steps, n = self._root, self._root["Steps"], self.steps
        self._extend("VTKHDF/Points", n * self.points, points)
        for name, value in scalars.items():
            self._extend(name, n, np.array([value]))
        for kind, fields in (("PointData", point_data), ("CellData", cell_data)):
            for name, values in fields.items():
                if n == 0 and name not in root[kind]:
                    self._growing(root[kind], name, 1 if values.ndim == 1 else values.shape[1], len(values))
                    steps[f"{kind}Offsets"].create_dataset(name, (0,), np.int64, maxshape=(None,), chunks=(64,))
                self._extend(f"VTKHDF/Steps/{kind}Offsets/{name}", n, np.array([n * len(values)]))
                self._extend(f"VTKHDF/{kind}/{name}", n * len(values), values)
        for name, number in (
            ("Values", time),
            ("PartOffsets", 0),
            ("NumberOfParts", 1),
            ("PointOffsets", n * self.points),
        ):
            self._extend(f"VTKHDF/Steps/{name}", n, np.array([number]))
        for name in ("CellOffsets", "ConnectivityIdOffsets"):
            self._extend(f"VTKHDF/Steps/{name}", n, np.array([[0]]))
        steps.attrs.modify("NSteps", np.int64(n + 1))
        self._file.flush()
        self.steps = n + 1

    def _extend(self, name: str, start: int, values: NDArray[Any]) -> None:
        """Write rows of a dataset from ``start`` on; what lay there belongs to a step that was never completed.

        By h5py's low-level calls: a step is some thirty small writes, and with ``dataset[start:] = values`` each takes four
        times as long.
        """
        if name not in self._found:
            self._found[name] = self._file[name].id
        dataset = self._found[name]
        dataset.set_extent((start + len(values), *values.shape[1:]))
        target = dataset.get_space()
        target.select_hyperslab((start, *(0 for _ in values.shape[1:])), values.shape)
        dataset.write(h5py.h5s.create_simple(values.shape), target, np.ascontiguousarray(values))

    def close(self) -> None:
        """Close the file."""
        self._file.close()
