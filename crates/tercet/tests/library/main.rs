//! The library as its users see it: whole meshes and whole files, by its public interface alone.

mod common;

mod approximate;
mod butterfly;
mod corpus;
mod corruption;
mod exact;
mod fuzz_regressions;
mod golden;
mod groups;
mod io_corpus;
mod late;
mod limits;
mod paper_table;
mod portions;
mod predictions;
mod remesh;
mod round_trip;
mod sqrt3;
mod streams;
mod symmetry;
mod truncation;
