# Two commands do everything: `make demo` and `make test`. The others are steps of them.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
# One more than the processors of CI: tests wait for disks and for other processes.
JOBS ?= 3
DEMO ?= demo
MUTANTS := .venv-mutants
CYCLES := .venv-cycles
VALIDATOR := .gltf-validator
FORMATS := .venv-formats
ULTRALYTICS := .venv-ultralytics
PY123D := .venv-py123d
RELEASE := .venv-release
SAMPLE ?= 120
SEED ?= 0
SECONDS ?= 60
MOMENTS ?= 30

.PHONY: setup demo test lint bench light cycles gltf validators formats mutants fuzz kills release audit docs clusters clean

setup: $(STAMP)

# Libraries are compiled where they are imported first: pip would take a minute for all modules.
$(STAMP): pyproject.toml constraints.txt tools/system_libraries.sh
	@PYTHON=$(PYTHON) sh tools/system_libraries.sh
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check \
	    --constraint constraints.txt --editable ".[dev]"
	@touch $@

demo: setup
	$(BIN)/envgen-usd build --demo --country 1 --area residential --out $(DEMO)
	$(BIN)/envgen-usd render $(DEMO)/stage.usda --frames 20
	@echo "Look at $(DEMO)/frames/rgb (images), $(DEMO)/frames/semantic_colour (labels)"
	@echo "and $(DEMO)/report.html; open $(DEMO)/stage.usda in a USD viewer."

# Tests start the command often; with its bytecode kept, a start takes a third less time.
test: setup
	PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest -n $(JOBS) --dist worksteal --durations=25

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

$(DEMO)/stage.usda: | $(STAMP)
	$(BIN)/envgen-usd build --demo --country 1 --area residential --out $(DEMO)

bench: setup $(DEMO)/stage.usda
	$(BIN)/python benchmarks/roads.py
	$(BIN)/python benchmarks/chunks.py
	$(BIN)/python benchmarks/city.py
	$(BIN)/python benchmarks/levels.py
	$(BIN)/python benchmarks/render.py $(DEMO)/stage.usda
	$(BIN)/python benchmarks/watertight.py $(DEMO)

validators: setup
	$(BIN)/python benchmarks/validators.py

light: setup $(DEMO)/stage.usda
	$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	    --constraint constraints.txt --editable ".[mitsuba]"
	$(BIN)/python benchmarks/light.py $(DEMO)/stage.usda

# Blender's module brings a USD of its own and needs Python 3.11.
cycles: setup $(CYCLES)/.installed
	$(BIN)/python benchmarks/grey_plane.py --cycles $(CYCLES)/bin/python

dcc: setup $(CYCLES)/.installed $(DEMO)/stage.usda
	$(BIN)/python benchmarks/dcc.py $(DEMO)/stage.usda --cycles $(CYCLES)/bin/python

$(CYCLES)/.installed:
	$(PYTHON) -m venv $(CYCLES)
	$(CYCLES)/bin/python -m pip install --quiet --disable-pip-version-check "bpy==5.0.1"
	@touch $@

# Khronos' validator comes from the npm registry and needs node.
gltf: setup $(VALIDATOR)/.installed
	$(BIN)/python -m pytest tests/exchange/test_gltf.py

$(VALIDATOR)/.installed:
	@mkdir -p $(VALIDATOR)
	npm install --silent --no-audit --no-fund --prefix $(VALIDATOR) gltf-validator@2.0.0-dev.3.10
	@touch $@

# Libraries of the makers of data sets. They want an old NumPy, so they have an environment.
formats: setup $(FORMATS)/.installed $(ULTRALYTICS)/.installed $(PY123D)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	    --constraint constraints.txt --editable ".[rerun]"
	$(BIN)/python -m pytest tests/datasets

$(FORMATS)/.installed:
	$(PYTHON) -m venv $(FORMATS)
	$(FORMATS)/bin/python -m pip install --quiet --disable-pip-version-check \
	    "numpy==1.23.5" "opencv-python-headless<4.10" pillow pyyaml pyquaternion \
	    "matplotlib<3.9" "scikit-image<0.23" "pycocotools<2.0.9" "supervision==0.25.1" \
	    "scikit-learn<1.4" cachetools tqdm webdataset==1.0.2
	$(FORMATS)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps \
	    cityscapesScripts==2.3.0 kitti360Scripts==1.0.0 nuscenes-devkit==1.2.0
	@touch $@

# Its loader wants a torch that is newer than the others' NumPy; 1.6 GB.
$(ULTRALYTICS)/.installed:
	$(PYTHON) -m venv $(ULTRALYTICS)
	$(ULTRALYTICS)/bin/python -m pip install --quiet --disable-pip-version-check \
	    torch==2.13.0 opencv-python-headless pyyaml requests psutil polars matplotlib scipy tqdm
	$(ULTRALYTICS)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps \
	    ultralytics==8.4.190 torchvision==0.28.0
	@touch $@

# Its reader of KITTI-360 needs few of its requirements (Ray, Jupyter, viser and others: 1 GB).
$(PY123D)/.installed:
	$(PYTHON) -m venv $(PY123D)
	$(PY123D)/bin/python -m pip install --quiet --disable-pip-version-check \
	    numpy scipy "shapely>=2.0.0" trimesh networkx pyquaternion pyyaml pillow typing-extensions
	$(PY123D)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps \
	    py123d==0.7.0
	@touch $@

mutants: $(MUTANTS)/.installed
	$(MUTANTS)/bin/python tools/mutants.py --sample $(SAMPLE) --seed $(SEED)

$(MUTANTS)/.installed: pyproject.toml constraints.txt tools/system_libraries.sh
	@PYTHON=$(PYTHON) sh tools/system_libraries.sh
	$(PYTHON) -m venv $(MUTANTS)
	$(MUTANTS)/bin/python -m pip install --quiet --disable-pip-version-check \
	    --constraint constraints.txt --editable ".[mutants]"
	@touch $@

# Changed files are read or refused, and nothing else; SECONDS for each kind of input.
fuzz: setup
	$(BIN)/python tools/fuzz.py --seconds $(SECONDS) --seed $(SEED)

# Commands are killed at random moments and repeated; an hour on two cores.
kills: setup
	$(BIN)/python tools/kill_runs.py build dataset traffic train --moments $(MOMENTS) --work .kills

# Wheel and source archive of the commit in dist/; the wheel is tried in an empty environment.
release: $(RELEASE)/.installed
	$(RELEASE)/bin/python tools/release.py --out dist

# Known faults of the pinned versions, where pip-audit reaches a service that knows them.
audit: $(RELEASE)/.installed
	$(RELEASE)/bin/python tools/audit.py constraints.txt

$(RELEASE)/.installed:
	$(PYTHON) -m venv $(RELEASE)
	$(RELEASE)/bin/python -m pip install --quiet --disable-pip-version-check \
	    build==1.6.1 pip-audit==2.10.1
	@touch $@

# Installs Ray and submitit.
clusters: setup
	$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	    --constraint constraints.txt --editable ".[ray,submitit]"
	$(BIN)/python -m pytest tests/recipe/test_executors.py --durations=4

# The pages as a site in site/; a link or an anchor that leads nowhere stops it.
docs: setup
	$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	    --constraint constraints.txt --editable ".[docs]"
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

clean:
	rm -rf $(DEMO) .mutants .kills .release dist site fuzz_findings .mypy_cache .ruff_cache .pytest_cache .hypothesis
