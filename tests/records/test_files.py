"""Files appear whole or not at all, with the rights that any new file has."""

import threading
from pathlib import Path

import pytest

from stickslip.records.files import is_remains, write_whole, writing


def test_what_fails_on_the_way_leaves_the_old_file_alone(tmp_path: Path):
    path = write_whole(tmp_path / "a" / "film.gif", "old")

    def fail() -> None:
        with writing(path) as file:
            file.write(b"new")
            (left,) = (one.name for one in path.parent.iterdir() if one != path)
            assert is_remains(left, {"film.gif"})
            raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        fail()
    assert path.read_text() == "old"
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_disk_that_is_full_is_told_of_with_the_file_that_did_not_fit(tmp_path: Path):
    def fill() -> None:
        with writing(tmp_path / "walk.csv"), open("/dev/full", "wb", buffering=0) as disk:
            disk.write(b"row")

    with pytest.raises(OSError, match=r"No space left on device: '.*walk\.csv'"):
        fill()
    assert list(tmp_path.iterdir()) == []


def test_of_many_that_do_not_overwrite_one_writes(tmp_path: Path):
    path, refused, start = tmp_path / "one", [], threading.Barrier(8)

    def work(number: int) -> None:
        start.wait()
        try:
            write_whole(path, f"{number}" * 1000, overwrite=False)
        except ValueError as error:
            refused.append(str(error))

    threads = [threading.Thread(target=work, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(refused) == 7
    assert all("exists; accepted: a new path" in words for words in refused)
    assert len(set(path.read_text())) == 1
    assert list(tmp_path.iterdir()) == [path]
