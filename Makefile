PYTHON ?= python3
BIN := .venv/bin

# As a variable, and not as `pip install -c`, the pins also hold for the build backend.
export PIP_CONSTRAINT := .ci/constraints.txt
export PIP_DISABLE_PIP_VERSION_CHECK := 1

# Tests start some hundred processes, which load the compiler from bytecode in half the time.
unexport PYTHONDONTWRITEBYTECODE

# What generated/ is made of, and what is made.
SPECS := $(filter-out %/__init__.py,$(wildcard gacompiler/specs/*.py))
MODULES := $(foreach end,py c h,$(SPECS:gacompiler/specs/%.py=generated/%.$(end)))
COMPILER := $(shell find gacompiler -name '*.py' -o -name '*.jinja')

# Kernels run on numba where there is no C compiler. Its libraries are as large as all others of the demonstration.
DEMO := $(if $(shell command -v $(CC) cc gcc clang),demo,demo,compiler)

# All but `peers`, which takes longer than the others together.
EXTRAS := compiler,pictures,notebooks,volumes,test

# Steps that must follow one another are lines of a recipe, so that they do under `make -j` too.
MAKEFLAGS += --no-print-directory

.DEFAULT_GOAL := help
.PHONY: demo test slow peers thorough generated check lint types docs bench notebooks build wheel help clean FORCE

demo: .venv/.demo ## Build the modules that it calls, run on real input; pictures in build/demo
	@$(MAKE) build/.generated
	$(BIN)/python -m algorithms.demo

test: $(if $(ONLY),.venv/.installed,build) ## Run the quick tests, in minutes; ONLY=algorithms/vision, in seconds
	@set -e; files=$$($(if $(ONLY),$(BIN)/python -m benchmarks.sources $(ONLY))); \
	$(BIN)/pytest -n 2 --dist worksteal $$files

slow: build ## Run the slow tests
	$(BIN)/pytest -n 2 --dist worksteal -m "slow and not peers"

peers: .venv/.peers ## Compare with other libraries (slow)
	@$(MAKE) build
	$(BIN)/pytest -n 2 --dist worksteal -m peers

thorough: .venv/.peers ## Run the slow tests and the comparisons together
	@$(MAKE) build
	$(BIN)/pytest -n 2 --dist worksteal -m "slow or peers"

generated: .venv/.installed ## Regenerate generated/ from the specs
	@echo "Generating $(words $(SPECS)) modules, some minutes"
	$(BIN)/gac generate --all --no-build
	@mkdir -p build && touch build/.generated

check: build ## Fail if generated/ differs from the output of the specs, or if a proof fails
	@echo "Comparing $(words $(SPECS)) modules with their specs, some minutes"
	$(BIN)/gac check --prove

lint: .venv/.installed ## Check style and formatting
	$(BIN)/ruff check gacompiler algorithms tests benchmarks notebooks docs/conf.py docs/website
	$(BIN)/ruff format --check gacompiler algorithms tests benchmarks notebooks docs/conf.py docs/website

types: .venv/.installed ## Check types
	$(BIN)/mypy

docs: .venv/.docs ## Build the documentation site from docs, notebooks and docstrings; build/site/index.html
	PYTHONPATH=docs $(BIN)/python -m website

bench: $(if $(CHECK),.venv/.installed,.venv/.peers) ## Measure, compare, write pages of docs; PAGE=vision-speed for one; CHECK=1 lists outdated ones
	@$(if $(CHECK),,$(MAKE) build)
	$(BIN)/python -m benchmarks $(if $(CHECK),--check,$(or $(PAGE),all))

notebooks: .venv/.peers ## Execute the notebooks and store their outputs
	@$(MAKE) build
	$(BIN)/python tests/support/stored_notebooks.py

build: .venv/.installed ## Compile the generated C, if there is a compiler
	@echo "Compiling what changed in generated/"
	$(BIN)/gac build

wheel: .venv/.installed ## Write the wheel with compiled libraries into dist
	@echo "Compiling for each level of processors, some minutes"
	@rm -rf build/lib build/bdist.* build/wheel
	$(BIN)/pip wheel --quiet --no-deps --no-build-isolation --wheel-dir build/wheel .
	$(BIN)/gac package build/wheel/*.whl -o dist $(PYTHONS:%=--python %)

help: ## List the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "%-10s %s\n", $$1, $$2 }' Makefile

clean: ## Remove build products and caches, but not .venv
	rm -rf build dist *.egg-info .mypy_cache .pytest_cache .ruff_cache generated/_build
	find gacompiler generated algorithms tests benchmarks -name __pycache__ -prune -exec rm -rf {} +

# Older than the compiler, or than a generated file that somebody touched, or a file is missing: generate; but not where
# git knows of no change, since what is checked in belongs together.
build/.generated: $(COMPILER) $(wildcard $(MODULES)) $(if $(filter-out $(wildcard $(MODULES)),$(MODULES)),FORCE)
	@if git diff --quiet HEAD -- gacompiler generated 2>/dev/null \
	    && test -z "$$(git ls-files --others --exclude-standard -- gacompiler generated)"; \
	then mkdir -p build && touch $@; else $(MAKE) generated; fi

# Without compiling all of their bytecode, which takes longer than all else; Python compiles what it imports.
INSTALL := $(BIN)/pip install --quiet --no-compile --editable

.venv/.demo: pyproject.toml .ci/constraints.txt
	@echo "Installing what the demonstration imports into .venv, half a minute"
	@test -x $(BIN)/pip || $(PYTHON) -m venv .venv
	$(INSTALL) '.[$(DEMO)]'
	@touch $@

.venv/.installed: pyproject.toml .ci/constraints.txt
	@echo "Installing into .venv, a minute"
	@test -x $(BIN)/pip || $(PYTHON) -m venv .venv
	$(INSTALL) '.[$(EXTRAS)]'
	@touch $@

.venv/.peers: .venv/.installed
	@echo "Installing other libraries into .venv, a minute or two"
	$(INSTALL) '.[peers]'
	@touch $@

.venv/.docs: .venv/.installed
	@echo "Installing Sphinx into .venv, a minute"
	$(INSTALL) '.[docs]'
	@touch $@
