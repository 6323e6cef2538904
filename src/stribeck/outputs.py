"""A folder of outputs that appears whole or not at all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from stribeck.errors import SettingsError


@contextmanager
def staged_folder(folder: str | Path) -> Iterator[Path]:
    """Give a temporary folder to write to; its files move into `folder` only if no error came.

    Raises
    ------
    SettingsError
        If the folder cannot be made.
    """
    target = Path(folder)
    try:
        if target.exists() and not target.is_dir():
            raise SettingsError(f"{target}: is a file; expected a folder for the outputs, which is made if needed")
        target.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=f".{target.name}.", suffix=".part", dir=target.parent))
    except OSError as error:
        raise SettingsError(f"{target}: cannot be made ({error.strerror}); expected a folder to write to") from error
    try:
        yield staging
        target.mkdir(exist_ok=True)
        for file in sorted(staging.iterdir()):
            file.replace(target / file.name)
    finally:
        shutil.rmtree(staging, ignore_errors=True)
