// SPDX-License-Identifier: MIT OR Apache-2.0
//! Links OpenBLAS of the system where the feature `lapack` asks for it; nothing else is built
//! before the crate.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var_os("CARGO_FEATURE_LAPACK").is_some() {
        println!("cargo::rustc-link-lib=dylib=openblas");
    }
}
