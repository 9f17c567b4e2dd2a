# The two commands: `make demo` and `make test`. Both install what they need into .venv.
PYTHON ?= python3
BIN := .venv/bin

.PHONY: demo test lint bench results clean

demo: .venv/installed
	$(BIN)/dloftbs demo --out demo

test: .venv/installed-dev
	$(BIN)/python -m pytest

lint: .venv/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: .venv/installed-dev
	$(BIN)/python -m benchmarks.speed
	$(BIN)/python -m benchmarks.process

# docs/results.md, the default method and the published one; some minutes on two cores, whatever is finished stays in
# build/results.
results: .venv/installed-dev
	$(BIN)/dloftbs evaluate --method default,paper --out build/results
	$(BIN)/python -m dloftbs.evaluation.report_docs build/results docs/results.md

clean:
	rm -rf .venv demo dist build

.venv/bin/python:
	$(PYTHON) -m venv .venv

.venv/installed: .venv/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --editable .
	touch $@

.venv/installed-dev: .venv/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --editable ".[dev]"
	touch $@ .venv/installed
