"""Methods by name, and checks of their settings."""

import json

from stribeck.core.base.checked_table import flat
from stribeck.core.base.parts import Parts
from stribeck.core.errors import SettingsError, did_you_mean
from stribeck.core.friction import FrictionLaw, get_law
from stribeck.core.identify.contract import Method
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings

METHODS = Parts[Method]("stribeck.methods")


def get_method(settings: Settings, robot: Robot) -> tuple[Method, FrictionLaw, Settings]:
    """Select method and law of the settings, and fill in the method's defaults.

    Raises
    ------
    SettingsError
        If the method or law is unknown, the method cannot fit the law, or a setting is set that it does not use.
    """
    if settings.method not in METHODS:
        near = did_you_mean(settings.method, METHODS)
        raise SettingsError(f"method: found '{settings.method}', expected one of {', '.join(METHODS)}{near}")
    if robot.loops:
        _refuse_loops(settings)
    method, usual = METHODS[settings.method], flat(Settings())
    defaults = {key: value for key, value in method.defaults(robot).items() if getattr(settings, key) == usual[key]}
    name = settings.law or defaults["law"]
    law = get_law(name)
    if name not in method.laws:
        able = [other.name for other in METHODS.values() if name in other.laws]
        raise SettingsError(
            f"law '{name}' needs method '{' or '.join(able)}', found '{method.name}'; "
            f"set method = '{able[0]}', or name a law"
        )
    if settings.standing_legs == "measured" and not method.wrenches:
        raise SettingsError(
            f"[identify] standing_legs is 'measured', and the method '{method.name}' does not use wrenches on feet; "
            "expected true or false, or method 'ground-reaction'"
        )
    for key, value in flat(settings).items():
        if key not in method.uses and value != usual[key]:
            raise SettingsError(
                f"[identify] {key} is {value!r}, which the method '{method.name}' does not use; "
                f"leave it out, or set {key} = {json.dumps(usual[key])}"
            )
    _refuse_unknown_joints(settings, robot)
    return method, law, settings.model_copy(update=defaults)


def _refuse_loops(settings: Settings) -> None:
    """Refuse robots with closed chains for methods that do not support them."""
    if not METHODS[settings.method].loops:
        able = " or ".join(method.name for method in METHODS.values() if method.loops)
        raise SettingsError(
            f"method '{settings.method}' takes a robot for a tree, and [[robot.loops]] close it; expected method {able}"
        )
    refused = {"double_support": ("fit",), "standing_legs": ("measured",), "corrections": ("calibration",)}
    for key in (key for key, values in refused.items() if getattr(settings, key) in values):
        raise SettingsError(
            f"[identify] {key} = '{getattr(settings, key)}' takes a robot for a tree, and [[robot.loops]] close it; "
            "leave it out"
        )


def _refuse_unknown_joints(settings: Settings, robot: Robot) -> None:
    """Refuse `fit_armature` for joints whose friction is not identified."""
    asked = settings.fit_armature if isinstance(settings.fit_armature, list) else []
    known = [*(robot.joint_names[column] for column in robot.torque_controlled), *robot.couplings]
    unknown = [joint for joint in asked if joint not in known]
    if unknown:
        raise SettingsError(
            f"[identify] fit_armature names joint '{unknown[0]}'; the torque-controlled joints are {', '.join(known)}"
        )
