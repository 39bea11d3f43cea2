"""A small spec, the command that packages it, and environments with numpy alone."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from click.testing import CliRunner, Result

from gacompiler.cli import main

SPEC = '''"""Motions of points, and sums."""

from gacompiler import SCALAR, array, kernel, sandwich, total
from gacompiler.algebra.catalog import PGA3


@kernel(m=PGA3.MOTOR, p=PGA3.POINT)
def move_point(m, p):
    """Move the point `p` by the unit motor `m`: ``m p ~m``."""
    return sandwich(m, p)


@kernel(x=array(SCALAR, "n"))
def squares(x):
    """The sum of squares."""
    return total(lambda v: v * v, x)
'''


def package(*arguments: str | Path) -> Result:
    """Run ``gac package`` with these arguments."""
    return CliRunner().invoke(main, ["package", *map(str, arguments)])


def packaged(*arguments: str | Path, output: Path) -> Path:
    """The wheel that ``gac package`` writes into an empty folder."""
    done = package(*arguments, "-o", output)
    assert done.exit_code == 0, done.output
    (wheel,) = output.glob("*.whl")
    return wheel


class Environment:
    """A virtual environment with numpy and the wheels installed into it.

    Nothing is downloaded: numpy is that of the environment that runs the tests.
    """

    def __init__(self, folder: Path) -> None:
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
        self.folder = folder
        self.python = folder / "bin" / "python"
        (self.site,) = folder.glob("lib/python3*/site-packages")
        own = Path(np.__file__).parents[1]
        for path in (*own.glob("numpy"), *own.glob("numpy.libs"), *own.glob("numpy-*.dist-info")):
            (self.site / path.name).symlink_to(path)

    def install(self, *wheels: Path, alone: bool = False) -> None:
        """Install wheels, of which few files are run; unless `alone`, their dependencies must already be present."""
        pip = [sys.executable, "-m", "pip", "--isolated", "--python", str(self.python)]
        known = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}  # pip would look there.
        done = subprocess.run(
            [*pip, "install", "--no-index", "--no-compile", *["--no-deps"] * alone, *map(str, wheels)],
            capture_output=True,
            text=True,
            env=known,
        )
        assert done.returncode == 0, done.stderr

    def run(self, code: str, path: str = "", **variables: str) -> subprocess.CompletedProcess[str]:
        """Run Python with `path` as the only PATH and with empty caches."""
        known = {"PATH": path, "HOME": str(self.folder), "GAC_CACHE": str(self.folder / "cache"), **variables}
        command = [str(self.python), "-I", "-c", code]
        return subprocess.run(command, capture_output=True, text=True, env=known, cwd=self.folder)

    def output(self, code: str, path: str = "", **variables: str) -> str:
        """The output of Python, which must run without errors and warnings."""
        done = self.run(code, path, **variables)
        assert (done.returncode, done.stderr) == (0, ""), done.stderr
        return done.stdout


def compilers() -> str:
    """The PATH of this process, which includes compilers."""
    return os.environ["PATH"]
