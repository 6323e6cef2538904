"""Complete the Markdown that GitHub shows for the site: navigation, pictures in both themes, tables, links to code."""

import re
from functools import partial
from pathlib import Path

from sphinx.application import Sphinx

PICTURE = re.compile(r"<picture>.*?</picture>", re.DOTALL)
"""Picture per theme in GitHub's form: a `<source>` for the dark theme, an `<img>` for the light one."""

PARTS = {part: re.compile(rf'{part}="([^"]*)"') for part in ("srcset", "src", "alt")}

OUTSIDE = re.compile(r"\[(?P<text>[^\]]+)\]\((?:\.\./)+(?:examples|src|studies|benchmarks)(?:/[\w/-]+)?\)")
"""Link to a folder of the repository that is not part of the site."""


TABLES = re.compile(r"^\[[^\]]+\]\((\.\./[\w/]+\.md)\)$", re.MULTILINE)
"""Paragraph that only links to a Markdown file outside the site."""


def content(docs: Path, match: re.Match[str]) -> str:
    """Read the file of a link, without its first paragraph."""
    text = (docs / match[1]).read_text(encoding="utf-8")
    return text.partition("\n\n")[2].replace("](../../docs/", "](")


def both_themes(match: re.Match[str]) -> str:
    """Convert a picture per theme to images that follow the theme selected on the site."""
    dark, light, alt = (found[1] if (found := part.search(match[0])) else "" for part in PARTS.values())
    return f"![{alt}]({light}){{.only-light}} ![{alt}]({dark}){{.only-dark}}"


def toctrees(captions: dict[str, list[str]]) -> str:
    """Format the toctree directives of a page."""
    directives = []
    for caption, pages in captions.items():
        head = [":hidden:", *([f":caption: {caption}"] if caption else [])]
        directives.append("\n".join(["\n\n```{toctree}", *head, "", *(f"/{page}" for page in pages), "```\n"]))
    return "".join(directives)


def complete(app: Sphinx, page: str, source: list[str]) -> None:
    """Add navigation, themed pictures, tables and plain text for outside links to a page."""
    text = PICTURE.sub(both_themes, TABLES.sub(partial(content, Path(app.srcdir)), source[0]))
    text = OUTSIDE.sub(lambda match: match["text"], text)
    source[0] = text + toctrees(app.config.NAVIGATION.get(page, {}))


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect to the event between reading and parsing a page."""
    app.add_config_value("NAVIGATION", {}, "env", dict)
    app.connect("source-read", complete)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
