//! Does it keep its word: layers, header, symbols, model descriptions, C programs, archives, and no hidden allocation.
//!
//! Generated files are compared byte for byte; `BLESS=1 cargo test --test boundary` rewrites them.
//!
//! This binary counts allocations, hence its own `unsafe`: the three lines of a global allocator.

mod boundary {
    mod alloc;
    mod archive;
    mod c_programs;
    mod description;
    mod docs;
    mod header;
    mod importer;
    mod instructions;
    mod layers;
    mod notices;
    mod symbols;
    mod util;
}
