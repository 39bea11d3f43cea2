"""Readers of volumes: NIfTI and DICOM by optional packages, and MetaImage."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arguments import Reals
from ..extras import extra
from .images import LARGEST

_TYPES = {
    "MET_CHAR": "i1", "MET_UCHAR": "u1", "MET_SHORT": "i2", "MET_USHORT": "u2", "MET_INT": "i4", "MET_UINT": "u4",
    "MET_FLOAT": "f4", "MET_DOUBLE": "f8",
}  # fmt: skip
_HEADER = 65536
"""Bytes that a header has at most."""


@dataclass(frozen=True, eq=False)
class Volume:
    """A volume and the distances of its voxels.

    Attributes
    ----------
    voxels : array
        In the order of axes of the file: of NIfTI and MetaImage x, y, z, of DICOM rows and columns.
    spacing : array, (axes,)
        Millimetres between voxels along the axes.
    """

    voxels: NDArray[Any]
    spacing: Reals


def read_volume(path: str | Path) -> Volume:
    """Read a volume from a file: .nii, .nii.gz, .mha, .mhd or .dcm.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If the format is unknown, or the file is damaged or too large.
    ImportError
        If the package for the format is not installed.
    """
    source = Path(path)
    name = source.name.lower()
    if not source.is_file():
        raise FileNotFoundError(f"{source}: no such file")
    if name.endswith((".mha", ".mhd")):
        return _read_meta_image(source)
    if name.endswith((".nii", ".nii.gz")):
        return _read_nifti(source)
    if name.endswith(".dcm"):
        return _read_dicom(source)
    raise ValueError(f"{source}: unknown format; expected .nii, .nii.gz, .mha, .mhd or .dcm")


def _read_meta_image(source: Path) -> Volume:
    content = source.read_bytes()
    marker = content[:_HEADER].find(b"ElementDataFile")
    if marker < 0:
        raise ValueError(f"{source}: no ElementDataFile in the header; expected a MetaImage")
    end = content.find(b"\n", marker) + 1 or len(content)
    rows = (line.partition("=") for line in content[:end].decode("latin-1").splitlines())
    fields = {key.strip(): value.strip() for key, _, value in rows}
    try:
        shape = tuple(int(n) for n in fields["DimSize"].split())
        kind = np.dtype(_TYPES[fields["ElementType"]])
    except (KeyError, ValueError) as error:
        raise ValueError(f"{source}: DimSize or ElementType is missing or unknown ({error})") from None
    if int(fields.get("ElementNumberOfChannels", "1")) != 1:
        raise ValueError(f"{source}: {fields['ElementNumberOfChannels']} channels; expected 1")
    _check_size(source, shape)
    if fields.get("BinaryDataByteOrderMSB", fields.get("ElementByteOrderMSB", "False")).lower() == "true":
        kind = kind.newbyteorder(">")
    place = fields["ElementDataFile"]
    data = content[end:] if place == "LOCAL" else (source.parent / Path(place).name).read_bytes()
    expected = int(np.prod(shape)) * kind.itemsize
    if fields.get("CompressedData", "False").lower() == "true":
        try:
            data = zlib.decompressobj().decompress(data, expected + 1)
        except zlib.error as error:
            raise ValueError(f"{source}: damaged data ({error})") from None
    if len(data) < expected:
        raise ValueError(f"{source}: {len(data)} bytes of data; expected {expected} for {shape} of {kind}")
    voxels = np.frombuffer(data, kind, int(np.prod(shape))).reshape(shape, order="F")
    sizes = fields.get("ElementSpacing", fields.get("ElementSize", " ".join("1" for _ in shape)))
    return Volume(voxels.astype(kind.newbyteorder("=")), np.array([float(s) for s in sizes.split()]))


def _read_nifti(source: Path) -> Volume:
    with extra("volumes", "reading NIfTI files"):
        import nibabel
    try:
        image: Any = nibabel.load(source)
        _check_size(source, image.shape)
        voxels = np.asanyarray(image.dataobj)
        spacing = np.array(image.header.get_zooms()[: voxels.ndim], float)
    except (nibabel.filebasedimages.ImageFileError, EOFError, zlib.error) as error:
        raise ValueError(f"{source}: not a NIfTI file ({error})") from None
    return Volume(voxels, spacing)


def _read_dicom(source: Path) -> Volume:
    with extra("volumes", "reading DICOM files"):
        import pydicom
    try:
        found = pydicom.dcmread(source)
        voxels = np.asarray(found.pixel_array)
    except (pydicom.errors.InvalidDicomError, AttributeError) as error:
        raise ValueError(f"{source}: not a DICOM image ({error})") from None
    _check_size(source, voxels.shape)
    scaled = voxels * float(found.get("RescaleSlope", 1)) + float(found.get("RescaleIntercept", 0))
    inner = [float(s) for s in found.get("PixelSpacing", [1, 1])]
    return Volume(scaled, np.array(([float(found.get("SliceThickness", 1) or 1)] if voxels.ndim == 3 else []) + inner))


def _check_size(source: Path, shape: tuple[int, ...]) -> None:
    count = int(np.prod(shape, dtype=object))
    if count > LARGEST:
        raise ValueError(f"{source}: shape {tuple(shape)}, {count:,} voxels; expected at most {LARGEST:,}")
