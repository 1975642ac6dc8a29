# make demo   the Section 6 model, end to end          make test   the whole test suite
# make check  what CI runs: lint, types, tests, docs   make docs   the site, into docs/_build/html
# make bench  the times on the site's page on speed; FULL=1 adds the long sizes
# Needs Python >= 3.11 with pip, make and git; everything else goes into .venv, pinned by requirements.lock.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
PIP    := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint requirements.lock
NEEDS  := pyproject.toml requirements.lock ndtheory/__init__.py

.PHONY: demo test check lint docs nightly bench lock clean
.NOTPARALLEL:  # one pip at a time; pytest uses the processors itself

demo: $(VENV)/.run
	$(BIN)/ndtheory demo

test: $(VENV)/.test
	$(BIN)/python -m pytest -n auto --dist worksteal

check: $(VENV)/.docs lint test docs

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(VENV)/.docs
	$(BIN)/python -m sphinx -j auto -W --keep-going -q -b html docs docs/_build/html
	$(BIN)/python tests/docs/test_site.py docs/_build/html
	@echo "the site: docs/_build/html/index.html"

nightly: $(VENV)/.test
	HYPOTHESIS_PROFILE=nightly $(BIN)/python -m pytest -n auto --dist worksteal

bench: $(VENV)/.test
	for b in benchmarks/bench_*.py; do $(BIN)/python $$b --record benchmarks/records $(if $(FULL),--full) || exit 1; done

lock: $(VENV)/.venv
	$(PIP) uv
	$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --all-extras --no-header --output-file requirements.lock pyproject.toml

$(VENV)/.venv:
	$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or later is needed, this is " + sys.version.split()[0] if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv $(VENV)
	touch $@

$(VENV)/.run: $(VENV)/.venv $(NEEDS)
	$(PIP) --editable .
	touch $@

$(VENV)/.test: $(VENV)/.venv $(NEEDS)
	$(PIP) --editable '.[test]'
	touch $(VENV)/.run $@

$(VENV)/.docs: $(VENV)/.venv $(NEEDS)
	$(PIP) --editable '.[test,docs]'
	touch $(VENV)/.run $(VENV)/.test $@

clean:
	rm -rf $(VENV) docs/_build .pytest_cache .mypy_cache .ruff_cache .hypothesis
