//! Utilities that know no domain: error text, names of enum variants, checksums, files, quantiles, SIMD.

pub mod atomic_file;
pub mod checksum;
pub mod error_text;
pub mod files;
pub mod quantiles;
pub mod serde_name;
pub(crate) mod simd;
