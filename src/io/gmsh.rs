//! Gmsh `.msh`: read 2.2 and 4.1 text, written as 4.1. Regions are physical volumes, face sets physical surfaces,
//! node sets physical points.
//!
//! Source: C. Geuzaine & J.-F. Remacle, "Gmsh Reference Manual", chapter "MSH file format", versions 4.1 and 2.2.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use super::IoError;
use super::text::{Words, exact};
use crate::math::{Vec3, bounds};
use crate::mesh::{FaceSet, NodeSet, TetMesh};

/// Element types: a node, a triangle, a tetrahedron; with their dimension and number of nodes.
const POINT: u32 = 15;
const TRIANGLE: u32 = 2;
const TET: u32 = 4;
/// Carry no set of ours.
const LINE: u32 = 1;
const QUAD: u32 = 3;

/// A mesh as `.msh` 4.1 text; the element numbers keep the order of the tetrahedra.
pub(super) fn text(mesh: &TetMesh, path: &Path) -> Result<String, IoError> {
    let groups: [Vec<&str>; 3] = [
        mesh.node_sets.iter().map(|s| s.name.as_str()).collect(),
        mesh.face_sets.iter().map(|s| s.name.as_str()).collect(),
        mesh.region_names.iter().map(String::as_str).collect(),
    ];
    let [points, surfaces, volumes] = &groups;
    if let Some(name) = groups.iter().flatten().find(|n| n.contains(['"', '\n', '\r'])) {
        return Err(IoError::unsupported(
            path,
            format!("the name {name:?}"),
            "Gmsh names hold no quotes or line ends: rename it",
        ));
    }
    let n_nodes = mesh.nodes.len();
    let mut out = String::from("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n");
    out += &format!("{}\n", points.len() + surfaces.len() + volumes.len());
    for (dim, names) in [(0, points), (2, surfaces), (3, volumes)] {
        for (k, name) in names.iter().enumerate() {
            out += &format!("{dim} {} \"{name}\"\n", k + 1);
        }
    }
    out += "$EndPhysicalNames\n$Entities\n";
    out += &format!("{} 0 {} {}\n", points.len(), surfaces.len(), volumes.len());
    let (low, high) = bounds(&mesh.nodes);
    let corner = |x: Vec3| format!("{} {} {}", exact(x.x), exact(x.y), exact(x.z));
    for k in 1..=points.len() {
        out += &format!("{k} {} 1 {k}\n", corner(low));
    }
    for n in [surfaces.len(), volumes.len()] {
        for k in 1..=n {
            out += &format!("{k} {} {} 1 {k} 0\n", corner(low), corner(high));
        }
    }
    out += &format!("$EndEntities\n$Nodes\n1 {n_nodes} 1 {n_nodes}\n3 1 0 {n_nodes}\n");
    for a in 1..=n_nodes {
        out += &format!("{a}\n");
    }
    mesh.nodes.iter().for_each(|&x| out += &format!("{}\n", corner(x)));
    out += "$EndNodes\n$Elements\n";
    let mut next = mesh.tets.len();
    let mut blocks: Vec<(u32, usize, u32, String, usize)> = Vec::new();
    for (k, _) in volumes.iter().enumerate() {
        let mut rows = String::new();
        let mut count = 0;
        for (e, tet) in mesh.tets.iter().enumerate().filter(|(e, _)| mesh.region[*e] as usize == k) {
            put_row(&mut rows, e + 1, tet);
            count += 1;
        }
        blocks.push((3, k + 1, TET, rows, count));
    }
    for (k, set) in mesh.face_sets.iter().enumerate() {
        let mut rows = String::new();
        for t in &set.triangles {
            next += 1;
            put_row(&mut rows, next, t);
        }
        blocks.push((2, k + 1, TRIANGLE, rows, set.triangles.len()));
    }
    for (k, set) in mesh.node_sets.iter().enumerate() {
        let mut rows = String::new();
        for &a in &set.nodes {
            next += 1;
            put_row(&mut rows, next, &[a]);
        }
        blocks.push((0, k + 1, POINT, rows, set.nodes.len()));
    }
    blocks.retain(|b| b.4 > 0);
    out += &format!("{} {next} 1 {next}\n", blocks.len());
    for (dim, entity, kind, rows, count) in blocks {
        out += &format!("{dim} {entity} {kind} {count}\n{rows}");
    }
    out += "$EndElements\n";
    Ok(out)
}

