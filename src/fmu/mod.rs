//! The FMI component as files: model descriptions and archives, both read off the port table.
#![forbid(unsafe_code)]

/// Log categories of both model descriptions, with their descriptions; names are the standard's where it has one.
pub const LOG_CATEGORIES: [(&str, &str); 7] = [
    ("logEvents", "Events"),
    ("logNonlinearSystems", "Equilibrium iterations of every step"),
    ("logSingularLinearSystems", "Singular linear systems"),
    ("logStatusWarning", "Messages with status Warning"),
    ("logStatusDiscard", "Messages with status Discard"),
    ("logStatusError", "Messages with status Error"),
    ("logStatusFatal", "Messages with status Fatal"),
];

use crate::port::{Port, Slot};

/// Bits of an FMI 2.0 value reference that count elements; the port's own reference stands above them.
const ELEMENT_BITS: u32 = 20;

/// FMI 2.0 value reference of element `offset` (row-major, 0-based) of a port.
pub fn scalar_reference(port: &Port, offset: usize) -> u32 {
    debug_assert!(offset < 1 << ELEMENT_BITS && port.reference < 1 << (32 - ELEMENT_BITS));
    (port.reference << ELEMENT_BITS) + offset as u32
}

/// Port reference and element that [`scalar_reference`] put together.
pub fn split_scalar_reference(reference: u32) -> (u32, usize) {
    (reference >> ELEMENT_BITS, (reference & ((1 << ELEMENT_BITS) - 1)) as usize)
}

/// Whether the FMI 2.0 archive has this port. The skin arrays stay out: one scalar for each coordinate makes importers
/// crawl, and markers tell what a host without arrays can use.
pub fn in_fmi2(port: &Port) -> bool {
    !port.is_empty() && !matches!(port.slot, Slot::SkinPosition | Slot::SkinVelocity | Slot::SkinRestPosition | Slot::SkinTriangles)
}
