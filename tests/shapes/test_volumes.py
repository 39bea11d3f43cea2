"""Readers of volumes."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
import pytest

from algorithms.shapes.volumes import read_volume

HEADER = "ObjectType = Image\nNDims = 3\nDimSize = {size}\nElementType = MET_SHORT\nElementSpacing = 1.5 2 3\n"


@pytest.mark.parametrize("compressed", [False, True])
def test_meta_image(tmp_path: Path, compressed: bool) -> None:
    voxels = np.arange(24, dtype=np.int16).reshape(2, 3, 4) - 7
    data = voxels.tobytes(order="F")
    head = HEADER.format(size="2 3 4") + f"CompressedData = {compressed}\nElementDataFile = LOCAL\n"
    path = tmp_path / "a.mha"
    path.write_bytes(head.encode() + (zlib.compress(data) if compressed else data))
    found = read_volume(path)
    assert np.array_equal(found.voxels, voxels) and found.voxels.dtype == np.int16
    assert found.spacing.tolist() == [1.5, 2, 3]
    path.write_bytes(head.encode() + data[:10] if not compressed else head.encode() + b"abc")
    with pytest.raises(ValueError, match=r"bytes of data|damaged"):
        read_volume(path)


def test_nifti(tmp_path: Path) -> None:
    nibabel = pytest.importorskip("nibabel")
    voxels = np.arange(24, dtype=np.int16).reshape(2, 3, 4)
    path = tmp_path / "a.nii.gz"
    nibabel.save(nibabel.Nifti1Image(voxels, np.diag([1.5, 2, 3, 1])), path)
    found = read_volume(path)
    assert np.array_equal(found.voxels, voxels) and np.allclose(found.spacing, [1.5, 2, 3])


@pytest.mark.parametrize("frames", [1, 4])
def test_dicom(tmp_path: Path, frames: int) -> None:
    pydicom = pytest.importorskip("pydicom")
    voxels = np.arange(frames * 6, dtype=np.int16).reshape(frames, 2, 3) - 5
    meta = pydicom.dataset.FileMetaDataset()
    meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
    meta.MediaStorageSOPClassUID = pydicom.uid.CTImageStorage
    meta.MediaStorageSOPInstanceUID = pydicom.uid.generate_uid()
    image = pydicom.Dataset()
    image.file_meta = meta
    image.SOPClassUID, image.SOPInstanceUID = meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID
    image.Rows, image.Columns, image.NumberOfFrames = 2, 3, frames
    image.SamplesPerPixel, image.PhotometricInterpretation = 1, "MONOCHROME2"
    image.BitsAllocated, image.BitsStored, image.HighBit, image.PixelRepresentation = 16, 16, 15, 1
    image.PixelSpacing, image.SliceThickness = [0.5, 0.75], 2.5
    image.RescaleSlope, image.RescaleIntercept = 2, -1000
    image.PixelData = voxels.tobytes()
    path = tmp_path / "a.dcm"
    image.save_as(path, enforce_file_format=True)
    found = read_volume(path)
    np.testing.assert_array_equal(found.voxels, 2.0 * np.squeeze(voxels, 0 if frames == 1 else ()) - 1000)
    assert found.spacing.tolist() == ([0.5, 0.75] if frames == 1 else [2.5, 0.5, 0.75])
    path.write_bytes(b"nothing")
    with pytest.raises(ValueError, match="not a DICOM image"):
        read_volume(path)


def test_unreadable_files(tmp_path: Path) -> None:
    path = tmp_path / "a.mha"
    with pytest.raises(FileNotFoundError, match="no such file"):
        read_volume(path)
    path.write_bytes(b"nothing")
    with pytest.raises(ValueError, match="ElementDataFile"):
        read_volume(path)
    path.write_text(HEADER.format(size="9999 9999 9999") + "ElementDataFile = LOCAL\n")
    with pytest.raises(ValueError, match="999,700,029,999 voxels"):
        read_volume(path)
    other = tmp_path / "a.xyz"
    other.write_bytes(b"")
    with pytest.raises(ValueError, match="unknown format"):
        read_volume(other)
