"""Old names of modules, from before there were rooms: `stribeck.online` is `stribeck.service.online`."""

from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType

_ROOMS = {
    **dict.fromkeys(("errors", "settings", "friction", "robot", "log", "result", "judgement"), "core"),
    **dict.fromkeys(("log.readers", "log.writers"), "io"),
    **dict.fromkeys(("audit", "drives", "init", "inspection"), "check"),
    **dict.fromkeys(("cli", "report", "exporters"), "app"),
    **dict.fromkeys(("fleet", "online"), "service"),
}
_NAMES = {old: f"{room}.{old.removeprefix('log.') if room == 'io' else old}" for old, room in _ROOMS.items()}
_NAMES |= {"result.compare": "app.comparison", "friction_torque": "core.equations.friction_torque"}
_NAMES |= {"friction_torque.observer": "paper.observer", "pipeline": "core.identify.pipeline"}
_NAMES |= {"methods": "core.identify", "whole_log": "core.estimator", "contact": "core.dynamics.contact"}


class MovedModules:
    """Finder and loader of modules by their old names; both names stand for one module."""

    def find_spec(self, name: str, *_: object) -> ModuleSpec | None:
        """Find an old name."""
        old = name.removeprefix("stribeck.")
        for head in sorted(_NAMES, key=len, reverse=True) if name != old else ():
            if f"{old}.".startswith(f"{head}."):
                return ModuleSpec(name, self, loader_state=f"stribeck.{_NAMES[head]}{old[len(head) :]}")  # type: ignore[arg-type]
        return None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Import the module by its name."""
        module = import_module(spec.loader_state)
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Restore the specification, which the import by an old name replaces."""
        assert module.__spec__ is not None
        module.__spec__ = module.__spec__.loader_state
