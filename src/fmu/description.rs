//! Port table -> modelDescription.xml, FMI 3.0.2 and FMI 2.0.5.
//!
//! Dimensions are constants and units stand in type definitions: importers refuse or drop anything cleverer.

use std::collections::BTreeMap;

use quick_xml::Writer;

use super::{FmiVersion, LOG_CATEGORIES, MODEL_IDENTIFIER, scalar_name, scalar_reference, token};
use crate::load::Loaded;
use crate::math::extent;
use crate::port::{Causality, Port, Slot, Type};
use crate::sim::Model;

type Xml = Writer<Vec<u8>>;
type Attributes = Vec<(&'static str, String)>;

/// The model description of a scene; its `[run]` table is the default experiment.
pub fn description(scene: &Loaded, version: FmiVersion) -> String {
    let Loaded { model, programme } = scene;
    let ports: Vec<&Port> = model.ports().iter().filter(|p| version.has(p)).collect();
    let mut root: Attributes = vec![
        ("fmiVersion", if version.is_3() { "3.0" } else { "2.0" }.to_owned()),
        ("modelName", model.name().to_owned()),
        (if version.is_3() { "instantiationToken" } else { "guid" }, token(model, version)),
        ("description", "Soft tissue of the human face: bones move in, skin moves out".to_owned()),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("license", env!("CARGO_PKG_LICENSE").to_owned()),
        ("generationTool", concat!("cutis ", env!("CARGO_PKG_VERSION")).to_owned()),
        ("variableNamingConvention", "structured".to_owned()),
    ];
    if !version.is_3() {
        root.push(("numberOfEventIndicators", "0".to_owned()));
    }
    document("fmiModelDescription", root, |xml| {
        co_simulation(xml, version, model);
        let types = Types::of(&ports, version);
        types.write_units(xml);
        types.write_definitions(xml, version);
        element(xml, "LogCategories", vec![], |xml| {
            for (name, what) in LOG_CATEGORIES {
                empty(xml, "Category", vec![("name", name.to_owned()), ("description", what.to_owned())]);
            }
        });
        let (stop, step) = (programme.end.to_string(), programme.dt.to_string());
        let tolerance = relative_tolerance(model).to_string();
        let experiment =
            vec![("startTime", "0".to_owned()), ("stopTime", stop), ("tolerance", tolerance), ("stepSize", step)];
        empty(xml, "DefaultExperiment", experiment);
        match version {
            FmiVersion::V3 => {
                element(xml, "ModelVariables", vec![], |xml| ports.iter().for_each(|p| variable3(xml, p, &types)));
                structure3(xml, model, &ports);
            }
            FmiVersion::V2 | FmiVersion::V2Full => {
                element(xml, "ModelVariables", vec![], |xml| ports.iter().for_each(|p| variables2(xml, p, &types)));
                structure2(xml, &ports);
            }
        }
    })
}

/// Terminals: group of names, name, matching rule, what it is. Groups that are not listed become buses of their own name.
const TERMINALS: &[(&str, &str, &str, &str)] = &[
    ("bone", "bones", "plug", "Bones: how they are moved, and what the tissue does to them"),
    ("load", "loads", "bus", "Forces and pressures on the skin"),
    ("marker", "markers", "bus", "Points that ride on the skin"),
    ("material", "materials", "bus", "Stiffness of the tissues"),
    ("muscle", "muscles", "bus", "Activation of the muscles"),
    ("skin", "skin", "bus", "The skin: where it is, where it was at rest, how its vertices are joined"),
];

/// Tolerance of the solver in sizes of the tissue.
fn relative_tolerance(model: &Model) -> f64 {
    let relative = model.parts().strategy.tolerance / extent(&model.mesh().nodes);
    // One digit says it.
    format!("{relative:.0e}").parse().unwrap_or(relative)
}

/// The terminals of an archive, and the icon of the FMI 3.0 one: one terminal for the variables whose names begin alike. FMI 2.0
/// has one member a scalar.
pub fn terminals(model: &Model, version: FmiVersion, icon: bool) -> String {
    let mut groups: BTreeMap<&str, Vec<(String, String)>> = BTreeMap::new();
    let signals = |p: &&Port| version.has(p) && !matches!(p.causality, Causality::Independent | Causality::Local);
    for port in model.ports().iter().filter(signals) {
        if let Some((group, member)) = port.name.split_once('.') {
            let members = groups.entry(group).or_default();
            if version.is_3() {
                members.push((member.to_owned(), port.name.clone()));
            } else {
                let scalars = (0..port.len()).map(|k| scalar_name(port, k));
                members.extend(scalars.map(|name| (name[group.len() + 1..].to_owned(), name)));
            }
        }
    }
    document("fmiTerminalsAndIcons", vec![("fmiVersion", "3.0".to_owned())], |xml| {
        if icon {
            element(xml, "GraphicalRepresentation", vec![], |xml| {
                let corners =
                    || [("x1", "-100"), ("y1", "-100"), ("x2", "100"), ("y2", "100")].map(|(k, v)| (k, v.to_owned()));
                let mut system = corners().to_vec();
                system.push(("suggestedScalingFactorTo_mm", "0.1".to_owned()));
                empty(xml, "CoordinateSystem", system);
                empty(xml, "Icon", corners().to_vec());
            });
        }
        element(xml, "Terminals", vec![], |xml| {
            for (group, members) in groups {
                let listed = TERMINALS.iter().find(|t| t.0 == group);
                let (name, rule) = listed.map_or((group, "bus"), |&(_, name, rule, _)| (name, rule));
                let mut attributes = vec![("name", name.to_owned()), ("matchingRule", rule.to_owned())];
                attributes.extend(listed.map(|t| ("description", t.3.to_owned())));
                element(xml, "Terminal", attributes, |xml| {
                    for (member, variable) in members {
                        let attributes = vec![
                            ("variableName", variable),
                            ("memberName", member),
                            ("variableKind", "signal".to_owned()),
                        ];
                        empty(xml, "TerminalMemberVariable", attributes);
                    }
                });
            }
        });
    })
}

fn co_simulation(xml: &mut Xml, version: FmiVersion, model: &Model) {
    let claims: &[&'static str] = match version {
        FmiVersion::V3 => &[
            "canHandleVariableCommunicationStepSize",
            "canGetAndSetFMUState",
            "canSerializeFMUState",
            "providesDirectionalDerivatives",
            "providesAdjointDerivatives",
        ],
        FmiVersion::V2 | FmiVersion::V2Full => &[
            "canHandleVariableCommunicationStepSize",
            "canNotUseMemoryManagementFunctions",
            "canGetAndSetFMUstate",
            "canSerializeFMUstate",
            "providesDirectionalDerivative",
        ],
    };
    let mut attributes: Attributes = vec![("modelIdentifier", MODEL_IDENTIFIER.to_owned())];
    attributes.extend(claims.iter().map(|&name| (name, "true".to_owned())));
    if version.is_3() {
        attributes.push(("providesIntermediateUpdate", "true".to_owned()));
    }
    if model.parts().inertia.is_some() {
        attributes.push(("maxOutputDerivativeOrder", "1".to_owned()));
    }
    empty(xml, "CoSimulation", attributes);
}

// ---------------------------------------------------------------- units and types

/// What FMI needs to know about an SI unit of the port table.
struct Unit {
    name: &'static str,
    quantity: &'static str,
    base: &'static [(&'static str, i32)],
    display: Option<(&'static str, f64)>,
}

