# make        environment, then `snakemake all` on the built-in scenes
# make check  environment, then the fast part of the tests: for every save
# make test   environment, then the whole test suite, on all cores
# make faults  environment, then a hundred kills of the workflow and thousands of damaged files: half an hour
# make fuzz   environment, then an hour (SECONDS=3600) of files made to trip the readers, led by what code they reach
# make coverage  the whole test suite, and the share of lines and branches that it runs
# make lint   style, format, types and imports
# make docs   environment, then the site of docs/, to build/docs/index.html: minutes, of which a second time few
# make docs-links  whether the addresses in it answer; needs the network
# make bench  environment, then times, memory and growth of the pipeline, to reports/
# make clean  remove results and everything else that was made, but for the environment

# the first Python here that is new enough
PYTHON := $(shell for p in python3 python3.11 python3.12 python3.13; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
BIN := .venv/bin
READY := .venv/ready

COMPARED := .venv/compared

.PHONY: all check test faults fuzz coverage lint docs docs-links demo bench clean
.DEFAULT_GOAL := all

all: $(READY)
	$(BIN)/snakemake all

# a worker of pytest for each core and one more, since tests of clusters and of killed runs wait most of the time; one thread
# in each; of numba's threads tests/conftest.py takes care
WORKERS = $(shell $(PYTHON) -c 'import os; print((os.cpu_count() or 1) + 1)')
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
TESTS := $(ONE_THREAD) $(BIN)/python -m pytest --numprocesses $(WORKERS)

check: $(COMPARED)
	$(TESTS) -m "not real and not workflow and not browser and not slow"

test: $(COMPARED)
	$(TESTS)

# what `make test` does a few times, a hundred times
faults: $(READY)
	$(ONE_THREAD) SEPI_FAULTS=100 $(BIN)/python -m pytest tests/faults tests/fuzz tests/io/test_damage.py

# not among the pinned versions: nothing else needs it
SECONDS ?= 3600
fuzz: $(READY)
	$(BIN)/python -c 'import atheris' 2>/dev/null || $(BIN)/python -m pip install --quiet --editable '.[fuzz]'
	$(ONE_THREAD) $(BIN)/python tests/fuzz/guided.py --seconds $(SECONDS)

# absolute, since tests start processes elsewhere
coverage: export COVERAGE_RCFILE := $(CURDIR)/pyproject.toml
coverage: export COVERAGE_FILE := $(CURDIR)/build/coverage/data
coverage: $(COMPARED)
	rm -rf build/coverage
	mkdir -p build/coverage
	$(ONE_THREAD) $(BIN)/coverage run -m pytest --numprocesses $(WORKERS); status=$$?; \
	$(BIN)/coverage combine --quiet && $(BIN)/coverage report --skip-covered --skip-empty; exit $$status

lint: $(READY)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo --no-cache
	$(BIN)/snakefmt --line-length 120 --check Snakefile rules

# warnings are errors; what nothing changed of is not made again
SITE := $(BIN)/python -m sphinx -W --keep-going --quiet -d build/docs-read -t demo
docs: $(READY) docs/_made/said-of-order.txt demo
	$(ONE_THREAD) $(SITE) -b html docs build/docs
	mkdir -p build/docs/demo
	cp build/demo/reports/index.html build/docs/demo/
	@echo "build/docs/index.html"

docs-links: $(READY) docs/_made/said-of-order.txt
	$(SITE) -t quick -b linkcheck docs build/docs-links

# drawings and what the pages quote; this file is the last
docs/_made/said-of-order.txt: $(READY) docs/make_pictures.py $(wildcard docs/pictures/*.py) $(shell find sepi -name '*.py')
	$(BIN)/python docs/make_pictures.py docs/_made

# the report of two small scenes, which the site shows
demo: $(READY)
	$(BIN)/snakemake --directory build/demo \
		--config 'builtin={size: 96, scenes: [pyramids, curved_occluders]}' -- reports/index.html

bench: $(READY)
	$(BIN)/python -m bench run

clean:
	find reports -mindepth 1 ! -name README.md -delete
	rm -rf docs/_made docs/examples docs/reference/api docs/reference/api.md
	rm -rf results logs benchmarks build *.egg-info .snakemake .pytest_cache .mypy_cache .ruff_cache .hypothesis

# pinned versions, then the package itself in place and its kernels compiled; again only when one of these files changes
$(READY): requirements.lock pyproject.toml
	@test -n "$(PYTHON)" || { echo "make: Python 3.11 or newer is needed (as python3 or python3.11)" >&2; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { \
		echo "make: $(PYTHON) lacks the module venv; on Debian: apt install python3-venv" >&2; exit 1; }
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	$(BIN)/python -m sepi.cli.warm_up
	touch $@

# the kernels of the compared methods: only their target and the tests call them
$(COMPARED): $(READY)
	$(BIN)/python -m sepi.cli.warm_up --comparison
	touch $@
