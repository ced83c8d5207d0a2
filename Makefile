# The face of the program `meshshard`: every target sets up .venv first, and only once.
.DEFAULT_GOAL := help
.PHONY: help setup features train reproduce bench test soak check lint types imports docs pictures clean

PYTHON ?= python3
DATASET ?= minicoseg
RAW ?=
JOBS ?= -1
EPOCHS ?=
TABLE ?= minicoseg
ARGS ?=

VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

help: ## Print this list
	@echo "make TARGET [DATASET=$(DATASET)] [RAW=folder of raw files] [JOBS=$(JOBS)] [EPOCHS=n] [ARGS='more options']"
	@grep -E '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## (.*)/  \1\t\2/' | expand -t 12

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable '.[dev]' --constraint constraints.txt
	@touch $@

setup: $(READY) ## Create .venv and install everything into it

features: $(READY) ## Compute the features of DATASET into data/features
	$(BIN)/meshshard features $(DATASET) $(if $(RAW),--raw "$(RAW)") --jobs $(JOBS) $(ARGS)

# GLIBC_TUNABLES: memory in large pages, with which a training step takes 12 to 15 % less time (docs/log.md)
# minicoseg makes its own raw files; other data sets are prepared here when RAW says where theirs are
train: $(READY) ## Train on DATASET and show its results
	@$(if $(filter minicoseg,$(DATASET))$(RAW),$(BIN)/meshshard features $(DATASET) $(if $(RAW),--raw "$(RAW)") --jobs $(JOBS))
	GLIBC_TUNABLES=glibc.malloc.hugetlb=1 $(BIN)/meshshard train $(DATASET) $(if $(EPOCHS),--epochs $(EPOCHS)) $(ARGS)

reproduce: $(READY) ## Run or go on with the paper's experiment TABLE: minicoseg, human, fewshot, features, ...
	GLIBC_TUNABLES=glibc.malloc.hugetlb=1 $(BIN)/meshshard reproduce $(TABLE) $(ARGS)

bench: $(READY) ## Measure preparation and training beside the published way: minutes, into docs/benchmarks
	$(BIN)/meshshard bench $(ARGS)
	$(BIN)/meshshard bench-train --compile

test: $(READY) ## Run the tests
	$(BIN)/python -m pytest --numprocesses auto $(ARGS)

soak: $(READY) ## Run the reliability tests in their long form: hours, figures for docs/reliability.md
	MESHSHARD_SOAK=1 $(BIN)/python -m pytest -m soak --numprocesses auto $(ARGS)

lint: $(READY) ## Style: ruff, which changes nothing
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(READY) ## Types: mypy, strict
	$(BIN)/mypy

imports: $(READY) ## Walls between the packages: import-linter
	$(BIN)/lint-imports

check: lint types imports test ## Everything that must pass before a commit

docs: $(READY) ## Build the documentation into site/; then open site/index.html
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

pictures: $(READY) ## Draw the pictures of the documentation again: a minute, with Chromium
	$(BIN)/python docs/pictures.py

clean: ## Remove .venv and caches, but no data and no run
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .import_linter_cache site
