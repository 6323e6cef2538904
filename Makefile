# Two commands do everything on a fresh machine with Python >= 3.11: `make demo` and `make test`.
PYTHON ?= python3
BIN := .venv/bin

.PHONY: demo test lint bench coverage paper docs accuracy real clean

.venv/.run: pyproject.toml requirements.lock
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c requirements.lock -e .
	@touch $@

.venv/.dev: .venv/.run
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c requirements.lock -e '.[dev]'
	@touch $@

demo: .venv/.run
	$(BIN)/stribeck demo

lint: .venv/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

test: lint
	$(BIN)/python -m pytest -n auto --dist loadfile

paper: .venv/.dev
	$(BIN)/python -m studies.paper

docs: .venv/.dev
	$(BIN)/python -m sphinx -W --keep-going -q docs site

accuracy: .venv/.dev
	$(BIN)/python -m studies.accuracy --save studies/accuracy.json

real: .venv/.dev
	$(BIN)/python -m studies.real

clean:
	rm -rf .venv build site .pytest_cache .mypy_cache .ruff_cache
