//! Infrastructure without a domain: error text, serde names, checksums, atomic files, quantiles, SIMD lanes.

pub mod atomic_file;
pub mod checksum;
pub mod error_text;
pub mod files;
pub mod quantiles;
pub mod serde_name;
pub(crate) mod simd;
