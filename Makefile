# dmpcli: set-up, tests, the demonstration and the paper's experiments.
#
#   make setup       the environment .venv, from pinned versions
#   make demo        one drag-taught stroke: record, fit, generalize, execute, report
#   make reproduce   the paper's experiments, flat and curved, target by target
#   make reproduce-force  force on surfaces that are not where the plan has them, in physics
#   make test        tests, ruff and import rules, in six minutes on two cores
#   make test-quick  the quick half of the tests
#   make test-thorough  those that take a minute each or go through all cases of a kind
#   make lint        ruff, import-linter and mypy: make rules and make types
#   make coverage    the quick half again, and which lines it does not run
#   make test-lowest the same with the lowest versions that pyproject.toml allows
#   make docs        the pages as a site, in out/docs/site; a warning is an error
#   make reference   docs/reference, from the program
#   make dist        sdist and wheel, checked, and the wheel tried in an environment without extras
#   make lock        the lock files, from pyproject.toml
#   make bench       the timings that the README quotes
#   make peers       the same beside other packages, in an environment of their own
#   make judges      the tests that programs of others judge, which make test does without
#   make pages       a report's pages in a headless browser: photographs in out/pages
#   make properties  what must hold for any input, on 1000 inputs of chance each (EXAMPLES=N)
#   make faults      10,000 seeded faults in simulated time: what must hold whatever fails
#   make soak        200 recordings killed at random: what is lost
#   make mutations   damaged and crafted inputs for every reader: what is not refused (MUTATIONS=N)
#   make mutants     small faults in the mathematics and the loops: which no test would notice
#   make cluster-demo  a batch on two Dask workers, one of which is killed
#
# Each sets up what it needs in .venv first. Choose by name: PYTHON=python3.12, VENV=DIR, OUT=DIR.

PYTHON ?= python3
VENV   ?= .venv
OUT    ?= out
LOCK   ?= requirements.lock
BIN    := $(VENV)/bin
DMPCLI := $(BIN)/dmpcli
CACHE  := $(OUT)/cache

ifneq ($(words $(VENV) $(OUT)),2)
$(error VENV and OUT may not have spaces in their names: make cannot tell them from two)
endif

# A shell that was set up for something else (ROS, for one) would mix its packages into ours, take the
# tests' folder off the path, their asserts out, or pytest's plugins away. An
# environment is made without byte code, which is kept as modules are used: without it, every process
# and every run of the tests would compile numpy, scipy and the tests anew.
unexport PYTHONPATH PYTHONHOME PYTHONDONTWRITEBYTECODE PYTHONSAFEPATH PYTHONOPTIMIZE PYTEST_DISABLE_PLUGIN_AUTOLOAD
export RUFF_CACHE_DIR := $(CACHE)/ruff
export MYPY_CACHE_DIR := $(CACHE)/mypy

.DELETE_ON_ERROR:
.SUFFIXES:
.PHONY: help setup docs reference demo reproduce reproduce-force test test-quick test-thorough coverage test-lowest lint rules types lock dist bench peers \
    judges pages properties faults soak mutations mutants cluster-demo samples pictures schemas clean FORCE

help:
	@sed -n 's/^#   //p' Makefile

# The environment, from pinned versions. What it was made with is looked at each time: PYTHON may
# have changed, and time stamps say nothing about that.

$(VENV)/installed: FORCE
	@sh tools/set_up.sh "$(PYTHON)" "$(VENV)" "$(LOCK)" "$(OUT)"

setup: $(VENV)/installed

# Tests. The quick half leaves out what is marked slow; make test leaves out what is marked thorough:
# kernels, which compile for a minute, clusters and laboratories in real time, and of sweeps all
# cases but a few. A file's tests stay in one process, so that what they share is made once. Rules
# are looked at meanwhile; types, which mypy takes a minute and a half for in a clone that is new,
# are a step of their own. Some tests wait in real time: so there are three processes to two cores,
# and of the thorough, which wait most, four; WORKERS=N chooses. In a clone that is new two processes
# make the asserts of half of the tests ready each, not all of them those of all; and linear algebra
# has one thread in each, since those of three processes would wait for one another, a tenth of the
# processor's time.

