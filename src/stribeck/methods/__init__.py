"""Methods by name, and what is refused of each; to add one, see `stribeck.methods.contract`."""

from __future__ import annotations

import json

from stribeck.errors import SettingsError
from stribeck.methods.contract import Finding as Finding
from stribeck.methods.contract import Method as Method
from stribeck.methods.curve_fit import CURVE_FIT
from stribeck.methods.whole_log import WHOLE_LOG
from stribeck.settings import Settings, flat

METHODS: dict[str, Method] = {method.name: method for method in (CURVE_FIT, WHOLE_LOG)}


def get_method(settings: Settings) -> Method:
    """Return the method that the settings name.

    Raises
    ------
    SettingsError
        If there is none of that name, it cannot fit the law, or a setting that it does not use is set.
    """
    if settings.method not in METHODS:
        raise SettingsError(f"method: found '{settings.method}', expected one of {', '.join(METHODS)}")
    method = METHODS[settings.method]
    if settings.law not in method.laws:
        able = [name for name, other in METHODS.items() if settings.law in other.laws]
        raise SettingsError(
            f"law '{settings.law}' needs method '{' or '.join(able)}', found '{method.name}'; "
            f"set --method {able[0]}, or name a law"
        )
    usual = flat(Settings())
    for key, value in flat(settings).items():
        if key not in method.uses and value != usual[key]:
            raise SettingsError(
                f"[identify] {key} is {value!r}, which the method '{method.name}' does not use; "
                f"leave it out, or --set {key}={json.dumps(usual[key])}"
            )
    return method
