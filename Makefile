# make demo | test | validate | adapters | mutants | bench | lint | wheel | clean: each makes what it needs first. PYTHON=... chooses the interpreter.

PHOTO ?= examples/photos/beacon-street-sunset.jpg
OUT ?= out/demo.jpg

RUN := .venv/bin
LOCKS := requirements.lock requirements-dev.lock
export XDG_RUNTIME_DIR ?= $(CURDIR)/.build/run

# An environment that is gone, or was made elsewhere, has no valid stamp.
ifneq ($(shell cat .build/env.stamp 2>/dev/null),$(if $(wildcard .venv/bin/airlight),$(CURDIR)))
$(shell rm -f .build/*.stamp)
endif

.PHONY: help demo test validate adapters mutants bench lint wheel env vulkan chromium openvdb clean
.NOTPARALLEL:

help:
	@sed -n '1s/^# //p' Makefile

env: .build/env.stamp

.build/env.stamp: pyproject.toml $(LOCKS) scripts/make_env.sh scripts/common.sh
	@mkdir -p .build/run && chmod 700 .build/run
	@[ ! -f $@ ] || [ "$$(cat $@)" = "$(CURDIR)" ] || rm -rf .venv
	@scripts/make_env.sh
	@printf '%s\n' "$(CURDIR)" > $@

.build/bench.stamp .build/validate.stamp .build/mutants.stamp: .build/%.stamp: .build/env.stamp requirements-%.lock
	@$(RUN)/python -m pip install --quiet --disable-pip-version-check --only-binary :all: -r requirements-$*.lock
	@touch $@

vulkan: env
	@scripts/ensure_vulkan.sh

chromium:
	@scripts/ensure_chromium.sh

openvdb:
	@scripts/ensure_openvdb.sh

demo: env vulkan
	@mkdir -p "$(dir $(OUT))"
	@$(RUN)/airlight image "$(PHOTO)" -o "$(OUT)" --light auto --overwrite
	@echo "The picture: $(abspath $(OUT)). For your own: $(RUN)/airlight image photo.jpg -o out.jpg"

test: lint vulkan chromium
	$(RUN)/python -m pytest -n 2 --dist loadfile --ignore tests/viewer
	$(RUN)/python -m pytest tests/viewer

validate: .build/validate.stamp vulkan chromium openvdb
	$(RUN)/python -m pytest -m slow
	$(MAKE) adapters

adapters: env vulkan chromium
	$(RUN)/python scripts/adapters.py
	$(RUN)/python scripts/vulkan_layer.py

mutants: .build/mutants.stamp vulkan
	$(RUN)/python scripts/shader_mutants.py
	$(RUN)/python scripts/mutants.py

bench: .build/bench.stamp vulkan
	$(RUN)/airlight bench

lint: env
	$(RUN)/ruff check src tests scripts
	$(RUN)/mypy
	$(RUN)/codespell src tests scripts *.md Makefile pyproject.toml

wheel: env
	$(RUN)/python -m hatchling build -t wheel
	@ls -l dist/*.whl

clean:
	rm -rf .venv .build build dist mutants
