//! What a bake was worth, in words and as JSON.

use cutis::geometry::{Baked, Level};
use cutis::math::Vec3;

/// The mesh asked for and the coarser ones.
pub fn levels(baked: &Baked) -> impl Iterator<Item = &Level> {
    std::iter::once(&baked.finest).chain(&baked.coarser)
}

/// Prints what a mesh is worth.
pub fn tell(level: &Level) {
    say!("{}", level.report);
    for set in &level.mesh.node_sets {
        say!("bone {:<12} {} nodes", set.name, set.nodes.len());
    }
    for layer in &level.layers {
        say!("layer {:<11} {:.1} % of the volume", layer.name, 100.0 * layer.reached);
    }
    say!("slit: {} nodes doubled; {} bone nodes released between two bones", level.slit_nodes, level.released_nodes);
}

/// The report as JSON: levels, warnings, the jaw's line.
pub fn json(baked: &Baked) -> String {
    let list = |items: Vec<String>| format!("[{}]", items.join(", "));
    let text = |s: &str| format!("\"{}\"", s.replace('\\', "\\\\").replace('"', "\\\""));
    let level = |l: &Level| {
        let layers = l.layers.iter().map(|s| format!("{}: {}", text(s.name), s.reached)).collect::<Vec<_>>().join(", ");
        format!(
            "{{\"report\": {}, \"layers\": {{{layers}}}, \"slit_nodes\": {}, \"released_nodes\": {}}}",
            l.report.json(),
            l.slit_nodes,
            l.released_nodes
        )
    };
    let point = |p: &Vec3| format!("[{}, {}, {}]", p.x, p.y, p.z);
    format!(
        "{{\"levels\": {},\n\"warnings\": {},\n\"condyles\": {}}}\n",
        list(levels(baked).map(level).collect()),
        list(baked.warnings.iter().map(|w| text(&w.to_string())).collect()),
        baked.condyles.map_or("null".into(), |c| list(c.iter().map(point).collect()))
    )
}