CORES := $(shell getconf _NPROCESSORS_ONLN)
PYTEST := $(BIN)/python -m pytest -o cache_dir=$(CACHE)/pytest
MANY  := --dist loadfile --no-loadscope-reorder --numprocesses
MORE  := $(MANY) $(or $(WORKERS),$(shell expr \( 3 \* $(CORES) + 1 \) / 2))
TWICE := $(MANY) $(or $(WORKERS),$(shell expr 2 \* $(CORES)))
QUICK := $(MORE) -m "not slow and not thorough"
FIND  := $(PYTEST) --collect-only -qq > /dev/null 2>&1
READY := [ -e $(CACHE)/collected ] || { $(FIND) tests/[a-d]*/ & half=$$!; $(FIND) tests/[e-z]*/ tests/*.py; \
    wait $$half; touch $(CACHE)/collected; }

test test-quick: export OPENBLAS_NUM_THREADS := 1
test: $(VENV)/installed
	@mkdir -p $(CACHE)
	@nice -n 5 $(MAKE) --no-print-directory rules > $(OUT)/lint.log 2>&1 & lint=$$!; \
	    $(READY); \
	    $(PYTEST) $(MORE) -m "not thorough"; tests=$$?; wait $$lint; linted=$$?; \
	    cat $(OUT)/lint.log; exit $$((tests | linted))

test-quick: $(VENV)/installed
	@mkdir -p $(CACHE); $(READY)
	$(PYTEST) $(QUICK)

test-thorough: $(VENV)/installed
	$(PYTEST) $(TWICE) -m thorough

coverage: export COVERAGE_FILE := $(CACHE)/coverage
coverage: $(VENV)/installed
	$(PYTEST) $(QUICK) --cov=dmpcli --cov-report=term:skip-covered --cov-report=html:$(OUT)/coverage

# The lowest versions that pyproject.toml allows.
test-lowest:
	$(MAKE) --no-print-directory test-quick VENV=$(OUT)/lowest/venv LOCK=requirements-lowest.lock

lint: rules types

rules: $(VENV)/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports --cache-dir $(CACHE)/import-linter

types: $(VENV)/installed
	$(BIN)/mypy

# The lock files, each for every Python from 3.11 on; UPGRADE=--upgrade takes the newest versions.

DIST := $(OUT)/dist
UV   := $(DIST)/tools/bin/uv pip compile --quiet --universal --python-version 3.11 --fork-strategy fewest \
    --no-annotate --custom-compile-command "make lock"

lock:
	@sh tools/set_up.sh "$(PYTHON)" "$(DIST)/tools" requirements-dist.lock "$(OUT)" bare
	$(UV) pyproject.toml --extra test -o requirements.lock $(UPGRADE)
	$(UV) pyproject.toml --extra test -o requirements-lowest.lock --resolution lowest-direct --upgrade
	$(UV) --group dist -o requirements-dist.lock $(UPGRADE)
	$(UV) --group docs -o requirements-docs.lock $(UPGRADE)

# What is handed out: built from one another, checked, and the wheel tried without extras.

dist:
	@sh tools/set_up.sh "$(PYTHON)" "$(DIST)/tools" requirements-dist.lock "$(OUT)" bare
	rm -rf $(DIST)/files
	SOURCE_DATE_EPOCH=946684800 $(DIST)/tools/bin/python -m build --no-isolation \
	    --outdir $(DIST)/files . > $(DIST)/build.log 2>&1 || { cat $(DIST)/build.log; exit 1; }
	$(DIST)/tools/bin/python -m twine check --strict $(DIST)/files/*
	$(DIST)/tools/bin/python -m check_wheel_contents $(DIST)/files/*.whl
	$(DIST)/tools/bin/python tools/check_wheel.py $(DIST)/files/*.whl $(DIST)/bare requirements.lock

# The site. Its pages need nothing of the program: what is made from it stands in docs/reference.

SITE := $(OUT)/docs

docs:
	@sh tools/set_up.sh "$(PYTHON)" "$(SITE)/tools" requirements-docs.lock "$(OUT)" bare
	rm -rf $(SITE)/site
	$(SITE)/tools/bin/python -m sphinx -W --keep-going -q -b html -d $(SITE)/cache docs $(SITE)/site
	@printf 'Look at file://%s\n' "$(abspath $(SITE))/site/index.html"

reference: $(VENV)/installed
	$(BIN)/python -m tools.reference

bench: export OPENBLAS_NUM_THREADS := 1
bench: $(VENV)/installed
	$(BIN)/python -m benchmarks.fit
	$(BIN)/python benchmarks/accuracy.py
	$(BIN)/python -m benchmarks.human_strokes
	$(BIN)/python -m benchmarks.noise
	$(BIN)/python -m benchmarks.noise_bounds
	$(BIN)/python -m benchmarks.alignment
	$(BIN)/python benchmarks/startup.py
	$(BIN)/python -m benchmarks.csv_reading
	$(BIN)/python -m benchmarks.mcap_import
	$(BIN)/python benchmarks/mesh_load.py
	$(BIN)/python -m benchmarks.surfaces
	$(BIN)/python -m benchmarks.taught_surfaces
	$(BIN)/python -m benchmarks.registration
	$(BIN)/python -m benchmarks.lateness
	$(BIN)/python -m benchmarks.live_view
	$(BIN)/python -m benchmarks.report_page
	$(BIN)/python -m benchmarks.batches $(OUT)/batches

# Programs of others that take long to install judge what export writes, in an environment of their own.

JUDGES := $(OUT)/judges/venv

judges:
	@sh tools/set_up.sh "$(PYTHON)" "$(JUDGES)" "$(LOCK)" "$(OUT)"
	$(JUDGES)/bin/python -m pip install --quiet --disable-pip-version-check -r tests/judges.txt
	@sh tools/linuxcnc.sh $(OUT)/judges/linuxcnc
	DMPCLI_JUDGES=required DMPCLI_LINUXCNC=$(OUT)/judges/linuxcnc $(JUDGES)/bin/python -m pytest -o cache_dir=$(CACHE)/pytest -p no:xdist \
	    tests/formats/test_outside_judges.py tests/formats/test_lerobot_dataset.py \
	    tests/metrics/test_pose_error.py tests/commands/test_report_pose_error.py \
	    tests/bench/test_description.py

# What people look at, looked at in headless Chromium (Debian: apt-get install chromium) at the widths
# of a phone and of a desk: nothing asked of the network, no error told, nothing wider than its window.

PAGES := $(OUT)/pages

pages: $(VENV)/installed
	@mkdir -p $(PAGES)
	$(DMPCLI) record -o $(PAGES)/demonstration.parquet --seed 1 -q
	$(DMPCLI) fit $(PAGES)/demonstration.parquet -o $(PAGES)/skill.json -q
	$(DMPCLI) generalize $(PAGES)/skill.json -o $(PAGES)/trajectory.parquet \
	    --start -701.698 132.420 -17.538 --goal -807.597 129.739 -17.518 --ease-in 0.5 --ease-out 0.5 -q
	$(DMPCLI) execute $(PAGES)/trajectory.parquet -o $(PAGES)/run.parquet --coupling force -q
	$(DMPCLI) generalize $(PAGES)/skill.json -o $(PAGES)/curved.parquet $(PAIR_CURVED) \
	    --surface $(BENCH) --orientation surface -q
	$(DMPCLI) generalize $(PAGES)/skill.json -o $(PAGES)/batch --pairs sample_runs/pairs.csv -q
	$(DMPCLI) report $(PAGES)/demonstration.parquet $(PAGES)/skill.json $(PAGES)/trajectory.parquet \
	    $(PAGES)/run.parquet -o $(PAGES)/run --view -q > $(PAGES)/run.txt
	$(DMPCLI) report $(PAGES)/demonstration.parquet $(PAGES)/curved.parquet --surface $(BENCH) \
	    -o $(PAGES)/curved --view -q > $(PAGES)/curved.txt
	$(DMPCLI) report $(PAGES)/demonstration.parquet $(PAGES)/batch -o $(PAGES)/many --view -q > $(PAGES)/many.txt
	$(BIN)/python tools/pages.py $(PAGES) $(foreach p,run curved many,$(PAGES)/$(p)/report.html $(PAGES)/$(p)/view.html)

# The tests do with 30 each. Where a test says how many itself, it is that many here too.
EXAMPLES ?= 1000

properties: $(VENV)/installed
	DMPCLI_EXAMPLES=$(EXAMPLES) $(PYTEST) $(TWICE) -m hypothesis

# One seed replays one failure: python -m tests.faults --seed N.
SEEDS ?= 10000

faults: $(VENV)/installed
	$(BIN)/python -m tests.faults --seeds $(SEEDS)

soak: $(VENV)/installed
	$(BIN)/python -m benchmarks.soak

# Of each reader; one number replays one: python -m benchmarks.mutations --again READER NUMBER.
MUTATIONS ?= 2000

mutations: $(VENV)/installed
	$(BIN)/python -m benchmarks.mutations --count $(MUTATIONS) --keep $(OUT)/mutations

# docs/mutants.md; SEED=N draws the same ones again, and goes on where a run was stopped.
MUTANTS ?= 500
JOBS    ?= 1

mutants: $(VENV)/installed
	nice -n 19 $(BIN)/python -m tools.mutants --count $(MUTANTS) --jobs $(JOBS) $(if $(SEED),--seed $(SEED))

# Beside other packages. Where the index at hand has no CPU build of torch, torch's own has.

PEERS := $(OUT)/peers

peers:
	@sh tools/set_up.sh "$(PYTHON)" "$(PEERS)/venv" benchmarks/peers/requirements.txt "$(OUT)" open \
	    https://download.pytorch.org/whl/cpu
	$(PEERS)/venv/bin/python -W ignore -m benchmarks.peers > $(PEERS)/peers.md
	cp $(PEERS)/peers.md docs/peers.md
	@cat docs/peers.md

# A batch on two workers, one of which is killed on the way.

cluster-demo: $(VENV)/installed
	$(BIN)/python benchmarks/cluster_demo.py $(OUT)/cluster

# One stroke through the whole tool-chain, against the mock lab.

DEMO := $(OUT)/demo

demo: $(VENV)/installed
	@mkdir -p $(DEMO)
	$(DMPCLI) record -o $(DEMO)/demonstration.parquet --seed 1
	$(DMPCLI) fit $(DEMO)/demonstration.parquet -o $(DEMO)/skill.json
	$(DMPCLI) generalize $(DEMO)/skill.json -o $(DEMO)/trajectory.parquet \
	    --start -701.698 132.420 -17.538 --goal -807.597 129.739 -17.518 --ease-in 0.5 --ease-out 0.5
	$(DMPCLI) execute $(DEMO)/trajectory.parquet -o $(DEMO)/run.parquet
	$(DMPCLI) report $(DEMO)/demonstration.parquet $(DEMO)/trajectory.parquet $(DEMO)/run.parquet \
	    -o $(DEMO)/report
	$(DMPCLI) generalize $(DEMO)/skill.json -o $(DEMO)/batch --pairs sample_runs/pairs.csv
	$(DMPCLI) report $(DEMO)/demonstration.parquet $(DEMO)/batch -o $(DEMO)/batch-report
	@page=$(DEMO)/report/report.html; [ -f "$$page" ] || page=$(DEMO)/report; \
	    printf '\nLook at file://%s\n' "$(abspath $(DEMO))$${page#$(DEMO)}"

# The paper's flat experiments (section 3.2.1): Tables 1 and 2, Figures 5 to 8; the curved one
# (section 3.2.2): Figure 9; and the drag comparison of Figures 3 and 4. Twice: from the noise-free
# reference stroke, and from a stroke recorded with the mock lab.

STROKES    := reference recorded
SKILLS     := modified ridge paper axis distance
PAIR_1     := --reproduce
PAIR_2     := --start -701.698 132.420 -17.538 --goal -807.597 129.739 -17.518
PAIR_CURVED := --start -551.698 -37.580 -28.765 --goal -657.597 -43.254 -32.265
BENCH      := sample_runs/bench.stl
CURVED     := modified axis distance
FIT_modified :=
FIT_ridge    := --regression ridge
FIT_paper    := --preset paper
FIT_axis     := --preset paper --model original --forcing-scale axis
FIT_distance := --preset paper --model original --forcing-scale distance
R          := $(OUT)/reproduce
DRAW_modified := --orientation surface
REPORTS    := $(foreach s,$(STROKES),$(R)/$(s)/report/report.json $(R)/$(s)/curved/report.json)

reproduce: $(REPORTS) $(STROKES:%=$(R)/%/tables.txt) $(R)/drag/report/report.json $(R)/drag/tables.txt
	@for stroke in $(STROKES); do \
	    printf '\n== Tables 1 and 2 from the %s stroke ==\n' $$stroke; \
	    cat $(R)/$$stroke/tables.txt; \
	    printf '\n== Figure 9 from the %s stroke ==\n' $$stroke; \
	    cat $(R)/$$stroke/curved.txt; \
	done
	@printf '\n== Admittance drag and built-in drag (Figures 3 and 4) ==\n'
	@cat $(R)/drag/tables.txt

# Needs dmpcli[bench], which the environment of the tests has; SEEDS=5.

SEEDS ?= 5

reproduce-force: export OPENBLAS_NUM_THREADS := 1
reproduce-force: $(VENV)/installed
	@mkdir -p $(R)
	$(BIN)/python -m benchmarks.force surfaces --seeds $(SEEDS) | tee $(R)/force.md

define FIT_RULES
$(R)/$(1)/$(2).json: sample_runs/$(1).parquet | $(VENV)/installed
	@mkdir -p $$(@D)
	$(DMPCLI) fit $$< -o $$@ $(FIT_$(2))
$(R)/$(1)/$(2)-table1.parquet: $(R)/$(1)/$(2).json
	$(DMPCLI) generalize $$< -o $$@ $(PAIR_1)
$(R)/$(1)/$(2)-table2.parquet: $(R)/$(1)/$(2).json
	$(DMPCLI) generalize $$< -o $$@ $(PAIR_2)
endef
$(foreach stroke,$(STROKES),$(foreach skill,$(SKILLS),$(eval $(call FIT_RULES,$(stroke),$(skill)))))

define CURVED_RULE
$(R)/$(1)/$(2)-fig9.parquet: $(R)/$(1)/$(2).json $(BENCH)
	$(DMPCLI) generalize $$< -o $$@ $(PAIR_CURVED) --surface $(BENCH) $(DRAW_$(2))
endef
$(foreach stroke,$(STROKES),$(foreach skill,$(CURVED),$(eval $(call CURVED_RULE,$(stroke),$(skill)))))

define REPORT_RULE
$(R)/$(1)/report/report.json $(R)/$(1)/tables.txt &: sample_runs/$(1).parquet \
    $(foreach t,1 2,$(SKILLS:%=$(R)/$(1)/%-table$(t).parquet))
	$(DMPCLI) report $$^ --paper -o $(R)/$(1)/report > $(R)/$(1)/tables.txt
$(R)/$(1)/curved/report.json $(R)/$(1)/curved.txt &: sample_runs/$(1).parquet \
    $(CURVED:%=$(R)/$(1)/%-fig9.parquet)
	$(DMPCLI) report $$^ --paper --surface $(BENCH) -o $(R)/$(1)/curved > $(R)/$(1)/curved.txt
endef
$(foreach stroke,$(STROKES),$(eval $(call REPORT_RULE,$(stroke))))

$(R)/drag/builtin.parquet: sample_runs/recorded.toml | $(VENV)/installed
	@mkdir -p $(@D)
	$(DMPCLI) record -o $@ --config $< --drag builtin --seed 1
$(R)/drag/report/report.json $(R)/drag/tables.txt &: sample_runs/recorded.parquet \
    $(R)/drag/builtin.parquet
	$(DMPCLI) report $^ --paper -o $(R)/drag/report > $(R)/drag/tables.txt

# The README's pictures.

pictures: reproduce
	@mkdir -p docs/images
	$(DMPCLI) generalize $(R)/reference/modified.json -o $(R)/star --pairs sample_runs/pairs.csv
	$(DMPCLI) report sample_runs/reference.parquet $(R)/star --paper -o $(R)/star-report -q > $(R)/star.txt
	cp $(R)/star-report/fig8_generalization_plane.png docs/images/one_stroke_many_places.png
	$(DMPCLI) report sample_runs/reference.parquet $(R)/reference/paper-table2.parquet \
	    $(R)/reference/distance-table2.parquet --paper -o $(R)/table2-report -q > $(R)/table2.txt
	cp $(R)/table2-report/fig8_generalization_plane.png docs/images/table2.png
	cp $(R)/reference/curved/fig9_surface.png docs/images/fig9.png
	cp $(R)/drag/report/fig4_drag_plane.png docs/images/drag.png

# The sample runs are kept in the repository; this makes them again, byte for byte.

samples: $(VENV)/installed
	$(BIN)/python sample_runs/make_reference.py sample_runs/reference.parquet
	$(BIN)/python sample_runs/make_surfaces.py sample_runs
	$(DMPCLI) record -o sample_runs/recorded.parquet --config sample_runs/recorded.toml --seed 1

schemas: $(VENV)/installed
	$(BIN)/python -m dmpcli.records.json_schema

clean:
	rm -rf $(OUT)
