# The two commands of the README are `make run` and `make test`; both install what is missing.
.PHONY: help install run test test-full check format bench reference docs browser screenshots dist extras sbom licences clean

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SOURCES := pyproject.toml constraints.txt

# uv installs faster; pip does the same.
ifneq ($(shell command -v uv 2>/dev/null),)
PIP_INSTALL := uv pip install --quiet --python $(BIN)/python --constraint constraints.txt
else
PIP_INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt
endif

help: ## show this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

install: $(VENV)/.installed ## install FRAS and all its services into .venv

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "FRAS needs Python 3.11 or newer: make PYTHON=...")'
	@$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: $(SOURCES) | $(VENV)/bin/python
	@echo "installing FRAS into $(VENV) (a minute or two)"
	@$(PIP_INSTALL) --editable '.[all]'
	@echo "compiling the finite-element kernels (once, about half a minute)"
	@$(BIN)/python -m fras_log.keys
	@$(BIN)/python -c 'from fras_sim.fem import compile_kernels; compile_kernels(everything=True)'
	@touch $@

$(VENV)/.installed-dev: $(VENV)/.installed
	@echo "installing the tools of the tests and checks"
	@$(PIP_INSTALL) --editable '.[dev]'
	@touch $@

run: $(VENV)/.installed ## run one complete autonomous retraction
	$(BIN)/fras run

# Two at a time: a tick waits for one process after the other, so that one trial leaves a core idle.
test: $(VENV)/.installed-dev ## run all tests, those with real processes too
	$(BIN)/python -m pytest --numprocesses 2 --dist loadfile

test-full: $(VENV)/.installed-dev ## the same with every random campaign in full length
	FRAS_TESTS=full $(BIN)/python -m pytest --numprocesses 2 --dist loadfile --fail-on-flaky

check: $(VENV)/.installed-dev ## lint, format, types, import contracts
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/pyright

format: $(VENV)/.installed-dev ## format and mend what can be mended
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: $(VENV)/.installed-dev ## measure all there is, briefly, and write the table of docs/benchmarks.md
	$(BIN)/fras bench all --page docs/benchmarks.md

BROWSER := chromium-headless-shell

browser: ## install the browser that the tests of the surgeon's page drive (Debian, as root)
	@command -v $(BROWSER) >/dev/null || { \
	  echo "installing $(BROWSER)" && apt-get update -qq && DEBIAN_FRONTEND=noninteractive \
	  apt-get install -qq --no-install-recommends $(BROWSER) fonts-dejavu-core >/dev/null; }

reference: $(VENV)/.installed-dev ## make the pages of docs/ anew that are made from the code
	$(BIN)/python -m manual

docs: $(VENV)/.installed-dev ## build the documentation as a site in build/site/
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

screenshots: $(VENV)/.installed-dev browser ## take the pictures of docs/tour.md anew
	$(BIN)/python -m benchmarks.page_pictures

dist: $(VENV)/.installed-dev ## build sdist and wheel into dist/
	$(BIN)/python -m build --no-isolation

extras: dist ## try each extra of the wheel alone, in an empty environment (long: it installs them all)
	$(BIN)/python -m release.extras

sbom: $(VENV)/.installed-dev ## write dist/sbom.cdx.json, a bill of materials of the pins
	$(BIN)/python -m release.sbom

licences: $(VENV)/.installed-dev ## write docs/licences.md
	$(BIN)/python -m release.licences

clean: ## remove what was built; runs/ stays
	rm -rf $(VENV) build dist .pytest_cache .ruff_cache .import_linter_cache .hypothesis
	find services tests benchmarks manual -name __pycache__ -type d -prune -exec rm -rf {} +
