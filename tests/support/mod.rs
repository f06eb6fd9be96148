//! Helpers of the integration tests.

#![allow(dead_code, reason = "each test file uses its share")]

pub(crate) mod composite;
pub(crate) mod faces;
pub(crate) mod hard;
pub(crate) mod integrals;
pub(crate) mod oracle;
pub(crate) mod sampling;
pub(crate) mod text;