fn put_row(rows: &mut String, tag: usize, nodes: &[u32]) {
    write!(rows, "{tag}").expect("a String takes everything");
    nodes.iter().for_each(|a| write!(rows, " {}", a + 1).expect("a String takes everything"));
    rows.push('\n');
}

/// An element as read: its number, type, nodes, and the physical groups it belongs to.
struct Element {
    tag: u64,
    kind: u32,
    nodes: Vec<u64>,
    groups: Vec<i64>,
}

/// Sections that say nothing about the mesh itself.
const HARMLESS: [&str; 8] = [
    "$Comments",
    "$Parametrizations",
    "$GhostElements",
    "$InterpolationScheme",
    "$NodeData",
    "$ElementData",
    "$ElementNodeData",
    "$Periodic",
];

#[derive(Default)]
struct File {
    names: BTreeMap<(u8, i64), String>,
    /// Physical groups of an entity, by dimension and tag.
    entities: BTreeMap<(u8, i64), Vec<i64>>,
    tags: Vec<u64>,
    nodes: Vec<Vec3>,
    elements: Vec<Element>,
}

/// The mesh in the bytes of a `.msh` file.
pub(super) fn read(bytes: &[u8], path: &Path, told: &mut Vec<String>) -> Result<TetMesh, IoError> {
    let text = String::from_utf8_lossy(bytes);
    let mut words = Words::new(path, &text);
    let mut file = File::default();
    let mut version = 0.0;
    while let Some(section) = words.word() {
        match section {
            "$MeshFormat" => {
                version = words.parse("a format version")?;
                let binary = words.need("the file type")? != "0";
                if binary {
                    return Err(IoError::unsupported(path, "a binary .msh file", "save it as text (Mesh.Binary = 0)"));
                }
                if version != 4.1 && !(2.0..3.0).contains(&version) {
                    let found = format!("MSH format {version}");
                    return Err(IoError::unsupported(path, found, "4.1 and 2.2 are read: save it as one of them"));
                }
                let size = words.need("the size of numbers")?;
                if size != "8" {
                    return Err(words.slip(&format!("numbers of {size} bytes"), "8"));
                }
            }
            "$PhysicalNames" => {
                for _ in 0..words.count("number of names")? {
                    let (dim, tag) = (words.parse("a dimension")?, words.parse("a physical tag")?);
                    let name = words.line().unwrap_or("").trim_matches('"').to_string();
                    if file.names.insert((dim, tag), name).is_some() {
                        return Err(words.slip(&format!("a second name of group {tag}"), "one name a physical group"));
                    }
                }
            }
            "$Entities" => read_entities(&mut words, &mut file, false)?,
            "$PartitionedEntities" => {
                words.parse::<u64>("number of partitions")?;
                for _ in 0..words.count("number of ghost entities")? {
                    let _: (i64, i64) = (words.parse("a ghost entity")?, words.parse("a partition")?);
                }
                read_entities(&mut words, &mut file, true)?;
            }
            "$ParametricNodes" => {
                return Err(words.slip("$ParametricNodes", "$Nodes (Mesh.SaveParametric = 0)"));
            }
            "$Nodes" if version >= 4.0 => read_nodes_4(&mut words, &mut file)?,
            "$Nodes" => {
                for _ in 0..words.count("number of nodes")? {
                    file.tags.push(words.parse("a node number")?);
                    file.nodes.push(position(&mut words)?);
                }
            }
            "$Elements" if version >= 4.0 => read_elements_4(&mut words, &mut file, path)?,
            "$Elements" => read_elements_2(&mut words, &mut file, path)?,
            _ => {
                let end = format!("$End{}", section.trim_start_matches('$'));
                if version == 0.0 {
                    return Err(words.slip(&format!("`{section:.40}`"), "$MeshFormat"));
                }
                while words.need(&end)? != end {}
                if !HARMLESS.contains(&section) {
                    told.push(format!("section {section} is not known and was passed over"));
                }
                continue;
            }
        }
        let end = format!("$End{}", section.trim_start_matches('$'));
        while words.need(&end)? != end {}
    }
    if version == 0.0 {
        return Err(IoError::format(path, "line 1", "no $MeshFormat", "a Gmsh .msh file"));
    }
    file.into_mesh(path, told)
}

fn position(words: &mut Words) -> Result<Vec3, IoError> {
    Ok(Vec3::new(words.parse("x")?, words.parse("y")?, words.parse("z")?))
}

