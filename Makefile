# sdf2vec: `make demo` converts the example picture, `make test` checks everything.
#
# Needs Python 3.11 or newer with its venv module; everything else goes into .venv.
# Variables, for example `make PYTHON=python3.12 demo`:
#   PYTHON  the interpreter that .venv is made with
#   VENV    the folder of the virtual environment
#   TORCH   what pip installs first; `make TORCH=torch demo` takes the newest PyTorch. Which build that is
#           (CPU, CUDA, ROCm) depends on where pip looks: set PIP_INDEX_URL or PIP_FIND_LINKS for another.
#           Read once, when .venv is made: `make distclean` first to change it.
#   WORKERS how many processes share the tests: one for each core (auto), or 0 for none but pytest's own

PYTHON ?= python3
VENV ?= .venv
TORCH ?= torch==2.13.0
WORKERS ?= auto

BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check

# Software OpenGL and Vulkan, Khronos' GLSL compiler, cairo for the PDF export, librsvg, Inkscape and two browsers.
ENGINES := libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri libgbm1 libgles2 mesa-vulkan-drivers libvulkan1 \
           glslang-tools libcairo2 librsvg2-bin inkscape chromium firefox-esr $(if $(shell command -v npm),,npm)

.DEFAULT_GOAL := demo
.PHONY: demo test bench lint format lock locked engines clean distclean

demo: $(VENV)/.installed
	$(BIN)/sdf2vec examples/coffee.png --shapes 64 --seed 0 --emit json,glsl,shadertoy,wgsl,svg,png -o out/demo

test: engines $(VENV)/.installed-clients lint
	$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal --durations=20

lint: $(VENV)/.installed-test
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

format: $(VENV)/.installed-test
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

# Speed: the tables of docs/speed.md, on this machine; some minutes.
bench: $(VENV)/.installed-test
	$(BIN)/sdf2vec bench speed -o docs/speed.md

# What the tests were run with, each file by its hash; `lock` finds it out anew (with uv), `locked` installs it.
lock: $(VENV)/.torch
	$(PIP) install uv
	echo "$(TORCH)" > $(VENV)/torch.txt
	$(BIN)/uv pip compile pyproject.toml --extra test --constraint $(VENV)/torch.txt --universal --python-version 3.11 \
	  --generate-hashes --no-emit-index-url --no-annotate --no-header --quiet --output-file requirements.lock

locked:
	$(PYTHON) -m venv $(VENV)
	$(PIP) install --require-hashes -r requirements.lock
	$(PIP) install --no-deps --no-build-isolation -e .

# Without them the tests that draw on real engines are skipped and say so; where CI is set they fail.
engines:
	@if dpkg -s $(ENGINES) >/dev/null 2>&1; then exit 0; fi; \
	echo "Installing the system packages of the rendering engines: $(ENGINES)"; \
	if [ "$$(id -u)" -eq 0 ]; then root=; elif command -v sudo >/dev/null; then root=sudo; else root=false; fi; \
	if command -v apt-get >/dev/null && $$root apt-get update -q \
	  && $$root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $(ENGINES); \
	then exit 0; fi; \
	echo "NOT INSTALLED: the packages above (apt-get is absent or failed, or root's rights are wanted)." >&2; \
	case "$${CI:-}" in ""|0|[Ff]alse|[Nn]o) echo "Tests that need them will be skipped." >&2;; *) exit 1;; esac

clean:
	rm -rf out build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find sdf2vec tests -name __pycache__ -prune -exec rm -rf {} +

distclean: clean
	rm -rf $(VENV)

# Stamps: each is newer than what it was made from, so that a second run has nothing to install.

$(VENV)/.torch:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "Python 3.11 or newer is needed: make PYTHON=python3.11" >&2; exit 1; }
	@test -x $(BIN)/pip || $(PYTHON) -m venv $(VENV) \
	  || { rm -rf $(VENV); echo "No virtual environment could be made. On Debian: apt-get install python3-venv" >&2; exit 1; }
	$(PIP) install "$(TORCH)"
	@touch $@

$(VENV)/.installed: pyproject.toml $(VENV)/.torch
	$(PIP) install -e .
	@touch $@

$(VENV)/.installed-test: pyproject.toml $(VENV)/.torch
	$(PIP) install -e '.[test]'
	@touch $@

# What exports are tried in: a Shadertoy client in an environment of its own (it wants another wgpu), three.js, SVGO;
# and geometrize, which benches can set beside.
$(VENV)/.installed-clients: Makefile $(VENV)/.torch | engines
	$(BIN)/python -m venv $(VENV)/shadertoy
	$(VENV)/shadertoy/bin/python -m pip --disable-pip-version-check install wgpu-shadertoy==0.2.0 wgpu==0.23.0
	mkdir -p $(VENV)/npm
	if command -v npm >/dev/null; then npm install --silent --no-audit --no-fund --prefix $(VENV)/npm three@0.170.0 svgo@4.1.0 geometrizejs@0.0.19 pngjs@7.0.0; fi
	@touch $@
