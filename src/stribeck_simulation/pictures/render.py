"""Pictures of a robot by MuJoCo's renderer, made by another process: drawing without a screen may fail in many ways."""

import io
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from stribeck.result.mirror import mirrored_pairs
from stribeck.robot import Robot
from stribeck.typing import Array
from stribeck_simulation.pictures import drawing
from stribeck_simulation.pictures.drawing import BELOW, EXTENT, GREY
from stribeck_simulation.pictures.walk import SEEN_FROM, Picture

BACKENDS = ("egl", "osmesa")
"""Ways to draw without a screen, in the order in which they are tried."""
PATIENCE = 60.0
"""Longest time that another process may take [s]."""
LEFT, RIGHT = (0.26, 0.54, 0.90, 1.0), (0.86, 0.36, 0.12, 1.0)
"""Red, green, blue and opacity of the two sides: in between the page's colours for light and dark."""


def render_poses(robot: Robot, configurations: Array, yaw: Array) -> list[Picture] | None:
    """Return a picture of each pose; None where nothing can be drawn without a screen.

    Parameters
    ----------
    robot
        Floating, read from a robot file whose model MuJoCo reads.
    configurations
        Of its tree, shape (F, 7 + n).
    yaw
        Where it faces [rad], shape (F,).
    """
    names = list(robot.tree.model.names)[2:]
    colours = dict.fromkeys(names, GREY)
    for left, right in mirrored_pairs(names):
        colours[left], colours[right] = LEFT, RIGHT
    request = io.BytesIO()
    np.savez(
        request,
        allow_pickle=False,
        model_file=str(Path(robot.model_path).resolve()),
        names=np.array(names),
        colours=np.array(list(colours.values())),
        configurations=configurations,
        azimuth=yaw + SEEN_FROM + np.pi / 2,
    )
    for backend in BACKENDS:
        pixels = _by_another_process(backend, request.getvalue())
        if pixels is not None and pixels[..., 3].any(axis=(1, 2)).all():
            return [_cropped(picture) for picture in pixels]
    return None


def _by_another_process(backend: str, request: bytes) -> NDArray[np.uint8] | None:
    environment = os.environ | {"MUJOCO_GL": backend}
    command = [sys.executable, "-P", str(Path(drawing.__file__))]
    with tempfile.TemporaryDirectory() as folder:  # where MuJoCo leaves its own log
        try:
            done = subprocess.run(  # this Python, and a file of this package  # nosec B603
                command, input=request, env=environment, cwd=folder, capture_output=True, timeout=PATIENCE, check=True
            )
            return np.asarray(np.load(io.BytesIO(done.stdout), allow_pickle=False)["pixels"])
        except (subprocess.SubprocessError, OSError, EOFError, ValueError, KeyError, BadZipFile):
            return None


def _cropped(pixels: NDArray[np.uint8]) -> Picture:
    """Return what is drawn of a picture, and where it is."""
    metres = EXTENT / len(pixels)
    rows, columns = (np.flatnonzero(pixels[..., 3].any(axis=axis)) for axis in (1, 0))
    top, bottom, left, right = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
    return Picture(
        pixels=pixels[top:bottom, left:right],
        left=float(left * metres - EXTENT / 2),
        right=float(right * metres - EXTENT / 2),
        bottom=float(EXTENT - BELOW - bottom * metres),
        top=float(EXTENT - BELOW - top * metres),
    )