const UNITS: &[Unit] = &[
    Unit { name: "s", quantity: "Time", base: &[("s", 1)], display: Some(("ms", 1e3)) },
    Unit { name: "m", quantity: "Length", base: &[("m", 1)], display: Some(("mm", 1e3)) },
    Unit { name: "m/s", quantity: "Velocity", base: &[("m", 1), ("s", -1)], display: Some(("mm/s", 1e3)) },
    Unit { name: "m/s2", quantity: "Acceleration", base: &[("m", 1), ("s", -2)], display: None },
    Unit { name: "rad", quantity: "Angle", base: &[("rad", 1)], display: Some(("deg", 180.0 / std::f64::consts::PI)) },
    Unit { name: "N", quantity: "Force", base: &[("kg", 1), ("m", 1), ("s", -2)], display: Some(("mN", 1e3)) },
    Unit { name: "N.m", quantity: "Torque", base: &[("kg", 1), ("m", 2), ("s", -2)], display: Some(("N.mm", 1e3)) },
    Unit { name: "Pa", quantity: "Pressure", base: &[("kg", 1), ("m", -1), ("s", -2)], display: Some(("kPa", 1e-3)) },
    Unit { name: "J", quantity: "Energy", base: &[("kg", 1), ("m", 2), ("s", -2)], display: Some(("mJ", 1e3)) },
    Unit { name: "kg/m3", quantity: "Density", base: &[("kg", 1), ("m", -3)], display: None },
    Unit { name: "1", quantity: "Ratio", base: &[], display: None },
];

