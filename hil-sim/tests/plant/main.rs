//! The plant against published figures, energy, convergence, and its own documents.

mod bench;
mod crossing;
mod deployment;
mod grip;
mod sensors;
mod spread;
