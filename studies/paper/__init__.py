"""Every figure, table and statement of the paper again, with the public API.

    python -m studies.paper                    everything: numbers, figures, pages
    python -m studies.paper derivatives        one study
    python -m studies.paper --quick            short walks, under build/, to see whether it all runs

One file a study. To add one:

1. Write `studies/paper/<study>.py` with `WALKS`, the names of the walks it reads (see `walks.py`; an empty tuple if
   none); `run(quick) -> Study`, its numbers and its figures; and `texts(numbers) -> dict[str, str]`, pieces of Markdown
   made of the numbers alone.
2. In a page of docs/paper put `<!-- <study>.<text> --><!-- / -->` where a text belongs; `python -m studies.paper`
   fills it in, and figures are `docs/assets/paper/<figure>-light.svg` and `-dark.svg`.
3. Put what it finds into `statements.toml`.

`tests/studies/test_paper.py` runs every study quickly, and finds out if a page says something else than the numbers.
"""
