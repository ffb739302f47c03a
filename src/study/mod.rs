//! Studies of drapes: metrics and accuracy, certificates, drape tests, sweeps, Table 4, and the range-table search.

#[cfg(feature = "cli")]
pub(crate) mod ablation;
pub mod accuracy;
pub mod certificate;
pub(crate) mod drape_test;
pub mod evaluate;
pub mod job;
pub mod metrics;
pub mod sweep;
pub(crate) mod table4;
pub(crate) mod table_search;
pub(crate) mod validation;
pub(crate) mod wrinkles;
