"""The command ``python -m algorithms.shapes``: segment a volume, and write its surface."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from rich.console import Console

from .boundary_meshes import boundary_mesh, write_mesh
from .segmentation import segment
from .volumes import read_volume

_EXAMPLES = """examples:
  python -m algorithms.shapes ct.nii.gz --seed 40 60 15 -o liver.ply
  python -m algorithms.shapes lung.mha --seed 60 80 50 --neck 0 -o lung.obj

Seeds are indices of voxels. Coordinates of the mesh are millimetres from the first voxel.
The exit status is 0 if a mesh was written, and 1 if not."""


def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Parameters
    ----------
    arguments : list of str, optional
        Command-line arguments. By default those of the process.

    Returns
    -------
    int
        The exit status.
    """
    parser = argparse.ArgumentParser(
        prog="python -m algorithms.shapes", description="Segment a volume from a seed, and write its surface.",
        epilog=_EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("volume", type=Path, help=".nii, .nii.gz, .mha, .mhd or .dcm")
    parser.add_argument("--seed", type=int, nargs="+", metavar="I", help="index of a voxel of the region [automatic]")
    parser.add_argument("--neck", type=float, metavar="MM", help="radius of connections that are cut [automatic]")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE", help="mesh: .ply or .obj")
    options = parser.parse_args(arguments)
    console = Console(stderr=True)
    try:
        if options.output.suffix not in (".ply", ".obj"):
            raise ValueError(f"{options.output}: unknown format; expected .ply or .obj")
        if not options.output.parent.is_dir():
            raise ValueError(f"{options.output.parent}: no such folder; expected one to write to")
        with console.status("reading") as status:
            volume = read_volume(options.volume)
            found = segment(volume.voxels, options.seed, volume.spacing, neck=options.neck, progress=status.update)
            mask = found.mask
            if not mask.any():
                raise ValueError(
                    f"seed: {found.seeds.tolist()}: no region grows from it; move it, or pass a smaller neck"
                )
            status.update("writing")
            mesh = boundary_mesh(mask, volume.spacing)
            write_mesh(options.output, mesh)
    except (OSError, TypeError, ValueError, ImportError) as error:
        print(f"shapes: {error}", file=sys.stderr)
        return 1
    volume_of_voxel = float(volume.spacing.prod())
    console.print(f"{found.status.name}, confidence {found.confidence:.2f}")
    console.print(f"{mask.sum():,} voxels, {mask.sum() * volume_of_voxel / 1000:.1f} ml", highlight=False)
    console.print(f"{len(mesh.vertices):,} vertices, {len(mesh.faces):,} faces", highlight=False)
    return 0


if __name__ == "__main__":
    sys.exit(main())
