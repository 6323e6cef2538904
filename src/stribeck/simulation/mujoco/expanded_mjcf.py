"""MJCF models whose elements generate bodies, with the generated bodies written out."""

import os
from pathlib import Path
from xml.etree.ElementTree import fromstring, tostring

import mujoco

from stribeck.core.errors import RobotFileError
from stribeck.core.robot.mjcf import quiet_mujoco, read_spec


@quiet_mujoco()
def expanded_mjcf(path: Path) -> str:
    """Write out a model with the bodies that it generates and those of its included files.

    Names are those of MuJoCo's compiled model. Files of meshes and textures are relative to the folders of the model.

    Raises
    ------
    RobotFileError
        If MuJoCo cannot compile the model.
    """
    try:
        spec = read_spec(path)
        compiled = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise RobotFileError(f"{path}: MuJoCo cannot compile this model: {' '.join(str(error).split())}") from error
    root = fromstring(spec.to_xml())  # nosec B314
    kinds = ("mesh", "mesh"), ("hfield", "hfield"), ("skin", "skin"), ("texture", "tex")
    for tag, word in kinds:  # files of attached models are in other folders
        folder = path.parent / (spec.texturedir if tag == "texture" else spec.meshdir)
        elements = {element.get("name"): element for element in root.iterfind(f"asset/{tag}[@file]")}
        for number, place in enumerate(getattr(compiled, f"{word}_pathadr")):
            file = Path(compiled.paths[place:].partition(b"\0")[0].decode()) if place >= 0 else Path()
            if file.is_file() and (element := elements.get(getattr(compiled, word)(number).name)) is not None:
                element.set("file", Path(os.path.relpath(file, folder)).as_posix())
    return tostring(root, encoding="unicode")
