"""Gives the command line inputs that are wrong in ways nobody thought of, and counts what it does with them.

`python -m fuzz --seed 1 --inputs 10000` prints a line a kind of input; CONTRIBUTING.md says what its columns mean.

To add a kind of input:

1. Write `fuzz/<kind>.py` with a function `make(generator, folder, seeds) -> list[str]`: it writes one input into an
   empty folder, from nothing but the numbers that the generator draws, and returns the words of the command line that
   reads it there. `seeds` is a folder with a sound input of every format (see `fuzz.seeds`); `fuzz.damage` changes
   texts. Outputs are named `out` or `out.*`.
2. Add it to `KINDS` in `fuzz/kinds.py`, with its share of the inputs.
"""