/// One type a quantity: what differs from variable to variable (range, nominal value) stands at the variable.
struct Types {
    definitions: Vec<Definition>,
}

struct Definition {
    name: String,
    unit: &'static str,
    /// Whether it is of single precision, where the version knows of that.
    single: Option<bool>,
}

impl Definition {
    fn fits(&self, port: &Port) -> bool {
        port.ty == Type::Float64 && self.unit == port.unit && self.single.is_none_or(|single| single == port.single)
    }
}

impl Types {
    /// FMI 2.0 has no numbers of single precision.
    fn of(ports: &[&Port], version: FmiVersion) -> Self {
        let mut definitions: Vec<Definition> = Vec::new();
        for port in ports.iter().filter(|p| p.ty == Type::Float64) {
            if definitions.iter().any(|d| d.fits(port)) {
                continue;
            }
            let quantity = UNITS.iter().find(|u| u.name == port.unit).map_or("Quantity", |u| u.quantity);
            // A type may not share its name with a variable; ours begin with a capital, theirs do not.
            let single = version.is_3().then_some(port.single);
            let name = if single == Some(true) { format!("Single{quantity}") } else { quantity.to_owned() };
            definitions.push(Definition { name, unit: port.unit, single });
        }
        Self { definitions }
    }

    fn name_for(&self, port: &Port) -> Option<&str> {
        self.definitions.iter().find(|d| d.fits(port)).map(|d| d.name.as_str())
    }

    fn write_units(&self, xml: &mut Xml) {
        element(xml, "UnitDefinitions", vec![], |xml| {
            for unit in UNITS.iter().filter(|u| self.definitions.iter().any(|d| d.unit == u.name)) {
                element(xml, "Unit", vec![("name", unit.name.to_owned())], |xml| {
                    empty(xml, "BaseUnit", unit.base.iter().map(|&(name, power)| (name, power.to_string())).collect());
                    if let Some((name, factor)) = unit.display {
                        empty(xml, "DisplayUnit", vec![("name", name.to_owned()), ("factor", factor.to_string())]);
                    }
                });
            }
        });
    }

    fn write_definitions(&self, xml: &mut Xml, version: FmiVersion) {
        element(xml, "TypeDefinitions", vec![], |xml| {
            for definition in &self.definitions {
                let unit = UNITS.iter().find(|u| u.name == definition.unit);
                let mut attributes: Attributes = Vec::new();
                if let Some(unit) = unit {
                    attributes.push(("quantity", unit.quantity.to_owned()));
                    attributes.push(("unit", unit.name.to_owned()));
                    attributes.extend(unit.display.map(|(name, _)| ("displayUnit", name.to_owned())));
                }
                match version {
                    FmiVersion::V3 => {
                        attributes.insert(0, ("name", definition.name.clone()));
                        empty(
                            xml,
                            if definition.single == Some(true) { "Float32Type" } else { "Float64Type" },
                            attributes,
                        );
                    }
                    FmiVersion::V2 | FmiVersion::V2Full => {
                        element(xml, "SimpleType", vec![("name", definition.name.clone())], |xml| {
                            empty(xml, "Real", attributes)
                        })
                    }
                }
            }
        });
    }
}

// ---------------------------------------------------------------- variables

fn causality(port: &Port) -> &'static str {
    match port.causality {
        Causality::Independent => "independent",
        Causality::Input => "input",
        Causality::Output => "output",
        Causality::Local => "local",
        Causality::Parameter | Causality::TunableParameter => "parameter",
        Causality::CalculatedParameter => "calculatedParameter",
    }
}

