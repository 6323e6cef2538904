"""Whatever is wrong with a log, the answer is one line that names the file and says what would be valid."""

import errno

import numpy as np
import pytest
from tests.damaged import BAD_SAMPLING, DAMAGED, main_file
from tests.log.readers.formats import WRITERS, StubRobot, synthetic_log, write_parquet

from stribeck.errors import LogError
from stribeck.log.readers import read_log
from stribeck.log.sampling import regularise


def check_message(error, path, words):
    message = str(error)
    assert len(message.splitlines()) == 1
    assert len(message) < 700
    assert message.startswith(str(path))
    for word in words:
        assert word in message


@pytest.mark.parametrize(("maker", "words"), [case[1:] for case in DAMAGED], ids=[case[0] for case in DAMAGED])
def test_a_damaged_log_is_refused_in_one_sentence(maker, words, tmp_path):
    path = maker(tmp_path)
    with pytest.raises(LogError) as caught:
        read_log(path, StubRobot())
    check_message(caught.value, path, words)


@pytest.mark.parametrize(
    ("maker", "words"), [case[1:] for case in BAD_SAMPLING], ids=[case[0] for case in BAD_SAMPLING]
)
def test_a_log_that_cannot_be_made_regular_is_refused_in_one_sentence(maker, words, tmp_path):
    path = maker(tmp_path)
    log = read_log(path, StubRobot())
    with pytest.raises(LogError) as caught:
        regularise(log, StubRobot().log_table)
    check_message(caught.value, path, words)


@pytest.mark.parametrize("writer", WRITERS.values(), ids=WRITERS)
def test_flipped_bytes_never_give_anything_but_a_log_or_a_log_error(writer, tmp_path):
    path = writer(tmp_path, synthetic_log(20))
    file = main_file(path)
    content = file.read_bytes()
    rng = np.random.default_rng(1)
    for _ in range(25):
        damaged = bytearray(content)
        for place in rng.integers(0, len(content), 8):
            damaged[place] = rng.integers(0, 256)
        file.write_bytes(damaged)
        try:
            read_log(path, StubRobot())
        except LogError as error:
            check_message(error, path, [])


def test_a_disk_without_room_is_told_as_such(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    path = write_parquet(tmp_path, synthetic_log(20))
    monkeypatch.setattr("stribeck.log.storage.IN_MEMORY_LIMIT", 100)
    monkeypatch.setattr("stribeck.log.storage.os.posix_fallocate", full)
    with pytest.raises(LogError, match=r"too large.*TMPDIR") as caught:
        read_log(path, StubRobot())
    check_message(caught.value, path, [])


def test_a_path_that_cannot_be_one_is_refused():
    with pytest.raises(LogError, match="no such file"):
        read_log("a\0b.npz")
