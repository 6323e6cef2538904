"""Errors about damaged logs are one line that names the file and the valid choices."""

import errno
import os
import struct
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from tests.damaged import BAD_SAMPLING, DAMAGED, main_file
from tests.log.readers.formats import WHOLE, WRITERS, StubRobot, columns_of, synthetic_log, write_npz, write_parquet

from stribeck.errors import LogError
from stribeck.log.readers import read_log
from stribeck.log.sampling import regularise
from stribeck.settings import LogTable


def check_message(error, path, words):
    message = str(error)
    assert len(message.splitlines()) == 1
    assert len(message) < 700
    assert message.startswith(str(path))
    for word in words:
        assert word in message


def check_refused(maker, words, folder, robot=None):
    path = maker(folder)
    with pytest.raises(LogError) as caught:
        read_log(path, robot or StubRobot())
    check_message(caught.value, path, words)


@pytest.mark.parametrize(("maker", "words"), [case[1:] for case in DAMAGED], ids=[case[0] for case in DAMAGED])
def test_a_damaged_log_is_refused_in_one_sentence(maker, words, tmp_path):
    check_refused(maker, words, tmp_path)


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


def test_a_full_disk_is_reported(tmp_path, monkeypatch):
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


@pytest.mark.parametrize("writer", WHOLE.values(), ids=WHOLE)
def test_a_file_that_is_nearly_all_a_hole(writer, tmp_path):
    path = writer(tmp_path, synthetic_log(20))
    os.truncate(path, 1 << 40)
    with pytest.raises(
        LogError, match=r"is 1\.1e\+12 bytes long, of which \d+ are on the disk; expected a complete file"
    ):
        read_log(path, StubRobot())


def test_a_line_of_names_without_end(tmp_path):
    (tmp_path / "log.csv").write_bytes(b"time,position.hip" + bytes(1 << 21))
    with pytest.raises(LogError, match="field larger than"):
        read_log(tmp_path / "log.csv", StubRobot())


@pytest.mark.parametrize("reason", [errno.EACCES, errno.EIO])
def test_a_file_that_the_system_cannot_read_is_reported(reason, tmp_path, monkeypatch):
    def refuse(path, *_):
        raise OSError(reason, os.strerror(reason), str(path))

    path = write_parquet(tmp_path, synthetic_log(20))
    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(LogError) as caught:
        read_log(path, StubRobot())
    assert str(caught.value) == f"{path}: cannot be read ({os.strerror(reason)}); expected a readable log"


def test_a_parquet_page_whose_checksum_is_wrong(tmp_path):
    log = synthetic_log(60)
    path = tmp_path / "log.parquet"
    pa.parquet.write_table(
        pa.table(columns_of(log)), path, write_page_checksum=True, compression=None, use_dictionary=False
    )
    content = bytearray(path.read_bytes())
    content[content.index(struct.pack("<d", log.position[30, 1])) + 6] ^= 0x10
    path.write_bytes(content)
    with pytest.raises(LogError, match="CRC"):
        read_log(path, StubRobot())


def test_an_array_whose_name_is_damaged_in_the_directory(tmp_path):
    path = write_npz(tmp_path, synthetic_log(20))
    content = path.read_bytes()
    place = content.rindex(b"time.npy")
    path.write_bytes(content[:place] + b"tine" + content[place + 4 :])
    robot = StubRobot(log_table=LogTable(rate=1000.0))  # which would make up stamps
    with pytest.raises(LogError, match=r"File name in directory 'tine\.npy' and header b'time\.npy' differ"):
        read_log(path, robot)