fn variability(port: &Port) -> &'static str {
    match (port.causality, port.ty) {
        (Causality::Parameter | Causality::CalculatedParameter, _) => "fixed",
        (Causality::TunableParameter, _) => "tunable",
        (_, Type::Float64) => "continuous",
        (_, Type::Int32 | Type::Boolean) => "discrete",
    }
}

fn is_calculated(port: &Port) -> bool {
    matches!(port.causality, Causality::Output | Causality::Local | Causality::CalculatedParameter)
}

/// Whether it is an unknown of the initialization: local variables are none.
fn is_unknown(port: &Port) -> bool {
    matches!(port.causality, Causality::Output | Causality::CalculatedParameter)
}

/// Start value of element `offset`: a single start value holds for all elements.
fn start(port: &Port, offset: usize) -> f64 {
    port.start.get(offset).or(port.start.first()).copied().unwrap_or(0.0)
}

/// FMI has no names for rows, so the description tells them.
fn about(port: &Port) -> String {
    let sentence = port.description.trim_end_matches('.');
    if port.rows.is_empty() { sentence.to_owned() } else { format!("{sentence}; rows: {}", port.rows.join(", ")) }
}

/// Range and nominal value, where there is something to say.
fn bounds(port: &Port) -> Attributes {
    let mut attributes: Attributes = Vec::new();
    attributes.extend(port.min.map(|min| ("min", min.to_string())));
    attributes.extend(port.max.map(|max| ("max", max.to_string())));
    if port.ty == Type::Float64 && port.nominal != 1.0 {
        attributes.push(("nominal", port.nominal.to_string()));
    }
    attributes
}

fn variable3(xml: &mut Xml, port: &Port, types: &Types) {
    let tag = match port.ty {
        Type::Float64 if port.single => "Float32",
        Type::Float64 => "Float64",
        Type::Int32 => "Int32",
        Type::Boolean => "Boolean",
    };
    let mut attributes: Attributes = vec![
        ("name", port.name.clone()),
        ("valueReference", port.reference.to_string()),
        ("description", about(port)),
        ("causality", causality(port).to_owned()),
        ("variability", variability(port).to_owned()),
    ];
    if is_calculated(port) {
        attributes.push(("initial", "calculated".to_owned()));
    }
    if port.is_computed() {
        attributes.push(("intermediateUpdate", "true".to_owned()));
    }
    attributes.extend(types.name_for(port).map(|name| ("declaredType", name.to_owned())));
    attributes.extend(bounds(port));
    if port.is_settable() {
        let values: Vec<String> = (0..port.len()).map(|k| start(port, k).to_string()).collect();
        attributes.push(("start", values.join(" ")));
    }
    if port.shape.is_empty() {
        return empty(xml, tag, attributes);
    }
    element(xml, tag, attributes, |xml| {
        for extent in &port.shape {
            empty(xml, "Dimension", vec![("start", extent.to_string())]);
        }
    });
}

fn variables2(xml: &mut Xml, port: &Port, types: &Types) {
    let columns: usize = port.shape.get(1..).map_or(1, |rest| rest.iter().product());
    for k in 0..port.len() {
        let row = port.rows.get(k / columns).filter(|_| !port.shape.is_empty());
        let description = row.map_or_else(
            || port.description.clone(),
            |row| format!("{} ({row})", port.description.trim_end_matches('.')),
        );
        let mut attributes: Attributes = vec![
            ("name", scalar_name(port, k)),
            ("valueReference", scalar_reference(port, k).to_string()),
            ("description", description),
            ("causality", causality(port).to_owned()),
            ("variability", variability(port).to_owned()),
        ];
        if is_calculated(port) {
            attributes.push(("initial", "calculated".to_owned()));
        }
        element(xml, "ScalarVariable", attributes, |xml| {
            let mut attributes: Attributes = Vec::new();
            attributes.extend(types.name_for(port).map(|name| ("declaredType", name.to_owned())));
            attributes.extend(bounds(port));
            if port.is_settable() {
                attributes.push(("start", start(port, k).to_string()));
            }
            let tag = match port.ty {
                Type::Float64 => "Real",
                Type::Int32 => "Integer",
                Type::Boolean => "Boolean",
            };
            empty(xml, tag, attributes);
        });
    }
}

