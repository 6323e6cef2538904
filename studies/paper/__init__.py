"""Every table and statement of the paper again, with the public API.

    python -m studies.paper                    everything: numbers, figures, pages
    python -m studies.paper derivatives        one study
    python -m studies.paper --quick            short walks, under build/, to see whether it all runs

One file per study. To add one:

1. Write `studies/paper/<study>.py` with `WALKS`, the names of the walks it reads (see `walks.py`; an empty tuple if
   none); `run(quick) -> Numbers`; `texts(numbers) -> dict[str, str]`, pieces of Markdown made of the numbers; and, if
   it has figures, `drawings(numbers)`, functions that draw on a figure, by name. Put an empty mapping into
   `numbers/<study>.json`.
2. In a page of docs/paper put `<!-- <study>.<text> --><!-- / -->` where a text belongs; `python -m studies.paper`
   fills it in, and figures are `docs/assets/paper/<figure>-light.svg` and `-dark.svg`.
3. Put what it finds into `statements.toml`.

`make paper` then runs `tests/studies/test_paper.py`, which runs every study quickly and compares pages and numbers.
"""
