"""The folder of compiled code is used only if no other user can write to it."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest

import gacompiler.cache_folder as module
from gacompiler import SCALAR, kernel
from gacompiler.cache_folder import cache_folder, cache_part, lasting_folder
from gacompiler.errors import BackendError
from gacompiler.generation.cache import open_cache
from gacompiler.runtime import compile as compiled

pytestmark = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="file modes have no effect on this system")


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty home folder and a separate folder for temporary files."""
    for name in ("GAC_CACHE", "GAC_CACHE_SIZE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    module._temporary_folder.cache_clear()
    yield tmp_path / "home"
    module._temporary_folder.cache_clear()
    (tmp_path / "home").chmod(0o700)


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def test_it_is_created_for_the_user_only(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert cache_folder() == lasting_folder() == home / ".cache" / "gacompiler"
    assert mode(cache_folder()) == mode(cache_part("objects")) == 0o700
    assert cache_part("objects") == cache_folder() / "objects"
    monkeypatch.setenv("XDG_CACHE_HOME", "caches")
    assert cache_folder() == home / ".cache" / "gacompiler", "relative paths are ignored, as its specification says"
    monkeypatch.setenv("XDG_CACHE_HOME", str(home / "caches"))
    assert cache_folder() == home / "caches" / "gacompiler"
    monkeypatch.setenv("GAC_CACHE", str(home / "a" / "b"))
    assert cache_folder() == home / "a" / "b" and mode(home / "a" / "b") == 0o700


@pytest.mark.parametrize("wrong", [0o770, 0o720, 0o707, 0o702, 0o777, 0o1777])
def test_a_folder_that_others_can_write_is_rejected(wrong: int, home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = home / "chosen"
    chosen.mkdir(parents=True)
    monkeypatch.setenv("GAC_CACHE", str(chosen))
    chosen.chmod(wrong)
    for use in (cache_folder, lasting_folder, open_cache, lambda: cache_part("modules")):
        with pytest.raises(BackendError, match=f"chosen: others may write to it.*{wrong:o}.*GAC_CACHE.*chmod 700"):
            use()
    assert list(chosen.iterdir()) == []
    chosen.chmod(0o755)
    assert cache_folder() == chosen, "other users may read it"


def test_a_folder_of_another_user_is_rejected(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (home / "chosen").mkdir(parents=True)
    monkeypatch.setenv("GAC_CACHE", str(home / "chosen"))
    monkeypatch.setattr(os, "geteuid", lambda: (home / "chosen").stat().st_uid + 1)
    with pytest.raises(BackendError, match=r"chosen: it belongs to another user.*set GAC_CACHE to another"):
        cache_folder()


def test_a_folder_that_anyone_can_replace_is_rejected(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (home / "open" / "inner").mkdir(parents=True)
    (home / "link").symlink_to(home / "open" / "inner")
    (home / "open").chmod(0o777)
    for chosen in (home / "open" / "inner" / "chosen", home / "link", home / "link" / "chosen"):
        monkeypatch.setenv("GAC_CACHE", str(chosen))
        with pytest.raises(BackendError, match=r"anyone may write to .*open;"):
            cache_folder()
    (home / "open").chmod(0o1777)  # like /tmp: files in it can only be replaced by their owner
    assert cache_folder() == home / "link" / "chosen"


def test_a_folder_that_is_a_file_is_rejected(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    home.mkdir()
    (home / "chosen").write_text("")
    monkeypatch.setenv("GAC_CACHE", str(home / "chosen"))
    with pytest.raises(BackendError, match="chosen: it cannot be used: File exists"):
        cache_folder()


def test_a_subfolder_that_others_can_write_is_rejected(home: Path) -> None:
    cache_part("objects").chmod(0o777)
    with pytest.raises(BackendError, match="objects: others may write to it"):
        cache_part("objects")


@kernel(a=SCALAR, b=SCALAR)
def product_of_numbers(a, b):  # type: ignore[no-untyped-def]
    """Multiply."""
    return a * b


@pytest.mark.parametrize("trouble", ["read-only", "taken", "open to others", "no home"])
def test_without_a_folder_nothing_is_cached_and_everything_works(
    trouble: str, home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A read-only or missing home folder is not an error; files are in one temporary folder of the process."""
    home.mkdir()
    if trouble == "read-only":
        home.chmod(0o500)
        # the superuser can write to every folder
        real = os.access
        monkeypatch.setattr(os, "access", lambda path, how: home not in Path(path).parents and real(path, how))
    elif trouble == "taken":
        (home / ".cache").write_text("")
    elif trouble == "open to others":
        (home / ".cache" / "gacompiler").mkdir(parents=True)
        (home / ".cache" / "gacompiler").chmod(0o777)
    else:
        monkeypatch.setattr(Path, "home", no_home)
    assert lasting_folder() is None and open_cache() is None
    folder = cache_folder()
    assert folder == cache_folder() and folder.parent == home.parent / "temporary" and mode(folder) == 0o700
    monkeypatch.setattr("gacompiler.runtime._compiled", {})
    assert compiled(product_of_numbers, backend="arrays")(2.0, 3.0) == 6.0
    names = {path.name for path in folder.iterdir()}
    assert "modules" in names and names <= {"modules", "_build"}, "_build is created if there is a compiler"


def no_home() -> Path:
    raise RuntimeError("Could not determine home directory.")
