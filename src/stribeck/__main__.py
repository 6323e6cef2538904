"""`python -m stribeck`: the command line."""

from stribeck.app.cli import main

if __name__ == "__main__":
    main()
