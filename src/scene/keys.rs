//! Every key of a scene: type, unit, range, default, meaning. The one place where these facts stand: `build` checks
//! ranges against it, and docs/scene.md is printed from it.

use std::fmt;

/// Values a key may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// Anything of the type (numbers must be finite).
    Any,
    /// Above zero.
    Positive,
    /// Zero or more.
    NonNegative,
    /// From the first to below the second.
    From(f64, f64),
    /// One of these names.
    OneOf(&'static [&'static str]),
    /// At least one.
    AtLeastOne,
    /// One or two.
    OneOrTwo,
}

impl Range {
    /// Whether a number lies within; names are checked by the caller.
    pub fn holds(&self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Range::Positive => value > 0.0,
                Range::NonNegative => value >= 0.0,
                Range::From(low, high) => (*low..*high).contains(&value),
                Range::AtLeastOne => value >= 1.0,
                Range::OneOrTwo => value == 1.0 || value == 2.0,
                Range::Any | Range::OneOf(_) => true,
            }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Range::Any => write!(f, "any"),
            Range::Positive => write!(f, "> 0"),
            Range::NonNegative => write!(f, ">= 0"),
            Range::From(low, high) if *high == 1.0 + f64::EPSILON => write!(f, "{low} <= . <= 1"),
            Range::From(low, high) => write!(f, "{low} <= . < {high}"),
            Range::AtLeastOne => write!(f, ">= 1"),
            Range::OneOrTwo => write!(f, "1 or 2"),
            Range::OneOf(names) => {
                for (k, name) in names.iter().enumerate() {
                    write!(f, "{}`\"{name}\"`", if k == 0 { "" } else { ", " })?;
                }
                Ok(())
            }
        }
    }
}

/// One key of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// Table it stands in; empty for the top level.
    pub table: &'static str,
    /// Name.
    pub name: &'static str,
    /// Type as TOML names it.
    pub kind: &'static str,
    /// SI unit; empty where there is none.
    pub unit: &'static str,
    /// Legal values.
    pub range: Range,
    /// Value if left out; "required", "none" or a TOML value.
    pub default: &'static str,
    /// What it means.
    pub doc: &'static str,
}

const fn key(
    table: &'static str,
    name: &'static str,
    kind: &'static str,
    unit: &'static str,
    range: Range,
    default: &'static str,
    doc: &'static str,
) -> Key {
    Key { table, name, kind, unit, range, default, doc }
}

use Range::{Any, AtLeastOne, From, NonNegative, OneOf, OneOrTwo, Positive};

/// Highest Poisson's ratio a linear tetrahedron is let near; above 0.45 it already locks.
const NU_LIMIT: f64 = 0.5;

