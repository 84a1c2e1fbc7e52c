//! Times: of alternatives side by side ([`reduce`], `marmor bench reduce`).

pub mod reduce;

pub use reduce::{Bench, Row, rows};
