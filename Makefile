PYTHON ?= python3
BIN := .venv/bin

# As a variable, and not as `pip install -c`, the pins also hold for the build backend.
export PIP_CONSTRAINT := .ci/constraints.txt

.DEFAULT_GOAL := help
.PHONY: demo test peers generated check lint types bench build help clean

demo: build ## Run the generated kernels on real input; figures in build/demo
	$(BIN)/python -m algorithms.demo

test: build ## Run the tests
	$(BIN)/pytest -n 2

peers: build .venv/.peers ## Compare with other libraries (slow)
	$(BIN)/pytest -m peers

generated: .venv/.installed ## Write generated/ anew from the specs
	$(BIN)/gac generate --all

check: .venv/.installed ## Fail if generated/ is not what the specs give
	$(BIN)/gac check

lint: .venv/.installed ## Check style and formatting
	$(BIN)/ruff check gacompiler algorithms tests benchmarks
	$(BIN)/ruff format --check gacompiler algorithms tests benchmarks

types: .venv/.installed ## Check types
	$(BIN)/mypy

bench: build ## Measure generation time and kernel speed
	$(BIN)/python -m benchmarks

build: .venv/.installed ## Compile the generated C, if a compiler is there
	$(BIN)/gac build

help: ## List the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "%-10s %s\n", $$1, $$2 }' Makefile

clean: ## Remove what was built and cached; .venv stays
	rm -rf build dist *.egg-info .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find gacompiler generated algorithms tests benchmarks \( -name __pycache__ -prune -o -name '*.so' -o -name '*.o' \) -exec rm -rf {} +

.venv/.installed: pyproject.toml .ci/constraints.txt
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --editable '.[test]'
	touch $@

.venv/.peers: .venv/.installed
	$(BIN)/pip install --quiet --editable '.[peers]'
	touch $@
