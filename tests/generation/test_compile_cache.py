"""Entries on disk: incomplete files are ignored, concurrent writers are safe, and the size has a limit."""

from __future__ import annotations

import multiprocessing
import os
import stat
from pathlib import Path

import pytest
from worker_tasks import write_and_read

from gacompiler.errors import BackendError
from gacompiler.generation.cache import Cache, key_of, open_cache, size_limit

KEY, OTHER = key_of("one"), key_of("other")
VALUE = {"text": "a π", "numbers": [1, -2, 10**40], "nothing": None}


@pytest.fixture
def cache(tmp_path: Path) -> Cache:
    return Cache(tmp_path)


def test_stored_entries_are_found(cache: Cache) -> None:
    assert cache.get(KEY) is None
    cache.put(KEY, VALUE)
    assert cache.get(KEY) == VALUE and cache.get(OTHER) is None
    cache.put(KEY, [1])
    assert cache.get(KEY) == [1]
    assert [path.name for path in cache.folder.iterdir()] == [KEY]
    assert stat.S_IMODE((cache.folder / KEY).stat().st_mode) == 0o600


def test_keys_depend_on_every_part_and_its_length() -> None:
    assert len({key_of("ab", "c"), key_of("a", "bc"), key_of("abc"), key_of("c", "ab"), key_of("ab", "c", "")}) == 5


def test_a_truncated_file_is_ignored(cache: Cache) -> None:
    cache.put(KEY, VALUE)
    path = cache.folder / KEY
    content = path.read_bytes()
    for length in range(len(content)):
        path.write_bytes(content[:length])
        assert cache.get(KEY) is None, length
    path.write_bytes(content + b"\0")
    assert cache.get(KEY) is None
    cache.put(KEY, VALUE)
    assert cache.get(KEY) == VALUE


def test_entries_with_a_changed_byte_are_ignored(cache: Cache) -> None:
    cache.put(KEY, VALUE)
    path = cache.folder / KEY
    content = path.read_bytes()
    for place in range(len(content)):
        path.write_bytes(content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :])
        assert cache.get(KEY) is None, place


def test_an_entry_under_another_key_is_ignored(cache: Cache) -> None:
    cache.put(KEY, VALUE)
    os.rename(cache.folder / KEY, cache.folder / OTHER)
    assert cache.get(OTHER) is None


def test_a_folder_is_not_an_entry(cache: Cache) -> None:
    (cache.folder / KEY).mkdir()
    assert cache.get(KEY) is None
    cache.put(KEY, VALUE)
    assert cache.get(KEY) is None and [path.name for path in cache.folder.iterdir()] == [KEY]


def test_a_folder_that_cannot_be_written_has_no_entries(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "absent", tmp_path / "file"):
        cache = Cache(folder)
        cache.put(KEY, VALUE)
        cache.prune()
        assert cache.get(KEY) is None
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def entries_of_equal_size(cache: Cache, n: int) -> tuple[list[str], int]:
    keys = [key_of(str(k)) for k in range(n)]
    for k, key in enumerate(keys):
        cache.put(key, "value")
        os.utime(cache.folder / key, ns=(10**9 * k, 10**9 * k))
    (size,) = {(cache.folder / key).stat().st_size for key in keys}
    return keys, size


def test_least_recently_used_entries_are_removed(cache: Cache) -> None:
    keys, size = entries_of_equal_size(cache, 6)
    cache.prune()
    assert all(map(cache.get, keys))
    keys, size = entries_of_equal_size(cache, 6)
    assert cache.get(keys[1]) == "value"
    Cache(cache.folder, 3 * size).prune()
    assert [key for key in keys if cache.get(key)] == [keys[1], keys[4], keys[5]]
    Cache(cache.folder, 3 * size - 1).prune()
    assert len(list(cache.folder.iterdir())) == 2
    Cache(cache.folder, 0).prune()
    assert list(cache.folder.iterdir()) == []


def test_the_first_entry_of_a_process_removes_what_is_beyond_the_limit(cache: Cache) -> None:
    keys, size = entries_of_equal_size(cache, 4)
    limited = Cache(cache.folder, 2 * size)
    limited.put(OTHER, "value")
    assert [key for key in keys if cache.get(key)] == keys[3:]
    assert cache.get(OTHER) == "value"


def test_temporary_files_left_by_writers_are_removed(cache: Cache) -> None:
    (cache.folder / ".abandoned").write_bytes(b"x" * 1000)
    os.utime(cache.folder / ".abandoned", ns=(0, 0))
    cache.put(KEY, VALUE)
    Cache(cache.folder, 999).prune()
    assert [path.name for path in cache.folder.iterdir()] == [KEY]


def test_processes_write_concurrently(cache: Cache) -> None:
    small = Cache(cache.folder, 2_000)
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        assert pool.starmap(write_and_read, [(small, number) for number in range(2)]) == [[], []]
    names = {path.name for path in cache.folder.iterdir()}
    assert names and names <= {key_of(str(k)) for k in range(5)}, "no temporary file is left"


def test_the_limit_is_a_number_of_megabytes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("GAC_CACHE", str(tmp_path / "own"))
    monkeypatch.delenv("GAC_CACHE_SIZE", raising=False)
    assert size_limit() == 256_000_000
    monkeypatch.setenv("GAC_CACHE_SIZE", "3")
    assert open_cache() == Cache(tmp_path / "own" / "compilations", 3_000_000)
    monkeypatch.setenv("GAC_CACHE_SIZE", "0")
    assert open_cache() is None
    for wrong in ("many", "-1", "1.5"):
        monkeypatch.setenv("GAC_CACHE_SIZE", wrong)
        with pytest.raises(BackendError, match=r"GAC_CACHE_SIZE.*a number of megabytes"):
            open_cache()
