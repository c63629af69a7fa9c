# Everything here is one Cargo command, preceded by scripts/setup.sh where the system must provide something.

CARGO ?= cargo
# For example --locked.
CARGO_FLAGS ?=
# For example -- --show-output.
TEST_FLAGS ?=

# rustup's own folder is not on the path of every shell.
export PATH := $(PATH):$(HOME)/.cargo/bin

# Vulkan drivers warn when this is unset, and need no more of it than that it exists.
ifndef XDG_RUNTIME_DIR
export XDG_RUNTIME_DIR := $(or $(TMPDIR),/tmp)/edgeshade-$(shell id -u)
$(shell mkdir -p -m 700 '$(XDG_RUNTIME_DIR)')
endif

# One target at a time: they share Cargo's build folder.
.NOTPARALLEL:
.PHONY: help demo test spv check-spv lint doc msrv deny bless pipelines bless-pipelines radv-manifest scenes bench bench-gpu edt-peers setup setup-test setup-shaders setup-deny

help: ## List these targets
	@sed -n 's/^\([a-z-]*\):[^#]*## \(.*\)/\1	\2/p' $(MAKEFILE_LIST) | expand -t 12

demo: setup ## Render the default scene to shadow.png and print the time of every pass
	$(CARGO) run --release $(CARGO_FLAGS) -- render -o shadow.png

# The longest tests take some of their cases, all of them with EDGESHADE_SWEEP=full.
test: setup-test ## Run all tests
	$(CARGO) test $(CARGO_FLAGS) $(TEST_FLAGS)

# Checking the library runs build.rs, which compiles the shaders; the same features and profile as the tests, so that shaderc
# itself is compiled once (5 to 10 minutes on two cores) and then kept.
spv: setup-shaders ## Compile all shaders and refresh spv/ (the first time takes minutes)
	EDGESHADE_SPV=write $(CARGO) check --lib --features shaderc $(CARGO_FLAGS)

check-spv: setup-shaders ## Fail when spv/ differs from a fresh compile of glsl/
	EDGESHADE_SPV=check $(CARGO) check --lib --features shaderc $(CARGO_FLAGS)

lint: ## Check formatting, and all code with clippy
	$(CARGO) fmt --check
	$(CARGO) clippy --all-targets $(CARGO_FLAGS) -- -D warnings
	$(CARGO) clippy --all-targets --no-default-features $(CARGO_FLAGS) -- -D warnings

doc: ## Build the documentation, of the bare library too; any warning fails
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --no-deps --no-default-features $(CARGO_FLAGS)
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --no-deps $(CARGO_FLAGS)

# The oldest Rust that Cargo.toml promises, in a folder of its own, so that the build of the newest stays.
msrv: ## Check all code with the oldest supported Rust (rustup installs it)
	version=$$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml) && \
	{ rustup run $$version cargo --version || rustup toolchain install $$version --profile minimal --no-self-update; } && \
	CARGO_TARGET_DIR=$${CARGO_TARGET_DIR:-target}/msrv $(CARGO) +$$version check --all-targets $(CARGO_FLAGS)

deny: setup-deny ## Check licences, sources and known vulnerabilities of the dependencies (deny.toml)
	$(CARGO) deny --all-features $(CARGO_FLAGS) check

bless: setup ## Rewrite the golden images from what is rendered now
	EDGESHADE_BLESS=1 $(CARGO) test golden $(CARGO_FLAGS)

# Mesa's AMD driver compiles for GPUs that are not there; Debian's mesa-vulkan-drivers has it.
RADV_MANIFEST ?= $(firstword $(wildcard $(foreach folder,/etc /usr/local/share /usr/share,\
	$(foreach name,radeon_icd.$(shell uname -m).json radeon_icd.json,$(folder)/vulkan/icd.d/$(name)))))
PIPELINES = $(CARGO) run $(CARGO_FLAGS) -- pipelines
NAVI21 = RADV_FORCE_FAMILY=navi21 VK_DRIVER_FILES='$(RADV_MANIFEST)'

radv-manifest: # Prints nothing if the driver is not installed.
	@echo '$(RADV_MANIFEST)'

pipelines: setup ## Check the budget of all pipelines on an AMD GPU that need not be there
	@test -n '$(RADV_MANIFEST)' || { echo 'Mesa'"'"'s Vulkan driver for AMD GPUs is not installed (Debian: mesa-vulkan-drivers)'; exit 1; }
	$(NAVI21) $(PIPELINES) --check results/pipelines-navi21.md

bless-pipelines: setup ## Write the figures of all pipelines on that GPU, into results/
	$(NAVI21) $(PIPELINES) --write results/pipelines-navi21.md

scenes: ## Make all scenes anew, into assets/ and assets/judging/
	$(CARGO) run --release --example make_scenes $(CARGO_FLAGS)

# Suites that time, and need no ray-traced truth.
GPU_SUITES = techniques,map-sizes,revectorization,pcf,penumbrae,soft-cost,edges-cost,skip,scaling

bench: setup ## Measure all techniques, into results/
	$(CARGO) run --release $(CARGO_FLAGS) -- bench -o results

# A few minutes on a GPU: it is the truths, traced on the CPU, that take long, and only the last two suites need them.
bench-gpu: setup ## Measure on a GPU what fits into ten minutes, into results/
	@$(CARGO) run --release --quiet $(CARGO_FLAGS) -- devices | grep -q -i 'gpu' || { echo 'There is no GPU here; make bench measures on the CPU'; exit 1; }
	$(CARGO) run --release $(CARGO_FLAGS) -- bench --suite $(GPU_SUITES) --frames 30 -o results
	$(CARGO) run --release $(CARGO_FLAGS) -- bench --suite pareto,soft --quick --frames 20 -o results

edt-peers: setup ## Time the distance transform against CPU libraries (the head of tools/edt_peers.py says what it needs)
	$(CARGO) build --release $(CARGO_FLAGS)
	tools/edt_peers.py --edgeshade $${CARGO_TARGET_DIR:-target}/release/edgeshade

setup:
	@scripts/setup.sh runtime

setup-test:
	@scripts/setup.sh test

setup-shaders:
	@scripts/setup.sh build-shaders

setup-deny:
	@scripts/setup.sh deny
