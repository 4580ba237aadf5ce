//! The FMI component as files: model descriptions and archives, both read off the port table.
//!
//! ```text
//! Port table --> description --> modelDescription.xml (3.0 with arrays, 2.0 with scalars)
//!                terminals, documentation
//!            +-> package     --> cutis.fmu, cutis_fmi2.fmu, cutis_fmi2_full.fmu (same library inside)
//! model      --> picture (icon), reference (a short run), licenses (SPDX)
//! ```
#![forbid(unsafe_code)]

mod description;
mod documentation;
mod licenses;
mod package;
mod picture;
mod platform;
mod reference;

pub use description::{description, terminals};
pub use documentation::documentation;
pub use package::{Binary, PackageError, package};
pub use platform::{Platform, UnknownPlatform};

use sha2::{Digest, Sha256};

use crate::port::{Port, Slot};
use crate::sim::Model;

/// Name of the library inside an archive, and prefix of nothing else.
pub const MODEL_IDENTIFIER: &str = "cutis";

/// Version of the standard an archive is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FmiVersion {
    /// FMI 2.0: scalars; bones, loads, markers and diagnostics.
    V2,
    /// FMI 2.0 with a scalar for every coordinate of the skin, too.
    V2Full,
    /// FMI 3.0: arrays; everything.
    V3,
}

impl FmiVersion {
    /// Customary file name of the archive.
    pub fn archive_name(self) -> &'static str {
        match self {
            FmiVersion::V2 => "cutis_fmi2.fmu",
            FmiVersion::V2Full => "cutis_fmi2_full.fmu",
            FmiVersion::V3 => "cutis.fmu",
        }
    }

    /// Whether the archive of this version has the port.
    pub fn has(self, port: &Port) -> bool {
        match self {
            FmiVersion::V2 => fits_fmi2(port) && !is_skin(port),
            FmiVersion::V2Full => fits_fmi2(port),
            FmiVersion::V3 => !port.is_empty(),
        }
    }

    /// Whether it is FMI 3.0.
    pub fn is_3(self) -> bool {
        self == FmiVersion::V3
    }
}

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

/// Bits of an FMI 2.0 value reference that count elements; the port's own reference stands above them.
const ELEMENT_BITS: u32 = 20;

/// FMI 2.0 value reference of element `offset` (row-major, 0-based) of a port.
///
/// # Panics
/// If port reference or offset do not fit: 4096 references, 1048576 elements.
pub fn scalar_reference(port: &Port, offset: usize) -> u32 {
    assert!(
        offset < 1 << ELEMENT_BITS && port.reference < 1 << (32 - ELEMENT_BITS),
        "`{}` does not fit FMI 2.0 references",
        port.name
    );
    (port.reference << ELEMENT_BITS) + offset as u32
}

/// Port reference and element that [`scalar_reference`] put together.
pub fn split_scalar_reference(reference: u32) -> (u32, usize) {
    (reference >> ELEMENT_BITS, (reference & ((1 << ELEMENT_BITS) - 1)) as usize)
}

/// FMI 2.0 name of an element: 1-based, as Modelica and Simulink group them.
///
/// ```text
/// bone.translation, shape [2, 3], offset 4  ->  bone.translation[2,2]
/// ```
pub fn scalar_name(port: &Port, offset: usize) -> String {
    if port.shape.is_empty() {
        return port.name.clone();
    }
    let mut rest = offset;
    let mut indices: Vec<String> = Vec::with_capacity(port.shape.len());
    for &extent in port.shape.iter().rev() {
        indices.push((rest % extent + 1).to_string());
        rest /= extent;
    }
    indices.reverse();
    format!("{}[{}]", port.name, indices.join(","))
}

/// Token of the archive of this version: that of the model, but for the full FMI 2.0 archive, whose instances answer to more
/// references than those of the small one.
pub fn token(model: &Model, version: FmiVersion) -> String {
    match version {
        FmiVersion::V2 | FmiVersion::V3 => model.token().to_owned(),
        FmiVersion::V2Full => {
            let digest = Sha256::digest(format!("{} full", model.token()));
            let hex: String = digest.iter().take(16).map(|b| format!("{b:02x}")).collect();
            format!("{{{}-{}-{}-{}-{}}}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..])
        }
    }
}

/// Whether elements of this port have FMI 2.0 value references. The skin at rest has none: it is the skin before the first step.
fn fits_fmi2(port: &Port) -> bool {
    port.slot != Slot::SkinRestPosition
        && !port.is_empty()
        && port.len() <= 1 << ELEMENT_BITS
        && port.reference < 1 << (32 - ELEMENT_BITS)
}

/// The skin arrays stay out of the small archive: one scalar for each coordinate makes importers crawl, and markers tell
/// what a host without arrays can use.
fn is_skin(port: &Port) -> bool {
    matches!(port.slot, Slot::SkinPosition | Slot::SkinVelocity | Slot::SkinTriangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::port::{Causality, Type};

    #[test]
    fn scalars_are_named_and_numbered_row_major() {
        let port = Port {
            name: "bone.translation".into(),
            reference: 10,
            slot: Slot::BoneTranslation,
            ty: Type::Float64,
            single: false,
            shape: vec![2, 3],
            unit: "m",
            causality: Causality::Input,
            start: vec![0.0],
            nominal: 1.0,
            min: None,
            max: None,
            rows: vec![],
            description: String::new(),
        };
        assert_eq!(scalar_name(&port, 0), "bone.translation[1,1]");
        assert_eq!(scalar_name(&port, 4), "bone.translation[2,2]");
        assert_eq!(scalar_reference(&port, 4), 10 * 1_048_576 + 4);
        assert_eq!(split_scalar_reference(scalar_reference(&port, 5)), (10, 5));
    }
}