/// Entities, or parts of them, which name their parent and partitions.
fn read_entities(words: &mut Words, file: &mut File, parts: bool) -> Result<(), IoError> {
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = words.count("number of entities")?;
    }
    for (dim, count) in (0u8..).zip(counts) {
        for _ in 0..count {
            let tag = words.parse("an entity tag")?;
            if parts {
                let _: (u8, i64) = (words.parse("a parent's dimension")?, words.parse("a parent's tag")?);
                for _ in 0..words.count("number of partitions")? {
                    words.parse::<i64>("a partition")?;
                }
            }
            for _ in 0..if dim == 0 { 3 } else { 6 } {
                words.parse::<f64>("a bounding coordinate")?;
            }
            let n = words.count("number of physical tags")?;
            // A negative tag says that elements are turned, which the tetrahedra tell anyway.
            let groups = (0..n).map(|_| Ok(words.parse::<i64>("a physical tag")?.saturating_abs()));
            let groups = groups.collect::<Result<_, IoError>>()?;
            if dim > 0 {
                for _ in 0..words.count("number of bounding entities")? {
                    words.parse::<i64>("an entity tag")?;
                }
            }
            file.entities.insert((dim, tag), groups);
        }
    }
    Ok(())
}

fn read_nodes_4(words: &mut Words, file: &mut File) -> Result<(), IoError> {
    let blocks = words.count("number of node blocks")?;
    for _ in 0..3 {
        words.parse::<u64>("a node count")?;
    }
    for _ in 0..blocks {
        let (dim, _): (usize, i64) = (words.parse("a dimension")?, words.parse("an entity tag")?);
        let parameters = match words.need("parametric flag")? {
            "0" => 0,
            "1" if dim <= 3 => dim,
            found => return Err(words.slip(&format!("`{found}`"), "parametric flag 0 or 1")),
        };
        let n = words.count("number of nodes")?;
        for _ in 0..n {
            file.tags.push(words.parse("a node number")?);
        }
        for _ in 0..n {
            file.nodes.push(position(words)?);
            for _ in 0..parameters {
                words.parse::<f64>("a parametric coordinate")?;
            }
        }
    }
    Ok(())
}

/// Nodes of an element of this type.
fn node_count(kind: u32, path: &Path) -> Result<usize, IoError> {
    match kind {
        POINT => Ok(1),
        LINE => Ok(2),
        TRIANGLE => Ok(3),
        TET | QUAD => Ok(4),
        _ => {
            let found = format!("elements of Gmsh type {kind}");
            Err(IoError::unsupported(
                path,
                found,
                "linear tetrahedra are read: mesh with order 1 and without recombination; a scene makes quadratic elements \
                 of them (`[mesh] order = 2`)",
            ))
        }
    }
}

fn read_elements_4(words: &mut Words, file: &mut File, path: &Path) -> Result<(), IoError> {
    let blocks = words.count("number of element blocks")?;
    for _ in 0..3 {
        words.parse::<u64>("an element count")?;
    }
    for _ in 0..blocks {
        let (dim, entity): (u8, i64) = (words.parse("a dimension")?, words.parse("an entity tag")?);
        let kind = words.parse("an element type")?;
        let groups = file.entities.get(&(dim, entity)).cloned().unwrap_or_default();
        let n_corners = node_count(kind, path)?;
        for _ in 0..words.count("number of elements")? {
            let tag = words.parse("an element number")?;
            let nodes = (0..n_corners).map(|_| words.parse("a node number")).collect::<Result<_, _>>()?;
            file.elements.push(Element { tag, kind, nodes, groups: groups.clone() });
        }
    }
    Ok(())
}

fn read_elements_2(words: &mut Words, file: &mut File, path: &Path) -> Result<(), IoError> {
    for _ in 0..words.count("number of elements")? {
        let tag = words.parse("an element number")?;
        let kind = words.parse("an element type")?;
        let n = words.count("number of tags")?;
        let tags: Vec<i64> = (0..n).map(|_| words.parse("a tag")).collect::<Result<_, _>>()?;
        let groups = tags.first().filter(|&&t| t != 0).map_or(Vec::new(), |&t| vec![t.saturating_abs()]);
        let n_corners = node_count(kind, path)?;
        let nodes = (0..n_corners).map(|_| words.parse("a node number")).collect::<Result<_, _>>()?;
        file.elements.push(Element { tag, kind, nodes, groups });
    }
    Ok(())
}

