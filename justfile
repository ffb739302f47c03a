# The few commands a contributor runs. `just --list` names them.

# Formatting, lints, documentation, tests: what CI checks, without the long way round.
check:
    cargo fmt --all -- --check
    cargo clippy --all-targets -- -D warnings
    RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --lib
    cargo test

# The numbers alone, without Rerun: a few minutes from cold.
check-model:
    cargo clippy --no-default-features --lib --tests -- -D warnings
    cargo test --no-default-features

# Everything CI does.
ci:
    bash .ci/run

# The committed recordings and their pictures.
gallery:
    bash recordings/gallery/make.sh
