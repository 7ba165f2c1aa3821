//! From raw codes to checked quantities.

pub mod raw;
