"""Old names of modules: `import stribeck.online` imports `stribeck.service.online`."""

from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType

_NAMES = {
    "errors": "core.errors",
    "settings": "core.settings",
    "friction": "core.friction",
    "robot": "core.robot",
    "log": "core.log",
    "log.readers": "io.readers",
    "log.writers": "io.writers",
    "contact": "core.dynamics.contact",
    "friction.asymmetric": "paper.asymmetric",
    "friction.stribeck_exponent": "paper.stribeck_exponent",
    "friction_torque": "core.equations.friction_torque",
    "friction_torque.observer": "paper.observer",
    "whole_log": "core.estimator",
    "judgement": "core.judgement",
    "methods": "core.identify",
    "pipeline": "core.identify.pipeline",
    "result": "core.result",
    "result.compare": "app.comparison",
    "audit": "check.audit",
    "drives": "check.drives",
    "init": "check.init",
    "inspection": "check.inspection",
    "cli": "app.cli",
    "report": "app.report",
    "exporters": "app.exporters",
    "fleet": "service.fleet",
    "online": "service.online",
}
"""Old name of a module -> its name, both below `stribeck`."""


class MovedModules:
    """Finder and loader of modules by their old names; both names stand for one module."""

    def find_spec(self, name: str, *_: object) -> ModuleSpec | None:
        """Find a module by its old name."""
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
