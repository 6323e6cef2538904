"""Errors about damaged logs are one line that names the file and the valid choices."""

import errno
import os
from pathlib import Path

import pytest
from tests.damaged import BAD_SAMPLING, DAMAGED
from tests.log.readers.formats import WHOLE, StubRobot, synthetic_log, write_parquet

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


@pytest.mark.parametrize("writer", WHOLE.values(), ids=WHOLE)
def test_a_file_that_is_nearly_all_a_hole(writer, tmp_path):
    path = writer(tmp_path, synthetic_log(20))
    os.truncate(path, 1 << 40)
    with pytest.raises(
        LogError, match=r"is 1\.1e\+12 bytes long, of which \d+ are on the disk; expected a complete file"
    ):
        read_log(path, StubRobot())


@pytest.mark.parametrize("reason", [errno.EACCES, errno.EIO])
def test_a_file_that_the_system_cannot_read_is_reported(reason, tmp_path, monkeypatch):
    def refuse(path, *_):
        raise OSError(reason, os.strerror(reason), str(path))

    path = write_parquet(tmp_path, synthetic_log(20))
    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(LogError) as caught:
        read_log(path, StubRobot())
    assert str(caught.value) == f"{path}: cannot be read ({os.strerror(reason)}); expected a readable log"
