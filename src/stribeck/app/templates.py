"""Environment of the templates of pages and exported files."""

from collections.abc import Mapping
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined


def environment(package: str, filters: Mapping[str, Any], **more: Any) -> Environment:
    """Load the templates of a package, with more filters; undefined names are errors."""
    more |= {"loader": PackageLoader(package), "undefined": StrictUndefined}
    templates = Environment(trim_blocks=True, lstrip_blocks=True, **more)  # nosec B701
    templates.filters.update(filters)
    return templates
