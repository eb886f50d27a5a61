# `make demo`, `make test` and `make test-slow` each do all the set-up they need. `make help` lists the rest.
# Stamps in .venv/ and node_modules/ keep a second run from downloading anything.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check
WEB := viewer_web
SCENE ?=
OUT ?= out
export PYTHON
# Images of containers set it. Every process of Python would then compile every module anew: five seconds instead of two
# for what a plan imports, in each of the hundreds of processes that the tests start.
unexport PYTHONDONTWRITEBYTECODE
# Debian 12's Node.js is too old to build the viewer: there npm brings a newer one, pinned in requirements/node.
export PATH := $(CURDIR)/requirements/node/node_modules/.bin:$(PATH)
NODE_IS_NEW := node -e 'const [a, b] = process.versions.node.split(".").map(Number); process.exit(a > 20 || (a === 20 && b >= 19) ? 0 : 1)'

RUNTIME := $(VENV)/.runtime-installed
DEV := $(VENV)/.dev-installed
BUILD := $(WEB)/node_modules/.build-installed
NODE := $(WEB)/node_modules/.installed
VIEWER := $(WEB)/dist/index.html
VIEWER_SOURCES := $(shell find $(WEB)/src $(WEB)/public -type f 2>/dev/null) \
  $(wildcard $(WEB)/*.json $(WEB)/*.ts $(WEB)/*.js $(WEB)/*.html)

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help intel demo test test-slow test-machines check setup viewer system system-tests system-firefox system-kernel-check lint typecheck \
  imports pytest pytest-slow pytest-campaign web web-check web-main e2e e2e-firefox e2e-scenes bench bench-roofline bench-patch-mode bench-genetic bench-selection bench-row-weighting bench-selection-large \
  bench-drivers bench-planning bench-channels bench-registration bench-registration-plans bench-drawings bench-stages bench-crew bench-truth bench-live bench-clouds bench-cluster bench-area bench-scale bench-paper-scale bench-gpu bench-gpu-pack reproduce plan-scenes \
  campaigns golden test-repeatedly mutants soak soak-server fuzz faults kernel-check wheel test-wheel docs api-types lock test-bare clean

help: ## list the targets
	@grep -hE '^[a-z0-9-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 24

# ------------------------------------------------------------------------------------------------ use
demo: setup ## plan a synthetic two-storey house, or your own building with SCENE=path/to/building.ifc
	@if [ -n "$(SCENE)" ]; then \
	  $(BIN)/tlsplan plan "$(SCENE)" -o "$(OUT)/$$(basename "$(SCENE)" | sed 's/\.[^.]*$$//')" --overwrite; \
	else \
	  $(BIN)/tlsplan demo -o "$(OUT)/demo" --overwrite; \
	fi

setup: $(RUNTIME) $(VIEWER) ## everything that using tlsplan from this checkout needs: .venv/bin/tlsplan
intel: $(RUNTIME) ## Intel's OpenCL runtime for processors beside PoCL: 0.8 GB, under Intel's own licence
	$(PIP) install --quiet --no-deps --require-hashes -r requirements/intel.lock
viewer: $(VIEWER) ## build the browser application

# ----------------------------------------------------------------------------------------------- test
# Every test is in one of two tiers; CONTRIBUTING.md says which, and tests/test_tiers.py keeps it so.
SKIPPED := build/skipped-tests.txt
export SKIPPED_TESTS := $(CURDIR)/$(SKIPPED)

# Runs make, then lists the tests that were skipped, whether the others passed or failed.
define make_and_list_skipped
@mkdir -p build && : > $(SKIPPED)
@$(1); failed=$$?; if [ -s $(SKIPPED) ]; then cat $(SKIPPED); else echo "no test skipped"; fi; exit $$failed
endef

test: setup system-tests $(DEV) $(NODE) ## a test of every promise, in minutes: checks, all tests but the slow ones, the browser's main paths
	@$(MAKE) --no-print-directory -j2 --output-sync=target check web-check
	$(call make_and_list_skipped,$(MAKE) --no-print-directory --keep-going pytest web-main)

test-slow: setup $(DEV) $(NODE) ## the rest: the slow Python tests, among them a witness of each campaign, and all browser tests
	$(call make_and_list_skipped,$(MAKE) --no-print-directory --keep-going pytest-slow e2e)

# Hours on a quiet machine, before a release: docs/reliability.md has the figures of the last run. Where one fails the
# others go on.
CAMPAIGNS := pytest-campaign test-machines kernel-check faults fuzz soak soak-server test-repeatedly test-bare e2e-firefox
campaigns: ## every campaign in full: other machines, oclgrind, faults, fuzzing, soaks, random orders, bare Debian, Firefox
	@$(MAKE) --no-print-directory --keep-going $(CAMPAIGNS)

# Machines unlike this one: tests/machines/README.md.
ON_UNKNOWN_PROCESSOR := tests/device tests/kernels tests/engine/test_engines.py tests/engine/test_tree.py
WITHOUT_OPENCL := tests/select tests/planning/live tests/requirements tests/planning/test_proven_method.py tests/planning/test_plan_network.py tests/planning/test_plan_interrupt.py

test-machines: setup $(DEV) ## the demo, and a part of the suite, as on an unknown processor and without OpenCL
	$(BIN)/python tests/machines/demo_everywhere.py $(OUT)/machines
	PYTHONPATH=$(CURDIR)/tests/machines/unknown_processor $(PYTEST) -m "not slow" $(ON_UNKNOWN_PROCESSOR)
	PYTHONPATH=$(CURDIR)/tests/machines/no_driver $(PYTEST) -m "not slow" $(WITHOUT_OPENCL)

check: lint typecheck imports ## the static checks of the Python code

lint: $(DEV)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

# Without the collector of cycles, which mypy switches on: it takes a quarter of the time. 2 GB of memory instead of 0.7.
MYPY := $(BIN)/python -c 'import gc; gc.disable(); gc.enable = gc.disable; from mypy.main import main; main()'

typecheck: $(DEV)
	$(MYPY)

imports: $(DEV)
	$(BIN)/lint-imports

# Two workers at a time: threads of linear algebra would wait for each other.
PYTEST := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -q -n 2 --dist loadgroup

pytest: $(DEV) $(VIEWER) system-tests ## the Python tests but the slow ones
	$(PYTEST) -m "not slow" $(PYTEST_ARGS)

pytest-slow: $(DEV) $(VIEWER) system-tests system-kernel-check ## the slow Python tests
	$(PYTEST) -m "slow and not campaign" $(PYTEST_ARGS)

pytest-campaign: $(DEV) $(VIEWER) system-tests ## more scenes, seeds, workers and formats of what both tiers test
	$(PYTEST) -m campaign $(PYTEST_ARGS)

TIMES ?= 10
test-repeatedly: $(DEV) $(VIEWER) system-tests ## the quick Python tests in ten random orders beside three busy processes; TIMES=3 SEED=7
	@for each in 1 2 3; do (while :; do :; done) & busy="$$busy $$!"; done; trap "kill $$busy" EXIT; trap 'exit 130' INT TERM; \
	first=$(or $(SEED),$$(date +%s)); for seed in $$(seq $$first $$((first + $(TIMES) - 1))); do \
	  echo "test-repeatedly: random order $$seed"; \
	  $(PYTEST) --no-loadscope-reorder -m "not slow" --exitfirst --random-order $$seed $(PYTEST_ARGS) || \
	    { echo "test-repeatedly: failed; make test-repeatedly TIMES=1 SEED=$$seed has the same order"; exit 1; }; \
	done

golden: $(DEV) $(VIEWER) ## which files differ from tests/golden/digests.txt: plans, exports, help, schemas; ACCEPT=1 records them as they are
	$(BIN)/pytest -q tests/golden $(PYTEST_ARGS)

mutants: $(DEV) $(VIEWER) ## how many of sixty random faults in product code the quick Python tests notice; an hour; goes on where it was interrupted
	[ -d build/mutants/rows ] || $(BIN)/python -m tests.mutants record build/mutants
	$(BIN)/python -m tests.mutants count build/mutants

web: web-check web-main ## the checks and tests of the viewer, and its main paths in a real browser

web-check: $(NODE)
	cd $(WEB) && npm run --silent lint && npm run --silent typecheck && npm run --silent test

web-main: $(NODE) $(VIEWER) $(DEV) system-tests
	cd $(WEB) && npm run --silent e2e:main

e2e: $(NODE) $(VIEWER) $(DEV) system-tests system-firefox ## the viewer in a real browser, its main paths apart
	cd $(WEB) && npm run --silent e2e

e2e-firefox: $(NODE) $(VIEWER) $(DEV) system-firefox ## more of the viewer in Firefox
	cd $(WEB) && npm run --silent e2e:firefox

# Plans of whole scenes: made once, in minutes, and kept. The duplex is not part of the repository.
SCENES := $(OUT)/e2e-scenes
DUPLEX := $(wildcard ../shared/data/ifc/duplex.ifc)
SCENE_PLANS := $(SCENES)/school/plan.json $(if $(DUPLEX),$(SCENES)/duplex/plan.json)

e2e-scenes: $(NODE) $(VIEWER) $(DEV) system-tests $(SCENE_PLANS) ## the viewer in a real browser on a duplex and on a synthetic school
	$(if $(DUPLEX),,@echo "e2e-scenes: no ../shared/data/ifc/duplex.ifc, so the school alone")
	cd $(WEB) && TLSPLAN_E2E_SCENES="$(abspath $(SCENES))" npm run --silent e2e:scenes

$(SCENES)/school.ifc: | $(RUNTIME)
	mkdir -p $(SCENES) && $(BIN)/tlsplan scene school -o $@ --quiet

$(SCENES)/school/plan.json: $(SCENES)/school.ifc | $(RUNTIME)
	$(BIN)/tlsplan plan $< -o $(@D) --overwrite --scanner rtc360:40mm --floor F1 --grid 2.5 --height 1.6 --patch-area 0.25 --method greedy

$(SCENES)/duplex/plan.json: $(DUPLEX) | $(RUNTIME)
	$(BIN)/tlsplan plan $< -o $(@D) --overwrite --scanner rtc360:40mm --grid 0.8 --height 1.6 --set work_limit=10

reproduce: $(RUNTIME) ## the method paper's figures, those alone whose settings changed; hours; writes docs/reproduction
	$(BIN)/tlsplan reproduce all --resume -o docs/reproduction $(REPRODUCE_ARGS)

bench: $(DEV) ## scan engine against Open3D; writes docs/benchmarks
	$(BIN)/python -m tests.benchmarks.bench_scan --write docs/benchmarks/scan.md

bench-roofline: $(DEV) system-kernel-check ## kernels against what the processor can do at most; needs oclgrind; writes docs/benchmarks
	$(BIN)/python -m tests.benchmarks.bench_roofline --write docs/benchmarks/roofline.md

bench-drivers: $(DEV) ## OpenCL drivers beside each other, and the host without any; writes docs/benchmarks
	$(BIN)/python -m tests.benchmarks.bench_drivers --write docs/benchmarks/drivers.md

bench-patch-mode: $(DEV) ## patch mode against beams; writes docs/benchmarks
	$(BIN)/python tests/benchmarks/bench_patch_mode.py --write docs/benchmarks/patch-mode.md

bench-genetic: $(DEV) ## genetic selection against its host version and DEAP; writes docs/benchmarks
	$(BIN)/python tests/benchmarks/bench_genetic.py --write docs/benchmarks/genetic.md

bench-real-buildings: $(DEV) ## floors and plans of models that nobody here made (MODELS=folder: those of real_models.csv in it); keeps plans in build/
	$(BIN)/python -m tests.benchmarks.$(if $(MODELS),bench_real_models $(MODELS),bench_real_buildings) --write docs/benchmarks/real-buildings.md

bench-registration: $(DEV) ## how often pairs of scans register; hours; MINUTES=60; writes docs/benchmarks; goes on where it was interrupted
	$(PIP) install --quiet --no-deps --require-hashes -r requirements/registration.lock
	$(BIN)/python -m tests.benchmarks.bench_registration $(if $(MINUTES),--minutes $(MINUTES)) --write docs/benchmarks/registration.md

bench-registration-plans: $(DEV) ## whether default plans of ten buildings register as they are set up; an hour; writes docs/benchmarks
	$(PIP) install --quiet --no-deps --require-hashes -r requirements/registration.lock
	$(BIN)/python -m tests.benchmarks.bench_registration_plans --write docs/benchmarks/registration.md

bench-drawings: $(DEV) ## floor plans as DXF, PDF and pictures, read back, and plans from them; writes docs/benchmarks
	$(BIN)/python -m tests.benchmarks.bench_drawings --write docs/benchmarks/drawings.md
	$(BIN)/python -m tests.benchmarks.bench_galleries --write docs/benchmarks/drawings.md

bench-stages: $(DEV) ## processor time of quick plans of buildings by stage; writes docs/benchmarks
	$(BIN)/python -m tests.benchmarks.bench_stages --write docs/benchmarks/where-time-goes.md

bench-crew: $(DEV) ## how long somebody waits for a plan of duplex, first, again and by default; BESIDE=another checkout; writes docs/benchmarks
	$(BIN)/python -m tests.benchmarks.bench_stages --crew $(if $(BESIDE),--beside "$(BESIDE)") --write docs/benchmarks/where-time-goes.md

bench-truth: $(DEV) ## plans' figures beside those of random points; writes docs/benchmarks
	$(BIN)/python -m tests.benchmarks.bench_truth --write docs/benchmarks/truth.md
	PYTHONPATH=. $(BIN)/python tests/benchmarks/bench_counting.py --write docs/benchmarks/truth.md

bench-row-weighting: $(DEV) ## annealing against row weighting and OR-Tools; writes docs/method
	$(PIP) install --quiet --no-deps --require-hashes -r requirements/tlsplib.lock
	$(BIN)/python tests/benchmarks/bench_row_weighting.py --write docs/method/selection.md

bench-selection: $(DEV) ## proven selection against greedy and genetic selection; writes docs/benchmarks
	$(BIN)/python tests/benchmarks/bench_selection.py --write docs/benchmarks/selection.md

bench-selection-large: $(DEV) ## selection of large problems: time, memory, stations; writes docs/benchmarks
	$(BIN)/python tests/benchmarks/bench_selection_large.py --write docs/benchmarks/selection-large.md

bench-planning: $(DEV) ## the whole planner against its rivals on every scene; writes docs/benchmarks; goes on where it was interrupted
	$(BIN)/python tests/benchmarks/bench_planning.py --write docs/benchmarks/planning.md

bench-channels: $(DEV) ## the HDL-64E's channels, even and nominal; writes a table of docs/method/paper.md
	PYTHONPATH=. $(BIN)/python tests/benchmarks/bench_channels.py --write docs/method/paper.md

bench-live: $(DEV) ## how fast a dragged station is answered; writes docs/benchmarks
	$(BIN)/python tests/benchmarks/bench_live.py --write docs/benchmarks/live.md

bench-clouds: $(DEV) ## clouds of 10 and 100 million beams in every format: memory, time, size; writes docs/benchmarks
	$(BIN)/python tests/benchmarks/bench_clouds.py --write docs/benchmarks/clouds.md

bench-cluster: $(DEV) ## work over Dask workers: what a task costs and ships; writes docs/benchmarks
	$(BIN)/python tests/benchmarks/bench_cluster.py --write docs/benchmarks/cluster.md

bench-area: $(DEV) ## time and memory of planning the campus against its floor area; writes docs/benchmarks; goes on where it was interrupted
	$(BIN)/python -m tests.benchmarks.bench_area --write docs/benchmarks/area.md

bench-scale: $(DEV) ## time and memory from 10^4 to 3 * 10^7 triangles; writes docs/benchmarks; goes on where it was interrupted
	$(BIN)/python -m tests.benchmarks.bench_scale --write docs/benchmarks/scale.md --memory 600MB

# The machine with the GPU may have neither network nor Open3D: what is packed here, wheels for its Python included,
# goes there beside the checkout.
GPU ?= build/gpu
GPU_PYTHON ?= 3.12
GPU_WHEELS := pyopencl pytools platformdirs siphash24 pydantic pydantic-core annotated-types typing-inspection typing-extensions pyyaml

bench-gpu-pack: $(DEV) ## what bench-gpu takes to another machine: scenes, Open3D's results, wheels; GPU=folder GPU_PYTHON=3.12
	$(BIN)/python -m tests.benchmarks.bench_gpu pack $(GPU)
	$(PIP) download --quiet --no-deps --only-binary=:all: --python-version $(GPU_PYTHON) --implementation cp \
	  $(foreach tag,manylinux_2_28 manylinux_2_27 manylinux_2_17 manylinux2014,--platform $(tag)_x86_64) -d $(GPU)/wheels \
	  $$($(PIP) list --format=freeze | grep -iE '^($(shell echo $(GPU_WHEELS) | sed 's/-/[-_]/g; s/ /|/g'))==')

# No prerequisite: it runs where nothing can be installed.
bench-gpu: ## kernels, tests and the paper's scale on a GPU, in eight minutes, from what bench-gpu-pack made; writes docs/benchmarks
	$(PYTHON) tests/benchmarks/bench_gpu.py run $(GPU) --write $(GPU)/results.json
	$(PYTHON) tests/benchmarks/bench_gpu.py page $(GPU)/results.json --write docs/benchmarks/gpu.md

PAPER_SCALE ?=
bench-paper-scale: $(DEV) ## visibility of 10 000 candidates in 2.6 million triangles; less with PAPER_SCALE="--candidates 100"
	$(BIN)/python -m tests.benchmarks.bench_paper_scale $(PAPER_SCALE)

plan-scenes: $(DEV) ## every synthetic scene through `tlsplan plan`; writes docs/benchmarks; goes on where it was interrupted
	$(BIN)/python tests/scenes_synthetic/plan_all_scenes.py --write docs/benchmarks/scenes.md

soak: $(DEV) ## a hundred million beams at shared edges and vertices, none may leak; goes on where it was interrupted
	$(BIN)/python tests/soak/soak_watertight.py --write docs/benchmarks/watertight.md

# A count, not a time: what is tried does not depend on the machine.
FUZZ_ARGS ?= --count 2000 --minutes 180
FUZZ_PATTERNS_ARGS ?= --count 2000 --minutes 60
FUZZ_DOCUMENTS_ARGS ?= --count 200000 --minutes 60
fuzz: $(DEV) ## scenes and documents changed at random, faults that programs write into IFC; FUZZ_ARGS="--minutes 240 --seed 7 --real" for other changes
	$(BIN)/python -m tests.fuzz.fuzz_scenes $(FUZZ_ARGS)
	$(BIN)/python -m tests.fuzz.fuzz_ifc_patterns $(FUZZ_PATTERNS_ARGS)
	$(BIN)/python -m tests.fuzz.fuzz_documents $(FUZZ_DOCUMENTS_ARGS)

FAULTS_ARGS ?= --each 5 --seed 1
faults: $(DEV) ## commands under kills, full and broken disks, clocks that jump; FAULTS_ARGS="--each 50 --seed 7" for hours
	$(BIN)/python -m tests.faults.campaign $(FAULTS_ARGS)

soak-server: $(DEV) ## a long-running viewer's server, and one under attack: memory, open files, answers; writes docs/benchmarks
	$(BIN)/python tests/soak/soak_server.py --write docs/benchmarks/server.md

kernel-check: $(DEV) system-kernel-check ## all kernels under oclgrind: memory, races, uninitialised values
	$(BIN)/python tests/kernels/check_kernels.py

# ---------------------------------------------------------------------------------------------- build
wheel: $(DEV) $(VIEWER) ## the wheel, with kernels and the built viewer inside
	rm -rf build dist
	$(BIN)/python -m build --wheel --no-isolation --outdir dist

test-wheel: wheel ## install the wheel into an empty environment without node, and plan the demo with it
	rm -rf build/wheel-test && $(PYTHON) -m venv build/wheel-test
	build/wheel-test/bin/python -m pip install --quiet dist/*.whl
	cd build/wheel-test && PATH="$$PWD/bin:/usr/bin:/bin" bin/tlsplan demo -o demo --grid 1 --height 1.5 && bin/tlsplan doctor

test-bare: ## `make demo`, `test-wheel` and `test` on bare Debian 12 and 13, made by debootstrap; needs root; not part of `make test`
	tests/bare_systems/run.sh $(SYSTEMS)

docs: $(DEV) $(VIEWER) ## regenerate the command line reference, the JSON Schemas of documents, and what README, tutorial and how-tos quote
	$(BIN)/python -m tlsplan.reference docs/reference/cli.md
	$(BIN)/python -m tlsplan.formats_reference docs/formats/field-pack/index.md
	$(BIN)/python -m tlsplan.commands.scanners docs/reference/scanners.md
	$(BIN)/python -m tlsplan.document_schemas docs/formats
	WRITE_DOCS=1 $(BIN)/pytest -q tests/docs/test_docs.py -k pages_quote

api-types: $(DEV) $(NODE) ## regenerate the description of the viewer's interface, and the types made from it
	$(BIN)/python -m viewer_web.server.openapi $(WEB)/src/api/openapi.json
	cd $(WEB) && npx biome format --write src/api/openapi.json && npm run --silent types

LOCK_OPTIONS ?= --upgrade
lock: $(RUNTIME) ## resolve the pinned dependencies anew; LOCK_OPTIONS= keeps every version that still fits
	$(PIP) install --quiet uv
	for name in runtime dev intel cluster tlsplib registration; do \
	  $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url \
	    --no-emit-find-links --no-header --excludes requirements/excluded.txt $(LOCK_OPTIONS) \
	    requirements/$$name.in $$(case $$name in intel) ;; cluster) echo -c requirements/dev.lock;; tlsplib|registration) echo -c requirements/runtime.lock;; *) echo requirements/checkout.in;; esac) -o requirements/$$name.lock || exit 1; \
	done

clean: ## remove everything that the other targets made
	rm -rf $(VENV) $(WEB)/node_modules requirements/node/node_modules $(WEB)/dist build dist $(OUT) .mypy_cache .pytest_cache .ruff_cache .hypothesis

# --------------------------------------------------------------------------------------------- set-up
system:
	@requirements/system.sh

system-tests: system
	@requirements/system.sh --tests || echo "Chromium can't be installed here, its tests are skipped"

system-firefox:
	@requirements/system.sh --firefox || echo "Firefox can't be installed here, its tests are skipped"

system-kernel-check:
	@requirements/system.sh --kernel-check || echo "oclgrind can't be installed here, its tests are skipped"

$(RUNTIME): requirements/runtime.lock requirements/unused.txt pyproject.toml | system
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "tlsplan set-up: $$($(PYTHON) --version) is too old, 3.11 or later is needed; pass PYTHON=path/to/python3" >&2; exit 1; }
	@[ -x $(BIN)/python ] || $(PYTHON) -m venv $(VENV)
	$(PIP) install --quiet --no-compile --no-deps --require-hashes -r requirements/runtime.lock
	@cd $(VENV)/lib/python3*/site-packages && rm -rf $$(grep -v '^#' "$(CURDIR)/requirements/unused.txt")
	$(PIP) install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

$(DEV): requirements/dev.lock $(RUNTIME) | system
	$(PIP) install --quiet --no-compile --no-deps --require-hashes -r requirements/dev.lock
	@touch $@

# What building the viewer needs; what its checks need is more than as much again. npm 9 does not link an optional node.
$(BUILD): $(WEB)/package-lock.json
	@command -v npm >/dev/null || { echo "tlsplan set-up: npm is missing; install Node.js 20.19 or later with npm" >&2; exit 1; }
	@$(NODE_IS_NEW) || { echo "tlsplan set-up: Node.js $$(node --version) is too old for the viewer; npm brings a newer one for it"; \
	  cd requirements/node && npm ci --silent --no-fund --no-audit && cd node_modules/.bin && ln -sf ../node-linux-*/bin/node .; }
	@$(NODE_IS_NEW) || { echo "tlsplan set-up: npm has no Node.js for this system; install Node.js 20.19 or later" >&2; exit 1; }
	cd $(WEB) && npm ci --omit=dev --silent --no-fund --no-audit
	@touch $@

# It makes the folder anew. The older stamp gets the lock's time, so that the viewer is not built again for it.
$(NODE): $(BUILD)
	cd $(WEB) && npm ci --silent --no-fund --no-audit
	@touch -r $(WEB)/package-lock.json $(BUILD) && touch $@

$(VIEWER): $(BUILD) $(VIEWER_SOURCES)
	cd $(WEB) && npm run --silent build
	@touch $@