/// Every key, table by table.
#[rustfmt::skip] // one key a line
pub const KEYS: &[Key] = &[
    key("", "name", "string", "", Any, "\"scene\"", "Name of the scene; stands in the model description."),
    key("", "mesh", "table", "", Any, "required", "Where the tissue comes from: exactly one of `file`, `head`, `block`."),
    key("", "skin", "table", "", Any, "none", "A finer skin that rides on the mesh, for hosts to read: exactly one of `file`, `edge`, `subdivisions`. Loads stay on the mesh."),
    key("", "tissue", "array of tables", "", Any, "required", "Materials; each region of the mesh takes the first that names it."),
    key("", "bone", "array of tables", "", Any, "none", "Bones that hold or move the tissue."),
    key("", "muscle", "array of tables", "", Any, "none", "Muscles that the host activates."),
    key("", "load", "array of tables", "", Any, "none", "Forces on a point, a patch of skin or a region."),
    key("", "pressure", "array of tables", "", Any, "none", "Pressures that follow the surface."),
    key("", "contact", "array of tables", "", Any, "none", "Rigid shapes that bones carry and a surface cannot enter: teeth, a finger, an instrument."),
    key("", "marker", "array of tables", "", Any, "none", "Points on the skin that the host reads."),
    key("", "gravity", "table", "", Any, "none", "Weight of the tissue."),
    key("", "inertia", "table", "", Any, "none", "Dynamics; without it every step is an equilibrium."),
    key("", "attachment", "table", "", Any, "none", "How the tissue sticks to the bones."),
    key("", "solver", "table", "", Any, "none", "Accuracy and method."),
    key("", "run", "table", "", Any, "none", "Step and end of `cutis run`; also the default experiment of the FMU."),
    key("", "keyframe", "array of tables", "", Any, "none", "Programme of `cutis run`: inputs at given times, linear between them."),
    key("mesh", "file", "string", "", Any, "none", "Mesh file (`.cutis`, `.msh`, `.vtu`, `.vtk`), relative to the scene."),
    key("mesh", "head", "table", "", Any, "none", "The synthetic head."),
    key("mesh", "block", "table", "", Any, "none", "A box."),
    key("mesh", "order", "integer", "", From(1.0, 3.0), "1", "Linear tetrahedra (1), or quadratic ones with a node on every edge (2): eight times the unknowns of a mesh, far more accurate for each of them."),
    key("mesh", "curved", "boolean", "", Any, "false", "With `order = 2`: edges on smooth surfaces are bent to the surface that the normals tell, so that the shape, too, is of order 2."),
    key("mesh.head", "edge", "float", "m", From(0.002, 0.012), "0.0078", "Edge of the lattice cell."),
    key("mesh.block", "origin", "[float; 3]", "m", Any, "[0, 0, 0]", "Corner with the smallest coordinates."),
    key("mesh.block", "size", "[float; 3]", "m", Positive, "required", "Edge lengths."),
    key("mesh.block", "cells", "[integer; 3]", "", AtLeastOne, "required", "Cells along x, y and z."),
    key("mesh.block", "pattern", "string", "", OneOf(&["six", "forty-eight"]), "\"six\"", "Tetrahedra of a cell: six about a diagonal, or 48 in eight mirrored cubes."),
    key("mesh.block", "layers", "array of [string, float]", "", Any, "[]", "Layers from z_max down: region name and share of the height; the rest is `tissue`."),
    key("skin", "file", "string", "", Any, "none", "Triangle surface (`.msh`, `.vtu`, `.vtk`), relative to the scene."),
    key("skin", "edge", "float", "m", From(0.002, 0.012), "none", "The synthetic head's skin at this edge of the lattice cell."),
    key("skin", "subdivisions", "integer", "", From(1.0, 6.0), "none", "The mesh's own skin with each triangle cut in four this many times."),
    key("tissue", "regions", "array of strings", "", Any, "all regions", "Regions of the mesh made of this material."),
    key("tissue", "preset", "string", "", Any, "none", "A tissue of the table below; keys given beside it take the place of its own, `energy` that of its law."),
    key("tissue", "level", "string", "", OneOf(&["low", "typical", "high"]), "\"typical\"", "End of the published range that the preset's stiffness is taken from."),
    key("tissue", "energy", "string", "", OneOf(&["linear", "corotational", "st-venant-kirchhoff", "stable-neo-hookean", "polyconvex-neo-hookean", "neo-hookean", "mooney-rivlin", "yeoh", "fung", "veronda-westmann", "ogden", "mass-spring"]), "\"polyconvex-neo-hookean\"", "Strain energy density; it decides which constants below are wanted (see theory.md). `mass-spring` is for comparison: springs along the edges, of `E` alone, without a Poisson's ratio and without volume."),
    key("tissue", "E", "float", "Pa", Positive, "of the law", "Young's modulus at small strain."),
    key("tissue", "nu", "float", "", From(0.0, NU_LIMIT), "of the law", "Poisson's ratio at small strain."),
    key("tissue", "mu", "float or array", "Pa", Any, "of the law", "Shear modulus (`fung`), or one for each term (`ogden`)."),
    key("tissue", "alpha", "float or array", "", Any, "of the law", "Exponent of each term (`ogden`)."),
    key("tissue", "b", "float", "", Positive, "of the law", "Stiffening exponent (`fung`)."),
    key("tissue", "c1", "float", "Pa", Positive, "of the law", "Scale (`veronda-westmann`)."),
    key("tissue", "c2", "float", "", Positive, "of the law", "Stiffening exponent (`veronda-westmann`)."),
    key("tissue", "c10", "float", "Pa", Positive, "of the law", "Of I1b - 3 (`mooney-rivlin`, `yeoh`)."),
    key("tissue", "c01", "float", "Pa", NonNegative, "of the law", "Of I2b - 3 (`mooney-rivlin`)."),
    key("tissue", "c20", "float", "Pa", NonNegative, "of the law", "Of (I1b - 3)^2 (`yeoh`)."),
    key("tissue", "c30", "float", "Pa", NonNegative, "of the law", "Of (I1b - 3)^3 (`yeoh`)."),
    key("tissue", "kappa", "float", "Pa", Positive, "of the law", "Bulk modulus of the laws with volume-free part."),
    key("tissue", "density", "float", "kg/m3", Positive, "1000", "Mass density."),
    key("tissue", "pressure", "string", "", OneOf(&["element", "nodal"]), "\"element\"", "Volume kept in each tetrahedron, or averaged at the nodes: the latter does not lock on linear tetrahedra."),
    key("tissue", "viscous", "table", "", Any, "none", "Viscous overstress: fast loads feel more than slow ones."),
    key("tissue", "fibre", "table", "", Any, "none", "A family of collagen fibres on top of the law."),
    key("tissue", "damage", "table", "", Any, "none", "Softening of the law after it was stretched too far."),
    key("tissue", "grade", "table", "", Any, "none", "Stiffness that changes from the skin to the bones."),
    key("tissue", "limit", "table", "", Any, "none", "Stretches beyond which the tissue stiffens steeply."),
    key("tissue", "tension", "table", "", Any, "none", "Tension in the plane of the skin that the shape at rest carries."),
    key("tissue", "tunable", "string", "", Any, "none", "Name of a parameter `material.<name>.E` (Pa), Young's modulus at small strain, that a host may set at any communication point; the law's moduli, its damping, overstress and default limits follow in proportion, fibres and tension stay."),
    key("tissue.viscous", "g", "array of floats", "", Positive, "required", "Share of each branch, in units of the law's own stiffness under slow loads."),
    key("tissue.viscous", "tau", "array of floats", "s", Positive, "required", "Relaxation time of each branch."),
    key("tissue.fibre", "direction", "[float; 3]", "", Any, "none", "Mean direction of the fibres; exactly one of `direction` and `path`."),
    key("tissue.fibre", "path", "array of [float; 3]", "m", Any, "none", "Points of a line that the fibres run along."),
    key("tissue.fibre", "in_skin", "boolean", "", Any, "false", "Lays the direction into the plane of the skin."),
    key("tissue.fibre", "k1", "float", "Pa", Positive, "required", "Stress scale of the fibres."),
    key("tissue.fibre", "k2", "float", "", Positive, "required", "Stiffening exponent."),
    key("tissue.fibre", "dispersion", "float", "", From(0.0, 1.0 / 3.0 + f64::EPSILON), "0", "0 for fibres that all run one way, 1/3 for every direction alike."),
    key("tissue.fibre", "slack", "float", "", AtLeastOne, "1", "Crimp stretch below which the fibres are slack."),
    key("tissue.fibre", "damage", "table", "", Any, "none", "Softening of the fibres; keys as of `[tissue.damage]`."),
    key("tissue.damage", "onset", "float", "J/m3", NonNegative, "required", "Energy density at which damage begins."),
    key("tissue.damage", "scale", "float", "J/m3", Positive, "required", "Energy density over which it grows."),
    key("tissue.damage", "most", "float", "", From(0.0, 1.0), "0.99", "Share of the stiffness that can be lost."),
    key("tissue.grade", "depth", "array of floats", "", NonNegative, "required", "Depths from 0 (skin) to 1 (bone), rising."),
    key("tissue.grade", "factor", "array of floats", "", Positive, "required", "Factor of the stiffness at each depth; linear between them, constant outside."),
    key("tissue.limit", "longest", "float", "", AtLeastOne, "1.5", "Largest principal stretch."),
    key("tissue.limit", "shortest", "float", "", From(0.0, 1.0 + f64::EPSILON), "0.75", "Smallest principal stretch."),
    key("tissue.limit", "longest_at_bone", "float", "", AtLeastOne, "`longest`", "The same at the bone; linear in depth between."),
    key("tissue.limit", "shortest_at_bone", "float", "", From(0.0, 1.0 + f64::EPSILON), "`shortest`", "The same at the bone."),
    key("tissue.limit", "band", "float", "", Positive, "0.02", "Stretch over which a limit sets in; it is zero inside."),
    key("tissue.limit", "stiffness", "float", "Pa", Positive, "10 E", "Stiffness scale; more keeps the limit better and makes steps harder."),
    key("tissue.tension", "along", "float", "Pa", NonNegative, "required", "Tension along `direction`."),
    key("tissue.tension", "across", "float", "Pa", NonNegative, "`along`", "Tension across it in the plane of the skin."),
    key("tissue.tension", "direction", "[float; 3]", "", Any, "any", "Direction laid into the plane of the skin; wanted where `across` differs."),
    key("bone", "name", "string", "", Any, "required", "Name: the row of the `bone.*` ports."),
    key("bone", "nodes", "string", "", Any, "the name", "Node set of the mesh that sticks to the bone, or the nodes of the face set of that name; `none` where no tissue does and it carries a [[contact]] only, such as a finger. Each [[contact]] adds four nodes of its own to its bone, which carry the shape: they lie in no element and on no surface, but are counted as nodes."),
    key("bone", "within", "[[float; 3]; 2]", "m", Any, "everywhere", "Smallest and largest corner of a box that the nodes must lie in, walls included."),
    key("bone", "drive", "string", "", OneOf(&["held", "pose", "force", "displacement"]), "\"pose\"", "Held at rest, moved by pose, by force and torque, or node by node."),
    key("bone", "pivot", "[float; 3]", "m", Any, "centroid of the nodes", "Rest position of the point that it turns about."),
    key("bone", "translation", "[float; 3]", "m", Any, "[0, 0, 0]", "Start value of `bone.translation`."),
    key("bone", "rotation", "[float; 3]", "rad", Any, "[0, 0, 0]", "Start value of `bone.rotation`, a rotation vector."),
    key("bone", "force", "[float; 3]", "N", Any, "[0, 0, 0]", "Start value of `bone.force`."),
    key("bone", "torque", "[float; 3]", "N m", Any, "[0, 0, 0]", "Start value of `bone.torque`."),
    key("muscle", "name", "string", "", Any, "required", "Name: the row of `muscle.activation`."),
    key("muscle", "path", "array of [float; 3]", "m", Any, "required", "Points from origin to insertion; fibres run along it."),
    key("muscle", "radius", "float", "m", Positive, "required", "Tetrahedra whose centre is nearer to the path belong to the muscle."),
    key("muscle", "stress", "float", "Pa", Positive, "100e3", "Nominal stress at full activation."),
    key("muscle", "width", "float", "", Positive, "none", "Half width of the force-length curve in stretch; without it force does not depend on length."),
    key("muscle", "activation", "float", "", From(0.0, 1.0 + f64::EPSILON), "0", "Start value of `muscle.activation`."),
    key("load", "name", "string", "", Any, "required", "Name: the row of `load.force`."),
    key("load", "at", "[float; 3]", "m", Any, "none", "Place on the skin; the nearest skin node without `radius`."),
    key("load", "radius", "float", "m", Positive, "none", "Spreads the force by area over the skin within this distance of `at`."),
    key("load", "region", "string", "", Any, "none", "Spreads the force by volume over a region instead."),
    key("load", "force", "[float; 3]", "N", Any, "[0, 0, 0]", "Start value of the total force."),
    key("pressure", "name", "string", "", Any, "required", "Name: the row of `load.pressure`."),
    key("pressure", "faces", "string", "", Any, "\"skin\"", "Face set that it acts on."),
    key("pressure", "at", "[float; 3]", "m", Any, "none", "Centre of a patch of that set."),
    key("pressure", "radius", "float", "m", Positive, "none", "Radius of the patch."),
    key("pressure", "pressure", "float", "Pa", Any, "0", "Start value; positive pushes into the tissue."),
    key("contact", "name", "string", "", Any, "required", "Name: the row of `contact.force` and `contact.depth`."),
    key("contact", "bone", "string", "", Any, "required", "Bone that carries the shape and feels the force on it."),
    key("contact", "path", "array of [float; 3]", "m", Any, "none", "Points of the shape's line when the bone rests: one makes a ball, two a capsule, more a bent tube. With `radius`."),
    key("contact", "radius", "float", "m", Positive, "none", "Radius about the line. The tissue closes around it where vertices lie closer than that (the scene warns else)."),
    key("contact", "point", "[float; 3]", "m", Any, "none", "A point of the plane before a half-space, when the bone rests. With `normal`."),
    key("contact", "normal", "[float; 3]", "", Any, "none", "Direction out of the half-space; of any length."),
    key("contact", "faces", "string", "", Any, "\"skin\"", "Face set that is held off."),
    key("contact", "stiffness", "float", "Pa/m", Positive, "20 E / edge", "Pressure for each metre that the surface goes in, which it does by about pressure over this once it is deeper than a fiftieth of an edge, where contact sets in; `E` of the stiffest tissue, `edge` the mean one of the faces. More is harder to solve."),
    key("contact", "friction", "float", "", NonNegative, "0", "Largest traction along the shape in units of the pressure (Coulomb). A point sticks from the step after the one in which it touches."),
    key("marker", "name", "string", "", Any, "required", "Name: the row of `marker.position`."),
    key("marker", "at", "[float; 3]", "m", Any, "required", "Place; the marker is the nearest point of the skin."),
    key("gravity", "acceleration", "[float; 3]", "m/s2", Any, "[0, 0, -9.80665]", "Start value of `gravity`."),
    key("gravity", "scan", "[float; 3]", "m/s2", Any, "none", "Gravity that the shape of the mesh was scanned in; without it the mesh is the shape without weight."),
    key("gravity", "rest", "string", "", OneOf(&["differential", "inverse"]), "\"differential\"", "With `scan`: apply the difference to it, or find the shape without weight that sags into the scan."),
    key("inertia", "start", "string", "", OneOf(&["equilibrium", "rest"]), "\"equilibrium\"", "Whether time starts in equilibrium with the start inputs, or at rest."),
    key("inertia", "scheme", "string", "", OneOf(&["backward-euler", "bdf2", "generalised-alpha", "implicit-midpoint"]), "\"backward-euler\"", "Time integrator: of first order and damping all it does not resolve, or of second order (see theory.md)."),
    key("inertia", "rho", "float", "", From(0.0, 1.0 + f64::EPSILON), "0.8", "What a step of `generalised-alpha` leaves of the fastest motions."),
    key("inertia", "damping_mass", "float", "1/s", NonNegative, "0", "Damping force in units of mass times velocity."),
    key("inertia", "damping_stiffness", "float", "s", NonNegative, "0", "Damping stress in units of the small-strain stiffness times strain rate; rotations feel nothing."),
    key("inertia", "accuracy", "float", "m", Positive, "none", "Cuts each step into as many pieces (256 at most) as keep the estimated error of a piece below this; at least ten times the solver's `tolerance`."),
    key("inertia", "modes", "integer", "", AtLeastOne, "all unknowns", "Moves in this many of the slowest modes of vibration, in microseconds a step; what they leave out follows loads and bones without inertia. Wants tissue of the law `linear`, bones held or moved, no muscles, no pressures; has no derivatives by moduli and pivots. `cutis check` tells what the modes hold."),
    key("attachment", "free_rings", "integer", "", NonNegative, "0", "Bone nodes that two bones claim, or within this many edges of another bone, are set free (osteotomy lines, joints)."),
    key("solver", "method", "string", "", OneOf(&["quasi-newton", "newton"]), "\"quasi-newton\"", "L-BFGS over a kept factor (scenes that are linear in their inputs are read off a table instead), or Newton with a new factor in every iteration."),
    key("solver", "tolerance", "float", "m", Positive, "1e-7", "Largest nodal motion of the last correction."),
    key("solver", "max_iterations", "integer", "", AtLeastOne, "200", "Most linear solves in one piece of a step."),
    key("solver", "most_solves", "integer", "", AtLeastOne, "5 `max_iterations`", "Most linear solves of a whole step, however it is cut: what a step that will be refused costs at most (mostly far less: [torture.md](torture.md)). More than the default lets hard steps search longer. A host sets it as `solver.mostSolves`. With `accuracy` the default is 256 times as much, one for each piece."),
    key("solver", "inversion", "string", "", OneOf(&["refuse", "allow"]), "\"refuse\"", "Whether a step that can only end with elements turned inside out is refused, or taken and told where the law has an energy for it (`linear` tissue alone always may)."),
    key("solver", "precision", "string", "", OneOf(&["single", "double"]), "by `method`", "Of the solves with a kept factor: `single` (for `quasi-newton`) takes half the time and leaves the accuracy to `tolerance`, `double` (for `newton`) saves an iteration where a scene is badly conditioned. Residuals and the factor are always in double precision."),
    key("solver", "linear", "string", "", OneOf(&["direct", "iterative"]), "`direct` where its factor fits", "`direct` keeps a factor, which serves many solves; `iterative` runs conjugate gradients in Newton's method, with memory in proportion to the mesh. Without the key factors of more than 400 million numbers are avoided."),
    key("solver", "background", "boolean", "", Any, "false", "A second thread makes the kept factor anew while steps go on, where a step took six solves or more: no step waits for a factorisation that was foreseen, and fewer solves are needed. Takes matrices and factor twice. The same bits each time, but not those of a scene without."),
    key("solver", "threads", "integer", "", OneOrTwo, "1", "Threads of a simulation: a second one takes half of the solves in single precision off the first where a factor is large enough. The answer is the same to the bit; it pays in time on a core that is free."),
    key("run", "dt", "float", "s", Positive, "0.1", "Length of a step."),
    key("run", "end", "float", "s", Positive, "1", "End time."),
    key("keyframe", "t", "float", "s", NonNegative, "required", "Time."),
    key("keyframe", "port", "string", "", Any, "required", "Input port, for example `bone.rotation`."),
    key("keyframe", "row", "string", "", Any, "all rows", "Row of the port by name: a bone, a load, a pressure."),
    key("keyframe", "value", "float or array", "of the port", Any, "required", "Values of that row (or of the whole port, row-major)."),
];

