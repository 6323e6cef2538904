"""Reproduce every table and statement of the paper with the public API.

    python -m studies.paper                    all studies: writes numbers and figures, fills the page, prints results
    python -m studies.paper derivatives        one study
    python -m studies.paper --quick            short walks, under build/, as a check that all studies run

One file per study. To add one:

1. Write `studies/paper/<study>.py` with `WALKS`, the names of the walks it reads (see `walks.py`; an empty tuple if
   none); `run(quick) -> Numbers`; `texts(numbers) -> dict[str, str]`, pieces of Markdown with the numbers; and, if
   it has figures, `drawings(numbers)`, functions that draw on a figure, by name. Put an empty mapping into
   `numbers/<study>.json`.
2. Add the finding to `statements.toml`, where `{<study>.<text>}` stands for a text. `python -m studies.paper` writes
   the statements into README.md and figures to `docs/assets/paper/<figure>-light.svg` and `-dark.svg`.

`make paper` then runs `tests/studies/test_paper.py`, which runs short versions of all studies and compares the page
with the numbers.
"""
