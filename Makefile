# make        environment, then `snakemake all` on the built-in scenes
# make test   environment, then the whole test suite
# make lint   style, format and types
# make bench  environment, then times, memory and growth of the pipeline, to reports/
# make clean  remove results and everything else that was made, but for the environment

# the first Python here that is new enough
PYTHON := $(shell for p in python3 python3.11 python3.12 python3.13; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
BIN := .venv/bin
READY := .venv/ready

.PHONY: all test lint bench clean
.DEFAULT_GOAL := all

all: $(READY)
	$(BIN)/snakemake all

test: $(READY)
	$(BIN)/python -m pytest

lint: $(READY)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/snakefmt --line-length 120 --check Snakefile rules

bench: $(READY)
	$(BIN)/python -m sepi.bench run

clean:
	find reports -mindepth 1 ! -name README.md -delete
	rm -rf results logs benchmarks build *.egg-info .snakemake .pytest_cache .mypy_cache .ruff_cache .hypothesis

# pinned versions, then the package itself in place; again only when one of these files changes
$(READY): requirements.lock pyproject.toml
	@test -n "$(PYTHON)" || { echo "make: Python 3.11 or newer is needed (as python3 or python3.11)" >&2; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { \
		echo "make: $(PYTHON) lacks the module venv; on Debian: apt install python3-venv" >&2; exit 1; }
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	touch $@