// ---------------------------------------------------------------- structure

/// Outputs depend on every input and tunable parameter, and in the beginning on the other parameters too: a body in
/// equilibrium feels all of them.
///
/// What changes the modes of a scene that moves in modes is no known of it: there are no derivatives by that.
fn structure3(xml: &mut Xml, model: &Model, ports: &[&Port]) {
    let references = |wanted: &[Causality]| -> String {
        let of_modes = |p: &Port| model.is_reduced() && matches!(p.slot, Slot::MaterialE(_) | Slot::BonePivot);
        let felt = |p: &&&Port| p.ty == Type::Float64 && wanted.contains(&p.causality) && !of_modes(p);
        let found: Vec<String> = ports.iter().filter(felt).map(|p| p.reference.to_string()).collect();
        found.join(" ")
    };
    let inputs = references(&[Causality::Input, Causality::TunableParameter]);
    let knowns = references(&[Causality::Input, Causality::TunableParameter, Causality::Parameter]);
    element(xml, "ModelStructure", vec![], |xml| {
        for port in ports.iter().filter(|p| p.causality == Causality::Output) {
            empty(
                xml,
                "Output",
                vec![("valueReference", port.reference.to_string()), ("dependencies", inputs.clone())],
            );
        }
        for port in ports.iter().filter(|p| is_unknown(p)) {
            let dependencies = if port.causality == Causality::Output { knowns.clone() } else { String::new() };
            empty(
                xml,
                "InitialUnknown",
                vec![("valueReference", port.reference.to_string()), ("dependencies", dependencies)],
            );
        }
    });
}

/// FMI 2.0 counts variables from 1; no `dependencies` means all of them, which is true.
fn structure2(xml: &mut Xml, ports: &[&Port]) {
    let mut first = 1;
    let indexed: Vec<(&Port, std::ops::Range<usize>)> = ports
        .iter()
        .map(|&port| {
            let range = first..first + port.len();
            first = range.end;
            (port, range)
        })
        .collect();
    let list = |xml: &mut Xml, name: &'static str, wanted: &dyn Fn(&Port) -> bool| {
        if indexed.iter().any(|(port, _)| wanted(port)) {
            element(xml, name, vec![], |xml| {
                for index in indexed.iter().filter(|(port, _)| wanted(port)).flat_map(|(_, range)| range.clone()) {
                    empty(xml, "Unknown", vec![("index", index.to_string())]);
                }
            });
        }
    };
    element(xml, "ModelStructure", vec![], |xml| {
        list(xml, "Outputs", &|p| p.causality == Causality::Output);
        list(xml, "InitialUnknowns", &is_unknown);
    });
}

// ---------------------------------------------------------------- XML, in memory

pub(super) fn document(root: &'static str, attributes: Attributes, body: impl FnOnce(&mut Xml)) -> String {
    let mut xml = Writer::new_with_indent(b"<?xml version=\"1.0\" encoding=\"UTF-8\"?>".to_vec(), b' ', 2);
    // The first element after a text needs its own line break.
    xml.get_mut().push(b'\n');
    element(&mut xml, root, attributes, body);
    let mut bytes = xml.into_inner();
    bytes.push(b'\n');
    String::from_utf8(bytes).expect("names and numbers are UTF-8")
}

fn element(xml: &mut Xml, name: &'static str, attributes: Attributes, body: impl FnOnce(&mut Xml)) {
    let attributes = attributes.iter().map(|(key, value)| (*key, value.as_str()));
    let written = xml.create_element(name).with_attributes(attributes).write_inner_content(|xml| {
        body(xml);
        Ok(())
    });
    written.map(drop).expect("writing to memory does not fail");
}

pub(super) fn empty(xml: &mut Xml, name: &'static str, attributes: Attributes) {
    let attributes = attributes.iter().map(|(key, value)| (*key, value.as_str()));
    xml.create_element(name)
        .with_attributes(attributes)
        .write_empty()
        .map(drop)
        .expect("writing to memory does not fail");
}
