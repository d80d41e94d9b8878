# Every target works in a fresh clone with cargo and python3 >= 3.10 alone: what it needs besides it installs into .venv.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# Without them a stray configuration of the caller's machine would decide what is tested.
unexport PYTHONPATH PYTHONHOME

RUST_SOURCES := $(shell find crates -name '*.rs' -o -name Cargo.toml) Cargo.toml Cargo.lock
PACKAGES := $(VENV)/.packages
EXTENSION := $(VENV)/.extension
BENCH := $(VENV)/.bench
SITE := $(VENV)/.site
LARGEST := 1e7
GALLERY := $(patsubst examples/%/reproduce.py,%,$(wildcard examples/*/reproduce.py))

.PHONY: help develop demo examples test test-rust test-python test-firmware firmware firmware-c lint format instructions docs bench bench-rust bench-python cost fuzz audit pictures vectors wheel clean
.DEFAULT_GOAL := help

help: ## This list
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | awk -F ':.*## ' '{ printf "make %-13s %s\n", $$1, $$2 }'

$(PACKAGES): requirements/dev.txt scripts/make_venv.sh
	PYTHON=$(PYTHON) sh scripts/make_venv.sh $(VENV)
	$(BIN)/python -m pip install --quiet --requirement requirements/dev.txt
	touch $@

$(EXTENSION): $(PACKAGES) $(RUST_SOURCES) pyproject.toml
	VIRTUAL_ENV=$(CURDIR)/$(VENV) $(BIN)/maturin develop --release --quiet --locked
	touch $@

develop: $(EXTENSION) ## Set up .venv with the optimised extension in it

demo: $(EXTENSION) ## Filter the bundled log: table, result files and plot
	$(BIN)/python examples/demo/demo.py

examples: $(EXTENSION) ## Reproduce the sources' experiments: tables and figures
	set -e; for script in examples/*/reproduce.py; do $(BIN)/python $$script; done

test: lint test-rust test-python test-firmware ## Every check

test-rust: ## The core's tests and documentation examples, the C header
	cargo test --locked --quiet --package compfilt-core --package compfilt-capi
	cargo test --locked --quiet --package compfilt-core --features serde --test stored
	cargo check --locked --quiet --package compfilt-core --features serde,defmt
	sh scripts/check_no_panic.sh

test-python: $(EXTENSION) ## The Python tests, the README's and the documentation's examples
	$(BIN)/python -m pytest --quiet

# Left out, and said so, where its tools are not installed.
test-firmware: $(EXTENSION)
	cd scripts && ../$(BIN)/python -m firmware --if-installed

firmware: $(EXTENSION) ## Every filter on emulated microcontrollers: the bits of Python, and the costs (Debian: installs QEMU)
	cd scripts && ../$(BIN)/python -m firmware

firmware-c: $(EXTENSION) ## The C interface on the host and on a Cortex-M under QEMU: the bits of Python
	PYTHON=$(BIN)/python sh scripts/firmware/c.sh

lint: $(EXTENSION) ## Formatting, lints, types and documentation; warnings are errors
	cargo fmt --check
	cargo clippy --locked --quiet --workspace --all-targets -- --deny warnings
	RUSTDOCFLAGS="--deny warnings" cargo doc --locked --quiet --no-deps --package compfilt-core
	$(BIN)/ruff check --quiet --output-format concise
	$(BIN)/ruff format --check --quiet
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest compfilt._core

format: $(PACKAGES) ## Format everything
	cargo fmt
	$(BIN)/ruff check --quiet --fix
	$(BIN)/ruff format --quiet

instructions: $(PACKAGES) ## Instructions per sample of every filter against their budgets (callgrind)
	$(BIN)/python scripts/count_instructions.py

$(SITE): $(EXTENSION) requirements/docs.txt
	$(BIN)/python -m pip install --quiet --requirement requirements/docs.txt
	touch $@

# The source folder is the project's root, so that links work in the site as they do in the project. The gallery's figures are drawn
# anew; warnings, among them links that lead nowhere, are errors.
docs: $(SITE) ## The documentation site, in docs/_build/html
	set -e; for folder in $(GALLERY); do $(BIN)/python examples/$$folder/reproduce.py docs/_build/figures/$$folder >/dev/null; done
	RUSTDOCFLAGS="--deny warnings" cargo doc --locked --quiet --no-deps --package compfilt-core
	$(BIN)/sphinx-build --quiet --nitpicky --fail-on-warning --keep-going -c docs . docs/_build/html
	rm -rf docs/_build/html/rust && cp -r target/doc docs/_build/html/rust
	$(BIN)/python scripts/check_site.py docs/_build/html

bench: bench-rust bench-python cost ## All benches

bench-rust: ## Latency per sample of every filter, throughput of slices (Criterion)
	cargo bench --locked --package compfilt-core --bench latency --bench sensors --bench attitude --bench throughput

$(BENCH): $(EXTENSION) requirements/bench.txt
	$(BIN)/python -m pip install --quiet --requirement requirements/bench.txt
	touch $@

bench-python: $(BENCH) ## Throughput against numpy.add, scipy, numba, vqf, ahrs and imufusion: tables in Markdown
	set -e; for bench in throughput attitude_throughput small_calls; do $(BIN)/python benches/$$bench.py; echo; done

cost: $(BENCH) ## Time and memory against size: benches/results/cost.csv and cost.png; LARGEST=1e8 goes further
	$(BIN)/python benches/cost.py --largest $(LARGEST)

fuzz: $(EXTENSION) ## Ten minutes each of recipes and CSV logs that nobody would write; what reaches new code goes into tests/corpus
	$(BIN)/python -m pip install --quiet --requirement requirements/fuzz.txt
	set -e; for path in recipe csv; do $(BIN)/python scripts/fuzz.py $$path --seconds 600; done

audit: $(PACKAGES) ## Licences, sources and known vulnerabilities of what is depended on; says which databases it cannot reach
	$(BIN)/python -m pip install --quiet --requirement requirements/audit.txt
	sh scripts/audit.sh $(BIN)/python

pictures: $(EXTENSION) ## The figures of docs/pictures.md
	$(BIN)/python scripts/draw_pictures.py

vectors: $(PACKAGES) ## Make the reference vectors anew
	$(BIN)/python tests/vectors/make.py

wheel: $(PACKAGES) ## A wheel and a source distribution in dist
	$(BIN)/maturin build --release --locked --out dist
	$(BIN)/maturin sdist --out dist

clean: ## Remove what was built
	rm -rf target dist docs/_build $(VENV)
