//! Port table -> documentation/index.html of an archive.

use std::fmt::Write;

use quick_xml::escape::escape;

use super::FmiVersion;
use crate::port::Port;
use crate::sim::Model;

/// One page: what the component is, every variable with shape and unit, and the names of the rows.
pub fn documentation(model: &Model, version: FmiVersion) -> String {
    let mut rows = String::new();
    for port in model.ports().iter().filter(|p| version.has(p)) {
        let _ = writeln!(
            rows,
            "<tr><td>{}</td><td>{}</td><td>{:?} {}</td><td>{}</td><td>{:?}</td><td>{}</td></tr>",
            port.reference,
            escape(port.name.as_str()),
            port.ty,
            shape(port),
            escape(port.unit),
            port.causality,
            escape(about(port)),
        );
    }
    let scalars = match version {
        FmiVersion::V3 => "",
        FmiVersion::V2 => {
            "<p>FMI 2.0 has no arrays: element (i, j) of a variable is the scalar <code>name[i,j]</code>, counted from 1, and its value \
             reference is (reference &lt;&lt; 20) + the row-major element counted from 0. The skin itself is in the FMI 3.0 archive only.</p>\n"
        }
    };
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"><title>{name}</title></head>\n<body>\n<h1>{name}</h1>\n\
         <p>Soft tissue of the human face for co-simulation: bones move in, skin moves out. All values are in SI units; bone rotations are \
         rotation vectors (axis times angle) from the rest pose. Parameters can be set until initialization ends, inputs at every \
         communication point. Between steps, reading a variable copies it and computes nothing. A step that fails is discarded and \
         leaves the component where it was.</p>\n{scalars}<table border=\"1\">\n\
         <tr><th>reference</th><th>name</th><th>type</th><th>unit</th><th>causality</th><th>about</th></tr>\n{rows}</table>\n\
         <p>cutis {version_number}, {license}; licenses are in <code>documentation/licenses</code>.</p>\n</body>\n</html>\n",
        name = escape(model.name()),
        version_number = env!("CARGO_PKG_VERSION"),
        license = env!("CARGO_PKG_LICENSE"),
    )
}

fn shape(port: &Port) -> String {
    if port.shape.is_empty() { String::new() } else { format!("{:?}", port.shape) }
}

fn about(port: &Port) -> String {
    if port.rows.is_empty() {
        port.description.clone()
    } else {
        format!("{} Rows: {}.", port.description, port.rows.join(", "))
    }
}
