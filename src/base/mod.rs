//! Utilities that know no domain: error text, names of enum variants, checksums, files, rayon's pool, quantiles, elementary functions, random numbers, SIMD.

pub mod atomic_file;
pub mod checksum;
pub mod error_text;
pub mod files;
pub(crate) mod math;
pub(crate) mod pool;
pub mod quantiles;
pub(crate) mod random;
pub mod serde_name;
pub(crate) mod simd;
