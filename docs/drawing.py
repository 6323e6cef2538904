"""Poses of a robot drawn by MuJoCo's renderer, for the README's picture."""

from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EXTENT = 2.4
"""Height and width of the drawn area, which starts slightly below the ground [m]."""
BELOW = 0.1
"""Depth of the drawn area below the ground [m]."""
PIXELS = 640
"""Height and width of the rendering; pictures have half as many pixels, which smooths edges."""
GREY = (0.60, 0.63, 0.68, 1.0)
"""Color of the root: red, green, blue, opacity."""
URDF_SHAPES = '<mujoco><compiler discardvisual="false"/></mujoco>'
"""Compiler setting that keeps visual shapes of a URDF."""


def draw(
    model_file: str, names: NDArray[np.str_], colours: Array, configurations: Array, azimuth: Array
) -> NDArray[np.uint8]:
    """Render pictures of poses, shape (F, PIXELS / 2, PIXELS / 2, 4).

    Parameters
    ----------
    model_file
        URDF or MJCF.
    names
        Names of all joints except the free one, n.
    colours
        Red, green, blue and opacity of the links that each joint moves, shape (n, 4).
    configurations
        Position and quaternion xyzw of the root, then joints, shape (F, 7 + n).
    azimuth
        Horizontal viewing direction of the camera for each pose [rad], shape (F,).
    """
    model = _drawable(model_file)
    joints = [model.joint(str(name)).id for name in names]
    _paint(model, dict(zip((int(body) for body in model.jnt_bodyid[joints]), colours, strict=True)))
    data = mujoco.MjData(model)
    camera = mujoco.MjvCamera()
    camera.type, camera.elevation, camera.distance = mujoco.mjtCamera.mjCAMERA_FREE, 0.0, 2 * EXTENT
    camera.orthographic = 1
    shown = mujoco.MjvOption()
    shown.sitegroup[:] = 0  # they are marks, not bodies
    pictures = []
    with mujoco.Renderer(model, PIXELS, PIXELS) as renderer:
        for configuration, ahead in zip(configurations, azimuth, strict=True):
            data.qpos[:3], data.qpos[3:7] = configuration[:3], np.roll(configuration[3:7], 1)  # w comes first
            data.qpos[model.jnt_qposadr[joints]] = configuration[7:]
            mujoco.mj_forward(model, data)
            camera.azimuth = np.rad2deg(ahead)
            camera.lookat[:] = [*configuration[:2], EXTENT / 2 - BELOW]
            renderer.update_scene(data, camera, shown)
            colour = renderer.render().copy()
            renderer.enable_segmentation_rendering()
            opaque = renderer.render()[..., 0] >= 0
            renderer.disable_segmentation_rendering()
            pictures.append(_smooth(colour, opaque))
    return np.array(pictures)


def _drawable(model_file: str) -> mujoco.MjModel:
    """Load the model with its shapes and a free root."""
    text = Path(model_file).read_text(encoding="utf-8")
    if text.rstrip().endswith("</robot>"):
        spec = mujoco.MjSpec.from_string(text.replace("</robot>", URDF_SHAPES + "</robot>"))
        spec.compiler.fusestatic = False  # before the root gets its free joint
    else:
        spec = mujoco.MjSpec.from_file(model_file)
    root = spec.worldbody.first_body()
    if not any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in root.joints):
        root.add_freejoint()
    spec.visual.global_.offwidth = spec.visual.global_.offheight = PIXELS
    spec.visual.global_.fovy = EXTENT  # without perspective it is a length
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = 3 * [0.45], 3 * [0.55]
    spec.visual.headlight.specular = 3 * [0.1]
    return spec.compile()


def _paint(model: mujoco.MjModel, colours: dict[int, Array]) -> None:
    """Color each shape by its body. Bodies that no joint moves get the color of their parent."""
    painted = [np.array(GREY)]
    for body in range(1, model.nbody):  # parents come first
        painted.append(colours.get(body, painted[model.body_parentid[body]]))
    model.geom_rgba[:] = np.array(painted)[model.geom_bodyid]


def _smooth(colour: NDArray[np.uint8], opaque: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Average blocks of two by two pixels; background pixels do not affect the color."""
    pairs = (PIXELS // 2, 2, PIXELS // 2, 2)
    share = opaque.reshape(pairs).mean(axis=(1, 3))
    total = (colour * opaque[..., None]).reshape(*pairs, 3).mean(axis=(1, 3))
    shade = np.divide(total, share[..., None], out=np.zeros_like(total), where=share[..., None] > 0)
    return np.concatenate([shade, 255 * share[..., None]], axis=-1).round().astype(np.uint8)


def cropped(pixels: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], tuple[float, float, float, float]]:
    """Crop a picture to the robot; return it with left, right, bottom and top edge relative to root and ground [m]."""
    metres = EXTENT / len(pixels)
    rows, columns = (np.flatnonzero(pixels[..., 3].any(axis=axis)) for axis in (1, 0))
    top, bottom, left, right = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
    across = left * metres - EXTENT / 2, right * metres - EXTENT / 2
    up = EXTENT - BELOW - bottom * metres, EXTENT - BELOW - top * metres
    return pixels[top:bottom, left:right], (*across, *up)
