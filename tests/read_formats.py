#!/usr/bin/env python3
"""Reads what voxlathe writes with the reference readers of each format.

    read_formats.py VOXLATHE [FORMAT ...]

One asymmetric solid of two materials on a grid of prime and different dimensions, three different spacings, and an
origin off zero. For each format the readers must give every value bit for bit as the OpenEXR slices hold it, or, where
OpenEXR cannot be had, as the bare arrays do; and the world position of marked voxels where the scene says they are.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile

import numpy as np

DIMS = (31, 23, 37)
ORIGIN = (-1.3, 0.7, 2.1)
SPACING = (0.11, 0.07, 0.13)
SCENE = f"""
schema = 1
name = "marked solid"
units = "mm"
[grid]
origin = {list(ORIGIN)}
spacing = {list(SPACING)}
dims = {list(DIMS)}
[output]
channels = ["occupancy", "fraction", "sdf", "material"]
[[solid]]
kind = "box"
size = [1.4, 0.5, 1.7]
place = [{{ rotate = {{ axis = [1, 2, 3], degrees = 20 }} }}, {{ translate = [-0.9, 0.9, 2.5] }}]
material = 3
[[solid]]
kind = "cone"
radius1 = 0.45
radius2 = 0.1
height = 2.2
axis = {{ origin = [1.2, 1.5, 3.2], direction = [-0.3, 0.1, 1] }}
material = 70000
"""
CHANNELS = ["occupancy", "fraction", "sdf", "material"]
DTYPES = {"occupancy": "u1", "fraction": "f4", "sdf": "f4", "material": "u4"}


def run(*arguments):
    done = subprocess.run([VOXLATHE, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == 0, (arguments, done.stderr)
    return done.stdout


def centre(index):
    """Where the centre of voxel (i, j, k) is."""
    return [o + (n + 0.5) * d for o, n, d in zip(ORIGIN, index, SPACING)]


def near(found, wanted):
    return np.allclose(np.array(found, float), wanted, rtol=0, atol=4e-15 * 8)


def marked(values):
    """Voxels (i, j, k) that are told apart from all their mirror images."""
    sdf = values["sdf"]
    deepest = np.unravel_index(np.argmin(sdf), sdf.shape)
    farthest = np.unravel_index(np.argmax(sdf), sdf.shape)
    other = np.argwhere(values["material"] == 70000)[0]
    corner = (len(sdf) - 1, 0, sdf.shape[2] - 1)
    return [tuple(int(n) for n in reversed(at)) for at in (deepest, farthest, other, corner)]


def same(found, wanted, what):
    found = np.asarray(found)
    assert found.shape == wanted.shape, (what, found.shape, wanted.shape)
    assert found.dtype.itemsize == wanted.dtype.itemsize, (what, found.dtype)
    assert found.dtype.kind == wanted.dtype.kind, (what, found.dtype)
    assert found.astype(wanted.dtype).tobytes() == wanted.tobytes(), what


class Checks:
    def __init__(self, place):
        self.place = place
        self.scene = os.path.join(place, "marked.toml")
        with open(self.scene, "w") as scene:
            scene.write(SCENE)
        self.values = self.reference()
        for name, array in self.values.items():
            for axis in range(3):
                assert not np.array_equal(array, np.flip(array, axis)), (name, axis)

    def out(self, name, *flags):
        path = os.path.join(self.place, name)
        run("voxelize", self.scene, "-o", path, *flags)
        return path

    def reference(self):
        path = self.out("exr", "--formats", "exr,raw")
        bare = {}
        for name in CHANNELS:
            array = np.fromfile(f"{path}/{name}.raw", "<" + DTYPES[name])
            bare[name] = array.reshape(DIMS[::-1])
        try:
            import OpenEXR
        except ImportError:
            return bare
        for k in range(DIMS[2]):
            with OpenEXR.File(f"{path}/slice-{k:04}.exr", separate_channels=True) as slice:
                for name, channel in slice.channels().items():
                    pixels = channel.pixels
                    if name == "occupancy":
                        pixels = pixels.astype("u1")
                    same(pixels, bare[name][k], ("exr", name, k))
        return bare

    def npy(self):
        path = self.out("npy", "--formats", "npy,raw")
        grid = json.load(open(f"{path}/grid.json"))
        for name in CHANNELS:
            same(np.load(f"{path}/{name}.npy"), self.values[name], ("npy", name))
        assert grid["dims"] == list(DIMS) and grid["units"] == "mm"
        for index in marked(self.values):
            place = [o + (n + 0.5) * d for o, n, d in zip(grid["origin"], index, grid["spacing"])]
            assert near(place, centre(index))

    def nrrd(self):
        import nrrd

        for encoding in ("raw", "gzip"):
            path = self.out(f"nrrd-{encoding}", "--formats", "nrrd", "--nrrd-encoding", encoding)
            for name in CHANNELS:
                data, head = nrrd.read(f"{path}/{name}.nrrd", index_order="C")
                same(data, self.values[name], ("nrrd", encoding, name))
                for index in marked(self.values):
                    place = head["space origin"] + np.array(index) @ head["space directions"]
                    assert near(place, centre(index)), (place, centre(index))
                assert head["length_unit"] == "mm" and head["sign_convention"] == "negative-inside"
                self.itk(f"{path}/{name}.nrrd", name)

    def itk(self, file, name):
        import SimpleITK as sitk

        image = sitk.ReadImage(file)
        same(sitk.GetArrayFromImage(image), self.values[name], (file, "SimpleITK"))
        for index in marked(self.values):
            assert near(image.TransformIndexToPhysicalPoint(index), centre(index)), file

    def mhd(self):
        path = self.out("mhd", "--formats", "mhd")
        for name in CHANNELS:
            self.itk(f"{path}/{name}.mhd", name)

    def vtk_image(self, image, points, what):
        from vtk.util.numpy_support import vtk_to_numpy

        data = image.GetPointData() if points else image.GetCellData()
        assert data.GetNumberOfArrays() == len(CHANNELS), what
        for name in CHANNELS:
            array = vtk_to_numpy(data.GetArray(name)).reshape(DIMS[::-1])
            same(array, self.values[name], (what, name))
        for i, j, k in marked(self.values):
            number = i + DIMS[0] * (j + DIMS[1] * k)
            if points:
                place = image.GetPoint(number)
            else:
                bounds = image.GetCell(number).GetBounds()
                place = [(a + b) / 2 for a, b in zip(bounds[::2], bounds[1::2])]
            assert near(place, centre((i, j, k))), (what, place, centre((i, j, k)))

    def vti(self):
        import vtk

        for encoding in ("raw", "zlib", "base64"):
            for points in (False, True):
                flags = ["--formats", "vti", "--vti-encoding", encoding]
                path = self.out(f"vti-{encoding}-{points}", *flags, *(["--vti-points"] * points))
                reader = vtk.vtkXMLImageDataReader()
                reader.SetFileName(f"{path}/marked_solid.vti")
                reader.Update()
                image = reader.GetOutput()
                self.vtk_image(image, points, ("vti", encoding, points))
                units = image.GetFieldData().GetAbstractArray("units")
                assert units.GetValue(0) == "mm"

    def zarr(self):
        import warnings

        import xarray
        import zarr

        for codec in ("none", "zstd"):
            path = self.out(f"zarr-{codec}", "--formats", "zarr", "--zarr-codec", codec)
            path = f"{path}/marked_solid.zarr"
            group = zarr.open_group(path, mode="r")
            for name in CHANNELS:
                same(group[name][:], self.values[name], ("zarr", codec, name))
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                data = xarray.open_zarr(path)
            assert data.attrs["units"] == "mm"
            for name in CHANNELS:
                assert data[name].dims == ("z", "y", "x")
                same(data[name].values, self.values[name], ("xarray", codec, name))
            for i, j, k in marked(self.values):
                place = [float(data[axis][n]) for axis, n in zip("xyz", (i, j, k))]
                assert place == centre((i, j, k)), (place, centre((i, j, k)))

    def h5(self):
        import h5py
        import vtk

        path = self.out("h5", "--formats", "h5") + "/marked_solid.h5"
        with h5py.File(path) as file:
            for name in CHANNELS:
                same(file[name][:], self.values[name], ("h5", name))
                assert file["VTKHDF/CellData"][name] == file[name]
            for index in marked(self.values):
                place = [float(file[axis][n]) for axis, n in zip("xyz", index)]
                assert place == centre(index)
            text = lambda value: value.decode() if isinstance(value, bytes) else value
            assert text(file.attrs["units"]) == "mm"
            assert list(file.attrs["origin"]) == list(ORIGIN)
        reader = vtk.vtkHDFReader()
        reader.SetFileName(path)
        reader.Update()
        self.vtk_image(reader.GetOutput(), False, "VTKHDF")
        if shutil.which("h5dump"):
            check = subprocess.run(["h5dump", "-H", path], capture_output=True, text=True)
            assert check.returncode == 0 and "sdf" in check.stdout, check.stderr

    def vdb(self):
        try:
            import pyopenvdb as vdb
        except ImportError:
            import openvdb as vdb

        path = self.out("vdb", "--formats", "vdb") + "/marked_solid.vdb"
        grids = {grid.name: grid for grid in vdb.readAll(path)[0]}
        assert sorted(grids) == ["density", "surface"], grids
        width = np.float32(3 * max(SPACING))
        surface, density = grids["surface"], grids["density"]
        assert surface["class"] == "level set" and density["class"] == "fog volume"
        assert np.float32(surface.background) == width and density.background == 0
        sdf, fraction = (self.values[name] for name in ("sdf", "fraction"))
        wanted = {
            "surface": (np.where(np.abs(sdf) < width, sdf, np.sign(sdf) * width), np.abs(sdf) < width),
            "density": (fraction, fraction > 0),
        }
        beyond = [n + 8 for n in DIMS]
        for name, (values, active) in wanted.items():
            grid = grids[name]
            outside = np.float32(grid.background)
            full = np.full(beyond, outside, "f4")
            full[: DIMS[0], : DIMS[1], : DIMS[2]] = values.transpose(2, 1, 0)
            found = np.zeros(beyond, "f4")
            grid.copyToArray(found)
            same(found, full, ("vdb", name))
            assert grid.activeVoxelCount() == int(active.sum()), (name, grid.activeVoxelCount())
            at = np.argwhere(active.transpose(2, 1, 0))
            low, high = grid.evalActiveVoxelBoundingBox()
            assert tuple(low) == tuple(at.min(0)) and tuple(high) == tuple(at.max(0))
            assert tuple(grid["file_bbox_min"]) == tuple(low)
            assert grid["file_voxel_count"] == grid.activeVoxelCount()
            for index in marked(self.values):
                assert near(grid.transform.indexToWorld(index), centre(index))
            reader = grid.getConstAccessor()
            for i, j, k in marked(self.values) + [tuple(map(int, at[0])), tuple(map(int, at[-1]))]:
                assert reader.probeValue((i, j, k))[1] == bool(active[k, j, i])
        if shutil.which("vdb_print"):
            shown = subprocess.run(["vdb_print", "-l", path], capture_output=True, text=True)
            assert shown.returncode == 0 and "surface" in shown.stdout, shown.stderr

    def faces(self):
        """Shares of sides: one more along their axis, the first at the corner of the grid."""
        import h5py
        import nrrd
        import SimpleITK as sitk
        import vtk
        import xarray
        from vtk.util.numpy_support import vtk_to_numpy

        names = ["face-x", "face-y", "face-z"]
        channels = ["--channels", ",".join(names)]
        path = self.out("faces", "--formats", "npy,nrrd,mhd,raw,zarr,h5,vti,exr", *channels)
        packed = self.out(
            "packed", "--formats", "nrrd,zarr", "--nrrd-encoding", "gzip", "--zarr-codec", "zstd", *channels
        )
        # A grid that is larger has the last sides as lower ones of other voxels.
        larger = [n + 1 for n in DIMS]
        wide = self.out("wide", "--formats", "npy", "--set", f"grid.dims={larger}", *channels)
        hdf = h5py.File(f"{path}/marked_solid.h5")
        reader = vtk.vtkXMLImageDataReader()
        reader.SetFileName(f"{path}/marked_solid.vti")
        reader.Update()
        for axis, name in enumerate(names):
            dims = [n + (a == axis) for a, n in enumerate(DIMS)]
            values = np.load(f"{path}/{name}.npy")
            assert values.shape == tuple(reversed(dims)) and values.dtype == "f4"
            assert 0 < values.mean() < 1
            found = np.load(f"{wide}/{name}.npy")[: dims[2], : dims[1], : dims[0]]
            assert np.abs(found - values).max() <= 1e-7, np.abs(found - values).max()
            first = [o + (a != axis) * d / 2 for a, (o, d) in enumerate(zip(ORIGIN, SPACING))]
            raw = np.fromfile(f"{path}/{name}.raw", "<f4").reshape(values.shape)
            same(raw, values, ("raw", name))
            for folder in (path, packed):
                data, head = nrrd.read(f"{folder}/{name}.nrrd", index_order="C")
                same(data, values, ("nrrd", folder, name))
                assert near(head["space origin"], first)
                data = xarray.open_zarr(f"{folder}/marked_solid.zarr")[name]
                same(data.values, values, ("zarr", folder, name))
                wanted = ["z", "y", "x"]
                wanted[2 - axis] += "_face"
                assert list(data.dims) == wanted
                ends = [float(data[dim][0]) for dim in reversed(wanted)]
                assert near(ends, first)
            image = sitk.ReadImage(f"{path}/{name}.mhd")
            same(sitk.GetArrayFromImage(image), values, ("mhd", name))
            assert near(image.GetOrigin(), first)
            same(hdf[name][:], values, ("h5", name))
            assert near(hdf[name].attrs["first"], first)
            lower = values[: DIMS[2], : DIMS[1], : DIMS[0]]
            same(hdf["VTKHDF/CellData"][name][:], lower, ("VTKHDF", name))
            array = reader.GetOutput().GetCellData().GetArray(name)
            same(vtk_to_numpy(array).reshape(DIMS[::-1]), lower, ("vti", name))


if __name__ == "__main__":
    VOXLATHE = os.path.abspath(sys.argv[1])
    wanted = sys.argv[2:] or ["npy", "nrrd", "mhd", "vti", "zarr", "h5", "faces", "vdb"]
    with tempfile.TemporaryDirectory() as place:
        checks = Checks(place)
        for name in wanted:
            getattr(checks, name)()
            print(f"{name}: every value and place as written")