/// The table names in the order of [`KEYS`], without repetition.
pub fn tables() -> Vec<&'static str> {
    let mut tables: Vec<&str> = KEYS.iter().map(|k| k.table).collect();
    tables.dedup();
    tables
}

/// The key of this table and name.
///
/// # Panics
/// If it is not listed; a test walks every key.
pub(super) fn find(table: &str, name: &str) -> &'static Key {
    KEYS.iter().find(|k| k.table == table && k.name == name).expect("every key that build asks for is listed")
}

/// The key reference as Markdown, one table a heading.
pub fn key_reference() -> String {
    let mut out = String::new();
    for table in tables() {
        let heading = if table.is_empty() { "Top level".to_owned() } else { format!("`[{table}]`") };
        out += &format!(
            "## {heading}\n\n| key | type | unit | range | default | meaning |\n| --- | --- | --- | --- | --- | --- |\n"
        );
        for k in KEYS.iter().filter(|k| k.table == table) {
            let default = if k.default.starts_with(|c: char| c == '"' || c == '[' || c.is_ascii_digit()) {
                format!("`{}`", k.default)
            } else {
                k.default.to_owned()
            };
            out += &format!("| `{}` | {} | {} | {} | {default} | {} |\n", k.name, k.kind, k.unit, k.range, k.doc);
        }
        out += "\n";
    }
    out + &super::presets::preset_reference()
}
