"""What the site needs besides the Markdown that GitHub shows: a navigation, pictures in both themes, links to code."""

import re

from sphinx.application import Sphinx

PICTURE = re.compile(r"<picture>.*?</picture>", re.DOTALL)
"""A picture for each theme, as GitHub takes it: a `<source>` for the dark one, an `<img>` for the light one."""

PARTS = {part: re.compile(rf'{part}="([^"]*)"') for part in ("srcset", "src", "alt")}

OUTSIDE = re.compile(r"\[(?P<text>[^\]]+)\]\((?:\.\./)+(?:examples|src|studies|benchmarks)(?:/[\w/-]+)?\)")
"""A link to a folder of the repository, which the site does not have."""


def both_themes(match: re.Match[str]) -> str:
    """Return the same pictures for a theme that a reader can also choose by hand."""
    dark, light, alt = (found[1] if (found := part.search(match[0])) else "" for part in PARTS.values())
    return f"![{alt}]({light}){{.only-light}} ![{alt}]({dark}){{.only-dark}}"


def toctrees(captions: dict[str, list[str]]) -> str:
    """Return the directives that list a page's pages; a name that ends with a star stands for all that begin so."""
    directives = []
    for caption, pages in captions.items():
        head = [":hidden:", *([f":caption: {caption}"] if caption else []), *([":glob:"] if "*" in str(pages) else [])]
        directives.append("\n".join(["\n\n```{toctree}", *head, "", *(f"/{page}" for page in pages), "```\n"]))
    return "".join(directives)


def complete(app: Sphinx, page: str, source: list[str]) -> None:
    """Give a page what the site needs."""
    text = PICTURE.sub(both_themes, source[0])
    text = OUTSIDE.sub(lambda match: match["text"], text)
    source[0] = text + toctrees(app.config.NAVIGATION.get(page, {}))


def setup(app: Sphinx) -> dict[str, bool]:
    """Listen where a page has been read and is not yet parsed."""
    app.add_config_value("NAVIGATION", {}, "env", dict)
    app.connect("source-read", complete)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
