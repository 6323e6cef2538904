"""Settings of the documentation site: `make docs` builds it into `site/`.

The pages are plain Markdown that GitHub shows too. `extensions/` adds the navigation and other features of the site.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

from stribeck import __version__

project = "stribeck"
author = "The stribeck authors"
project_copyright = author
version = release = __version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "docstrings",
    "mathml",
    "pages",
]

NAVIGATION = {
    "index": {
        "Tutorials": ["tour", "tutorials/index"],
        "How-to guides": [
            "own-log",
            "rl",
            "currents",
            "robots",
            "library",
            "methods",
            "verdicts",
            "weak",
            "findings",
            "plan",
            "export",
            "replay",
            "compare",
            "fleet",
            "watch",
            "test-bed",
            "observer",
            "extending",
        ],
        "Explanation": [
            "idea",
            "torque",
            "laws/index",
            "whole-log",
            "mathematics",
            "estimator",
            "estimator-fit",
            "other-methods",
            "accuracy",
            "simulation",
            "paper",
        ],
        "Reference": ["cli", "robot-file", "settings", "logs", "result", "api/index", "glossary"],
    },
    "tutorials/index": {"": ["tutorials/arm", "tutorials/quadruped", "tutorials/humanoid", "tutorials/python"]},
    "laws/index": {
        "": [
            "laws/stribeck",
            "laws/coulomb-viscous",
            "laws/stribeck-exponent",
            "laws/asymmetric",
            "laws/lugre",
            "laws/auto",
        ]
    },
}
"""Page -> captions -> pages below it. `extensions/pages.py` adds them as toctrees."""

default_role = "code"  # docstrings have single backticks, as Markdown has
nb_execution_mode = "force"
nb_execution_in_temp = True  # tutorials write files
nb_execution_raise_on_error = True
nb_execution_timeout = 300  # [s]; a cell takes a few
nb_merge_streams = True
myst_enable_extensions = ["attrs_inline", "dollarmath"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 4
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
napoleon_google_docstring = False
napoleon_use_rtype = False  # what is returned has a name in the docstring and a type in the signature
napoleon_attr_annotations = False
napoleon_custom_sections = [("Attributes", "params_style")]  # as a list, not as separate objects
python_use_unqualified_type_names = True
maximum_signature_line_length = 90

html_theme = "furo"
html_title = "stribeck"
html_static_path = ["assets/site.css", "assets/SiteMath.woff", "assets/SiteMath-OFL.txt"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}
