# Two commands do everything on a fresh machine with Python >= 3.11: `make demo` and `make test`.
PYTHON ?= python3
BIN := .venv/bin
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile -c requirements.lock
PYTEST := $(BIN)/python -m pytest -n auto --dist worksteal
UNTRACED := tests/simulation tests/studies tests/test_real_logs.py
BENCHMARKS := identify online
CORE := contact differentiation dynamics friction friction_torque judgement methods result robot whole_log test_golden.py test_layers.py \
	test_pipeline.py test_trots.py

# Modules are compiled when one is first imported, and kept: else each of many processes would compile them anew.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: demo test test-core pytest lint coverage bench benchmark fuzz paper docs studies real clean

.venv/bin/pip:
	$(PYTHON) -m venv .venv

.venv/.run: pyproject.toml requirements.lock | .venv/bin/pip
	$(INSTALL) -e '.[simulation]'
	@touch $@

.venv/.dev: pyproject.toml requirements.lock | .venv/bin/pip
	$(INSTALL) -e '.[dev]'
	@touch .venv/.run $@

demo: .venv/.run
	$(BIN)/stribeck demo --overwrite

lint: .venv/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/bandit --quiet --configfile pyproject.toml --recursive src

test: .venv/.dev
	$(MAKE) --jobs=2 lint pytest

pytest: .venv/.dev
	$(PYTEST)

# Tests of the core alone, without pages, commands, formats of files and simulation.
test-core: .venv/.dev
	$(PYTEST) $(CORE:%=tests/%)

coverage: .venv/.dev
	$(PYTEST) -m "" $(UNTRACED:%=--ignore=%) --cov --cov-report=term-missing:skip-covered
	$(PYTEST) -m long tests/simulation

bench: .venv/.dev
	for name in $(BENCHMARKS); do $(BIN)/python -m benchmarks.$$name || exit; done

benchmark: .venv/.dev
	$(BIN)/python -m benchmarks.contest install
	$(BIN)/python -m benchmarks.contest make build/benchmark
	$(BIN)/python -m benchmarks.contest run build/benchmark --jobs 2 --save build/benchmark/scores.json
	$(BIN)/python -m benchmarks.contest table build/benchmark/scores.json

fuzz: .venv/.dev
	$(PYTEST) --hypothesis-profile=fuzz tests/test_hostile.py
	$(PYTEST) --hypothesis-profile=random tests/result tests/log tests/robot tests/test_settings.py

paper: .venv/.dev
	$(BIN)/python -m studies.paper
	$(PYTEST) -m "" tests/studies/test_paper.py

docs: .venv/.dev
	$(BIN)/python -m sphinx -W --keep-going -q docs site

# Repeats the studies whose figures are not those of this code; continues after an interruption.
studies: .venv/.dev
	$(BIN)/python -m studies run

real: .venv/.dev
	$(PYTEST) -m long tests/test_real_logs.py

clean:
	rm -rf .venv build site jupyter_execute .pytest_cache .mypy_cache .ruff_cache
