//! How tetrahedra hang together: face neighbours, components, boundary edges.

pub(super) use crate::mesh::FACES;

/// No neighbour: the face is on the boundary.
pub(super) const OPEN: u32 = u32::MAX;

/// For each tetrahedron the neighbour across the face opposite each corner.
pub(super) fn neighbours(tets: &[[u32; 4]]) -> Vec<[u32; 4]> {
    let n_nodes = tets.as_flattened().iter().max().map_or(0, |&a| a as usize + 1);
    // Faces in buckets by their lowest node: short lists, no hashing.
    let mut begin = vec![0u32; n_nodes + 1];
    let key = |tet: &[u32; 4], f: usize| {
        let mut k = FACES[f].map(|a| tet[a]);
        k.sort_unstable();
        k
    };
    for tet in tets {
        for f in 0..4 {
            begin[key(tet, f)[0] as usize + 1] += 1;
        }
    }
    for a in 0..n_nodes {
        begin[a + 1] += begin[a];
    }
    let mut place = begin.clone();
    let mut faces = vec![([0u32; 2], 0u32); 4 * tets.len()];
    for (e, tet) in tets.iter().enumerate() {
        for f in 0..4 {
            let [a, b, c] = key(tet, f);
            faces[place[a as usize] as usize] = ([b, c], (4 * e + f) as u32);
            place[a as usize] += 1;
        }
    }
    let mut out = vec![[OPEN; 4]; tets.len()];
    for a in 0..n_nodes {
        let bucket = &mut faces[begin[a] as usize..begin[a + 1] as usize];
        bucket.sort_unstable();
        for pair in bucket.windows(2) {
            if pair[0].0 == pair[1].0 {
                let (p, q) = (pair[0].1 as usize, pair[1].1 as usize);
                out[p / 4][p % 4] = (q / 4) as u32;
                out[q / 4][q % 4] = (p / 4) as u32;
            }
        }
    }
    out
}

/// Component number of each tetrahedron, connected through faces, and the number of components.
pub(super) fn components(neighbours: &[[u32; 4]]) -> (Vec<u32>, usize) {
    let mut component = vec![OPEN; neighbours.len()];
    let mut n = 0;
    let mut stack = Vec::new();
    for seed in 0..neighbours.len() {
        if component[seed] != OPEN {
            continue;
        }
        component[seed] = n;
        stack.push(seed);
        while let Some(e) = stack.pop() {
            for &other in neighbours[e].iter().filter(|&&o| o != OPEN) {
                if component[other as usize] == OPEN {
                    component[other as usize] = n;
                    stack.push(other as usize);
                }
            }
        }
        n += 1;
    }
    (component, n as usize)
}

/// Boundary triangles, wound outward, with the tetrahedron each closes.
pub(super) fn boundary(tets: &[[u32; 4]], neighbours: &[[u32; 4]]) -> Vec<([u32; 3], u32)> {
    let mut out = Vec::new();
    for (e, tet) in tets.iter().enumerate() {
        for f in (0..4).filter(|&f| neighbours[e][f] == OPEN) {
            out.push((FACES[f].map(|a| tet[a]), e as u32));
        }
    }
    out
}

/// Boundary edges that more than two boundary triangles share.
pub(super) fn pinched_edges(boundary: &[([u32; 3], u32)]) -> Vec<[u32; 2]> {
    let mut edges = Vec::with_capacity(3 * boundary.len());
    for ([a, b, c], _) in boundary {
        edges.extend([(a, b), (b, c), (c, a)].map(|(p, q)| [*p.min(q), *p.max(q)]));
    }
    edges.sort_unstable();
    edges.chunk_by(|p, q| p == q).filter(|g| g.len() > 2).map(|g| g[0]).collect()
}

/// Tetrahedra round each node, for the nodes that `wanted` names: begin offsets and items.
pub(super) fn stars(tets: &[[u32; 4]], n_nodes: usize, wanted: &[bool]) -> (Vec<u32>, Vec<u32>) {
    let mut begin = vec![0u32; n_nodes + 1];
    let each = |visit: &mut dyn FnMut(usize, usize)| {
        for (e, tet) in tets.iter().enumerate() {
            tet.iter().filter(|&&a| wanted[a as usize]).for_each(|&a| visit(a as usize, e));
        }
    };
    each(&mut |a, _| begin[a + 1] += 1);
    for a in 0..n_nodes {
        begin[a + 1] += begin[a];
    }
    let mut place = begin.clone();
    let mut items = vec![0; begin[n_nodes] as usize];
    each(&mut |a, e| {
        items[place[a] as usize] = e as u32;
        place[a] += 1;
    });
    (begin, items)
}

/// Groups the tetrahedra of a star by the faces they share at `node`; `groups[k]` numbers the group of `star[k]`.
pub(super) fn fans(star: &[u32], node: u32, tets: &[[u32; 4]], neighbours: &[[u32; 4]]) -> (Vec<u32>, u32) {
    let mut group = vec![OPEN; star.len()];
    let mut n = 0;
    let mut stack = Vec::new();
    for seed in 0..star.len() {
        if group[seed] != OPEN {
            continue;
        }
        group[seed] = n;
        stack.push(seed);
        while let Some(k) = stack.pop() {
            let e = star[k] as usize;
            for f in (0..4).filter(|&f| tets[e][f] != node && neighbours[e][f] != OPEN) {
                if let Ok(other) = star.binary_search(&neighbours[e][f])
                    && group[other] == OPEN
                {
                    group[other] = n;
                    stack.push(other);
                }
            }
        }
        n += 1;
    }
    (group, n)
}
