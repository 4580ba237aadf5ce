//! Port table -> documentation/index.html of an archive.

use std::fmt::Write;

use quick_xml::escape::escape;

use super::FmiVersion;
use crate::port::{Causality, Port};
use crate::sim::Model;

/// One page: what the component is, how it is used, every variable with shape, unit and range, what it does not do.
pub fn documentation(model: &Model, version: FmiVersion, picture: bool) -> String {
    let mut rows = String::new();
    for port in model.ports().iter().filter(|p| version.has(p)) {
        let _ = writeln!(
            rows,
            "<tr><td>{}</td><td><code>{}</code></td><td>{} {}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            port.reference,
            escape(port.name.as_str()),
            if port.single && version.is_3() { "Float32".to_owned() } else { format!("{:?}", port.ty) },
            shape(port),
            escape(port.unit),
            range(port),
            who(port),
            escape(about(port)),
        );
    }
    let figure = if picture {
        "<p><img src=\"picture.png\" alt=\"The skin at rest\" width=\"256\" height=\"256\"></p>\n"
    } else {
        ""
    };
    let scalars = match version {
        FmiVersion::V3 => "",
        FmiVersion::V2 => {
            "<p>FMI 2.0 has no arrays: element (i, j) of a variable is the scalar <code>name[i,j]</code>, counted from 1, and its value \
             reference is (reference &lt;&lt; 20) + the row-major element counted from 0. The skin itself is in the FMI 3.0 archive and in the \
             full FMI 2.0 archive.</p>\n"
        }
        FmiVersion::V2Full => {
            "<p>FMI 2.0 has no arrays: element (i, j) of a variable is the scalar <code>name[i,j]</code>, counted from 1, and its value \
             reference is (reference &lt;&lt; 20) + the row-major element counted from 0. How the skin's vertices are joined, the FMI 3.0 \
             archive tells.</p>\n"
        }
    };
    let mesh = model.mesh();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"><title>{name}</title></head>\n<body>\n<h1>{name}</h1>\n{figure}\
         <p>Soft tissue of the human face for co-simulation: bones and loads move in, skin and reactions move out. Finite elements of \
         {nodes} nodes and {tets} tetrahedra, {kind}.</p>\n\
         <h2>Use</h2>\n\
         <p>All values are in SI units; axes are those of the scene. Bone rotations are rotation vectors (axis times angle) from the rest \
         pose, about the bone's pivot. Fixed parameters can be set until initialization ends, inputs and tunable parameters at every \
         communication point; they act at the next step. Any positive step will do. Between steps, reading a variable copies it and \
         computes nothing. A step that fails is discarded and leaves the component where it was. State can be saved, restored and \
         serialized at any time; the same inputs give the same bits. {derivatives}</p>\n{scalars}\
         <h2>Variables</h2>\n<table border=\"1\">\n\
         <tr><th>reference</th><th>name</th><th>type</th><th>unit</th><th>range</th><th>set</th><th>about</th></tr>\n{rows}</table>\n\
         <h2>Limits</h2>\n\
         <p>Tissue does not touch itself, and touches rigid shapes only where the scene has contacts. Linear tetrahedra come out \
         too stiff above a Poisson's ratio of 0.45 unless the scene averages their pressure. Steps that could only end with elements turned inside out are discarded, unless the \
         scene allows them. A research tool, not a medical device.</p>\n{warnings}\
         <p>cutis {version_number}, {license}; licenses are in <code>documentation/licenses</code>, the scene in \
         <code>resources/scene.toml</code>.</p>\n</body>\n</html>\n",
        name = escape(model.name()),
        nodes = mesh.nodes.len(),
        tets = mesh.tets.len(),
        kind = if model.parts().inertia.is_some() { "with inertia" } else { "from equilibrium to equilibrium" },
        derivatives = if model.remembers() {
            "Directional (and in FMI 3.0 adjoint) derivatives of skin, markers and reactions by every input and parameter are those of \
             the last accepted step, the state before it held."
        } else {
            "Directional (and in FMI 3.0 adjoint) derivatives of skin, markers and reactions by every input and parameter hold at the \
             last accepted step."
        },
        warnings = warnings(model),
        version_number = env!("CARGO_PKG_VERSION"),
        license = env!("CARGO_PKG_LICENSE"),
    )
}

fn warnings(model: &Model) -> String {
    if model.warnings().is_empty() {
        return String::new();
    }
    let lines = model.warnings().iter().map(|w| format!("<li>{}</li>", escape(w.as_str())));
    format!("<p>Of this scene:</p>\n<ul>{}</ul>\n", lines.collect::<String>())
}

fn range(port: &Port) -> String {
    match (port.min, port.max) {
        (None, None) => String::new(),
        (Some(min), None) => format!("&ge; {min}"),
        (None, Some(max)) => format!("&le; {max}"),
        (Some(min), Some(max)) => format!("{min} to {max}"),
    }
}

fn who(port: &Port) -> &'static str {
    match port.causality {
        Causality::Independent => "independent",
        Causality::Input => "input, at any time",
        Causality::TunableParameter => "parameter, at any time",
        Causality::Parameter => "parameter, before the start",
        Causality::Output => "output",
        Causality::Local => "of the solver and the elements",
        Causality::CalculatedParameter => "fixed by the scene",
    }
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
