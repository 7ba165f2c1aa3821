//! The plant against published figures, energy, convergence, and its own documents.

mod bench;
mod crossing;
mod deployment;
mod energy;
mod follow;
mod grip;
mod mismatch;
mod precision;
mod rollout;
mod sensors;
mod skipping;
mod spread;