impl File {
    /// Names of the groups of a dimension by tag; groups without a name are called after their tag.
    fn group_names(&self, dim: u8, kind: u32, word: &str) -> BTreeMap<i64, String> {
        let named = self.names.iter().filter(|((d, _), _)| *d == dim).map(|((_, t), n)| (*t, n.clone()));
        let mut names: BTreeMap<i64, String> = named.collect();
        for &t in self.elements.iter().filter(|e| e.kind == kind).flat_map(|e| &e.groups) {
            names.entry(t).or_insert_with(|| format!("{word}_{t}"));
        }
        names
    }

    /// Tells of elements that end up in no set, and of tetrahedra in several.
    fn tell_ungrouped(&self, told: &mut Vec<String>) {
        let count = |kind: u32, pass: &dyn Fn(usize) -> bool| {
            self.elements.iter().filter(|e| e.kind == kind && pass(e.groups.len())).count()
        };
        let any_group = self.elements.iter().any(|e| e.kind == TET && !e.groups.is_empty());
        let mut tell = |n: usize, what: &str| {
            if n > 0 {
                told.push(format!("{n} {what}"));
            }
        };
        if any_group {
            tell(count(TET, &|n| n == 0), "tetrahedra are in no physical volume: they make the region `tissue`");
        }
        tell(count(TET, &|n| n > 1), "tetrahedra are in several physical volumes: the first counts");
        tell(count(TRIANGLE, &|n| n == 0), "triangles are in no physical surface and were passed over");
        tell(count(QUAD, &|n| n > 0), "quadrangles in physical surfaces were passed over: tetrahedra have triangles");
        tell(count(LINE, &|n| n > 0), "lines in physical curves were passed over: sets are of points and surfaces");
    }

    fn into_mesh(mut self, path: &Path, told: &mut Vec<String>) -> Result<TetMesh, IoError> {
        self.elements.sort_by_key(|e| e.tag);
        let mut index: Vec<(u64, u32)> = self.tags.iter().copied().zip(0u32..).collect();
        index.sort_unstable();
        if let Some(pair) = index.windows(2).find(|w| w[0].0 == w[1].0) {
            return Err(IoError::format(path, "$Nodes", format!("node {} twice", pair[0].0), "each node once"));
        }
        self.tell_ungrouped(told);
        let node = |tag: u64| {
            let found = index.binary_search_by_key(&tag, |p| p.0).ok().map(|k| index[k].1);
            found.ok_or_else(|| IoError::format(path, "$Elements", format!("node {tag}"), "a node of $Nodes"))
        };
        let mut volumes = self.group_names(3, TET, "region");
        let ungrouped = self.elements.iter().any(|e| e.kind == TET && e.groups.is_empty());
        if ungrouped {
            volumes.insert(i64::MAX, "tissue".into());
        }
        let surfaces = self.group_names(2, TRIANGLE, "faces");
        let points = self.group_names(0, POINT, "nodes");
        let mut mesh = TetMesh { region_names: volumes.values().cloned().collect(), ..TetMesh::default() };
        mesh.face_sets = surfaces.values().map(|n| FaceSet { name: n.clone(), triangles: Vec::new() }).collect();
        mesh.node_sets = points.values().map(|n| NodeSet { name: n.clone(), nodes: Vec::new() }).collect();
        let rank = |names: &BTreeMap<i64, String>, t: i64| names.range(..t).count();
        let volume_rank: BTreeMap<i64, u32> = volumes.keys().copied().zip(0u32..).collect();
        for e in &self.elements {
            let nodes = e.nodes.iter().map(|&t| node(t)).collect::<Result<Vec<_>, _>>()?;
            match (e.kind, nodes.as_slice()) {
                (TET, &[a, b, c, d]) => {
                    mesh.tets.push([a, b, c, d]);
                    mesh.region.push(volume_rank[e.groups.first().unwrap_or(&i64::MAX)]);
                }
                (TRIANGLE, &[a, b, c]) => {
                    e.groups.iter().for_each(|&t| mesh.face_sets[rank(&surfaces, t)].triangles.push([a, b, c]));
                }
                (POINT, &[a]) => e.groups.iter().for_each(|&t| mesh.node_sets[rank(&points, t)].nodes.push(a)),
                _ => {}
            }
        }
        mesh.node_sets.iter_mut().for_each(|s| {
            s.nodes.sort_unstable();
            s.nodes.dedup();
        });
        mesh.nodes = self.nodes;
        Ok(mesh)
    }
}
