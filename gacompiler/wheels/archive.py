"""Read and write wheel files reproducibly: the bytes depend only on the contents."""

from __future__ import annotations

import os
import stat
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipInfo

from packaging.utils import InvalidWheelFilename, parse_wheel_filename
from wheel.wheelfile import MINIMUM_TIMESTAMP, WheelError, WheelFile

from .. import __version__
from ..errors import BackendError

_MODE = stat.S_IFREG | 0o644


class _ReproducibleWheel(WheelFile):  # type: ignore[misc]
    """A wheel written with the same date and mode for all files.

    The date is SOURCE_DATE_EPOCH, or by default the earliest date that an archive can store.
    """

    def writestr(self, zinfo_or_arcname: Any, data: Any, compress_type: int | None = None) -> None:
        date = max(int(os.environ.get("SOURCE_DATE_EPOCH", 0)), MINIMUM_TIMESTAMP)
        info = ZipInfo(zinfo_or_arcname, time.gmtime(date)[:6])
        info.compress_type = self.compression
        info.external_attr = _MODE << 16
        super().writestr(info, data, compress_type)


def wheel_name(distribution: str, version: str, platform: str) -> str:
    """Return the file name of a wheel for every Python 3 and a platform, which may be ``any``."""
    return f"{distribution}-{version}-py3-none-{platform}.whl"


def wheel_text(platform: str) -> str:
    """Return the text of the file ``WHEEL``, which specifies the platform of the wheel."""
    pure = "true" if platform == "any" else "false"
    return (
        f"Wheel-Version: 1.0\nGenerator: gacompiler ({__version__})\nRoot-Is-Purelib: {pure}\n"
        f"Tag: py3-none-{platform}\n"
    )


def read_wheel(path: Path) -> tuple[str, str, dict[str, bytes]]:
    """Return the distribution name, the version and the files, without RECORD, of a platform-independent wheel.

    Raises
    ------
    BackendError
        If the wheel cannot be read, a file does not match its entry in RECORD, or the wheel is for one platform only.
    """
    expected = "a wheel for every platform, ...-py3-none-any.whl"
    try:
        tags = parse_wheel_filename(path.name)[3]
        if {str(tag) for tag in tags} != {"py3-none-any"}:
            raise BackendError(str(path), "a wheel for some machines or versions of Python only", expected)
        with WheelFile(path) as archive:
            distribution, version = archive.parsed_filename["name"], archive.parsed_filename["ver"]
            names = [name for name in archive.namelist() if name != archive.record_path and not name.endswith("/")]
            return distribution, version, {name: archive.read(name) for name in names}
    except (InvalidWheelFilename, WheelError, BadZipFile, OSError) as error:
        raise BackendError(str(path), str(error), expected) from error


def wheel_bytes(name: str, files: Mapping[str, bytes]) -> bytes:
    """Return the contents of a wheel. RECORD is added, and the metadata are stored last.

    Parameters
    ----------
    name : str
        The file name, as returned by `wheel_name`.
    files : mapping of str to bytes
        The files by their paths in the wheel. ``NAME-VERSION.dist-info`` contains METADATA and WHEEL.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        with _ReproducibleWheel(path, "w") as archive:
            for each in sorted(files, key=lambda each: (".dist-info/" in each, each)):
                archive.writestr(each, files[each])
        return path.read_bytes()
