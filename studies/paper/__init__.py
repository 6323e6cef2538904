"""Every table and statement of the paper again, with the public API.

    python -m studies.paper                    all studies: writes numbers and figures, fills the page, prints results
    python -m studies.paper derivatives        one study
    python -m studies.paper --quick            short walks, under build/, to see whether it all runs

One file per study. To add one:

1. Write `studies/paper/<study>.py` with `WALKS`, the names of the walks it reads (see `walks.py`; an empty tuple if
   none); `run(quick) -> Numbers`; `texts(numbers) -> dict[str, str]`, pieces of Markdown made of the numbers; and, if
   it has figures, `drawings(numbers)`, functions that draw on a figure, by name. Put an empty mapping into
   `numbers/<study>.json`.
2. Add the finding to `statements.toml`, where `{<study>.<text>}` stands for a text. `python -m studies.paper` writes
   the statements into docs/paper.md and figures to `docs/assets/paper/<figure>-light.svg` and `-dark.svg`.

`make paper` then runs `tests/studies/test_paper.py`, which runs short versions of all studies and compares the page
with the numbers.
"""
