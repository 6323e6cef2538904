"""The documentation site builds without a warning, needs nothing from elsewhere, and its links lead somewhere."""

import importlib.util
import re
import runpy
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote

import pytest

import stribeck
from stribeck.core.friction import LAWS

DOCS = Path(__file__).parents[1] / "docs"

WITHOUT = any(importlib.util.find_spec(name) is None for name in ("sphinx", "myst_nb", "furo"))
missing = pytest.mark.skipif(WITHOUT, reason="Sphinx, MyST-NB or Furo is not installed: the site is not built")
pytestmark = [missing, pytest.mark.long]


class Page(NamedTuple):
    """What a page refers to, and what can be referred to in it."""

    links: list[str]
    resources: list[str]
    anchors: set[str]


class Reader(HTMLParser):
    """Collects a page's links, resources and anchors."""

    def __init__(self) -> None:
        super().__init__()
        self.page = Page([], [], set())

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attributes}
        self.page.anchors.update(values[name] for name in ("id", "name") if name in values)
        if tag == "a" and "href" in values:
            self.page.links.append(values["href"])
        elif tag != "a":
            self.page.resources.extend(values[name] for name in ("src", "href", "srcset") if name in values)


def build(folder: Path, *options: str) -> Path:
    strictly = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-E", *options]
    built = subprocess.run([*strictly, "-d", folder / "read", DOCS, folder / "html"], capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    return folder / "html"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the site without running its tutorials and without pages of code, which take most of the time."""
    extensions = [each for each in runpy.run_path(str(DOCS / "conf.py"))["extensions"] if "viewcode" not in each]
    values = ("nb_execution_mode=off", "suppress_warnings=myst-nb.lexer", f"extensions={','.join(extensions)}")
    without = [word for value in values for word in ("-D", value)]
    return build(tmp_path_factory.mktemp("site"), *without)


@pytest.fixture(scope="module")
def tutorials(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("site")) / "tutorials"


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Page]:
    found = {}
    for path in site.rglob("*.html"):
        reader = Reader()
        reader.feed(path.read_text())
        found[path] = reader.page
    return found


def test_every_page_is_built_and_in_the_navigation(site: Path, pages: dict[Path, Page]) -> None:
    names = {p.relative_to(DOCS).with_suffix("") for kind in ("md", "rst", "ipynb") for p in DOCS.rglob(f"*.{kind}")}
    assert {site / f"{name}.html" for name in names} <= set(pages)
    navigation = re.search(r'<div class="sidebar-tree">(.*?)</div>', (site / "index.html").read_text(), re.DOTALL)
    assert {f"{name}.html" for name in names} - {"index.html"} <= set(re.findall(r'href="([^"#]+)"', navigation[1]))


def test_nothing_is_loaded_from_elsewhere(pages: dict[Path, Page]) -> None:
    for path, page in pages.items():
        assert not [one for one in page.resources if one.startswith(("http:", "https:", "//"))], path


def test_links_lead_somewhere(pages: dict[Path, Page]) -> None:
    for path, page in pages.items():
        for link in [*page.links, *page.resources]:
            if link.startswith(("http:", "https:", "data:")):
                continue
            file, _, anchor = unquote(link).partition("#")
            target = (path.parent / file.partition("?")[0]).resolve() if file else path
            assert target.exists(), f"{path.name}: {link}"
            if anchor and target in pages:
                assert anchor in pages[target].anchors, f"{path.name}: {link}"


SHOWN = {"arm": "opposite", "quadruped": "front_left", "humanoid": "motor_0", "python": "(true: 1.1)"}


@pytest.mark.parametrize(("name", "told"), SHOWN.items())
def test_tutorials_show_what_their_commands_print(name: str, told: str, tutorials: Path) -> None:
    outputs = (tutorials / f"{name}.html").read_text().split('<div class="cell_output')[1:]
    assert any("<img" in output for output in outputs)
    for words in (told, "identified", "Written by stribeck"):
        assert any(words in output for output in outputs)


def test_formulae_are_drawn_by_the_browser_itself(site: Path) -> None:
    for law in LAWS:
        assert '<math xmlns="http://www.w3.org/1998/Math/MathML" display="block">' in (
            (site / "laws" / f"{law}.html").read_text()
        )
    text = "".join(path.read_text() for path in site.rglob("*.html"))
    assert "math-error" not in text
    assert not re.search(r"\\(?:frac|tau|begin)\b", re.sub(r"<pre>.*?</pre>", "", text, flags=re.DOTALL))


def test_all_public_names_are_in_the_api(pages: dict[Path, Page], site: Path) -> None:
    public = {f"stribeck.{name}" for name in dir(stribeck) if name != "__version__"}
    names = ("index", "classes", "settings")
    assert public <= set().union(*(pages[site / f"api/{name}.html"].anchors for name in names))
