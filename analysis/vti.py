"""Reader of what `cohort run --export vtk` writes: VTK XML ImageData with cell data, appended raw, compressed by zlib.

VTK XML file formats, https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html
"""

import dataclasses
import os
import pathlib
import xml.etree.ElementTree
import zlib

import numpy

TYPES = {"Float32": "<f4", "UInt8": "u1"}
HIDDEN = 32  # vtkGhostType of cells without tissue


@dataclasses.dataclass(frozen=True)
class Image:
    """Fields on a box of cells."""

    cells: tuple  # along x, y, z
    origin_mm: numpy.ndarray  # (3) corner of the box
    dx_mm: float
    fields: dict  # by name, (nz, ny, nx) or (nz, ny, nx, components)

    @property
    def tissue(self):
        """(nz, ny, nx) bool."""
        return self.fields["vtkGhostType"] != HIDDEN

    def centres(self, axis):
        """Centres of the cells along x, y or z (0, 1, 2), mm."""
        return self.origin_mm[axis] + self.dx_mm * (numpy.arange(self.cells[axis]) + 0.5)


def _decompressed(data, offset):
    blocks, size, last = numpy.frombuffer(data, "<u8", 3, offset)
    sizes = numpy.frombuffer(data, "<u8", int(blocks), offset + 24)
    place = offset + 24 + 8 * int(blocks)
    parts = []
    for compressed in sizes:
        parts.append(zlib.decompress(data[place:place + int(compressed)]))
        place += int(compressed)
    expected = [int(size)] * (len(parts) - 1) + [int(last) or int(size)] if parts else []
    if [len(part) for part in parts] != expected:
        raise ValueError("blocks differ from their header")
    return b"".join(parts)


def read(path):
    """Image of a .vti file. Raises OSError where it is missing, ValueError where it is something else."""
    data = pathlib.Path(path).read_bytes()
    mark = data.find(b'<AppendedData encoding="raw">')
    if mark < 0:
        raise ValueError(f"{os.fspath(path)}: no ImageData with raw appended data")
    root = xml.etree.ElementTree.fromstring(data[:mark] + b"</VTKFile>")
    image = root.find("ImageData")
    if image is None or root.get("header_type") != "UInt64" or root.get("compressor") != "vtkZLibDataCompressor":
        raise ValueError(f"{os.fspath(path)}: not as Cohort writes it")
    extent = [int(word) for word in image.get("WholeExtent").split()]
    cells = tuple(extent[1::2])
    shape = cells[::-1]
    first = data.index(b"_", mark) + 1
    fields = {}
    for array in image.iter("DataArray"):
        values = numpy.frombuffer(_decompressed(data, first + int(array.get("offset"))), TYPES[array.get("type")])
        components = int(array.get("NumberOfComponents"))
        fields[array.get("Name")] = values.reshape(shape if components == 1 else (*shape, components))
    spacing = [float(word) for word in image.get("Spacing").split()]
    return Image(cells, numpy.array([float(word) for word in image.get("Origin").split()]), spacing[0], fields)


def series(path):
    """[(time in ms, path)] of a .pvd collection."""
    path = pathlib.Path(path)
    root = xml.etree.ElementTree.parse(path).getroot()
    return [(float(entry.get("timestep")), path.parent / entry.get("file")) for entry in root.iter("DataSet")]
