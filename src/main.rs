//! The `partwise` command line.

fn main() {}
