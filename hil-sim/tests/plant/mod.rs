//! The plant against published figures, energy, convergence, and its own documents.

mod bench;
mod crossing;
mod deployment;
mod follow;
mod grip;
mod precision;
mod sensors;
mod skipping;
mod spread;
