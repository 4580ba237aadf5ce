//! What is left of a tetrahedron on one side of a surface.
//!
//! The inside corners are ordered by one number for the whole mesh (depth, ties by node); every quadrilateral's diagonal
//! starts at the first of its inside corners; on the surface itself it joins the cuts between lower and between higher
//! nodes, which the other side finds, too. A total order cannot be cyclic, so no prism needs a node in its middle and both
//! neighbours of a face split it alike.
//!
//! Source: F. Labelle & J. R. Shewchuk, "Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral Angles",
//! ACM TOG 26(3), 2007, figure 3.
//! Departure: the order instead of the parity rule, which a graded lattice does not have.

/// Appends the pieces of `tet` where `sign` is negative; `cut` is the node on an edge from - to +, `before` orders nodes.
pub(super) fn clip(
    tet: [u32; 4],
    sign: impl Fn(u32) -> i8,
    before: impl Fn(u32, u32) -> bool,
    cut: impl Fn(u32, u32) -> u32,
    out: &mut Vec<[u32; 4]>,
) {
    let mut inside = [0; 4];
    let mut rest = [0; 4];
    let (mut n_in, mut n_zero, mut n_out) = (0, 0, 0);
    for a in tet {
        if sign(a) < 0 {
            inside[n_in] = a;
            n_in += 1;
        }
    }
    for wanted in [0, 1] {
        for a in tet.into_iter().filter(|&a| sign(a) == wanted) {
            rest[n_zero + n_out] = a;
            if wanted == 0 { n_zero += 1 } else { n_out += 1 }
        }
    }
    // Few corners: an exchange sort keeps the order total and plain.
    for i in 0..n_in {
        for j in i + 1..n_in {
            if before(inside[j], inside[i]) {
                inside.swap(i, j);
            }
        }
    }
    let [a, b, c, _] = inside;
    let [p, q, r, _] = rest;
    match (n_in, n_zero, n_out) {
        (4, ..) => out.push(tet),
        (3, 1, 0) => out.push([a, b, c, p]),
        (2, 2, 0) => out.push([a, b, p, q]),
        (1, 3, 0) => out.push([a, p, q, r]),
        (1, zero, _) => {
            let end = |k: usize, n: u32| if k < zero { n } else { cut(a, n) };
            out.push([a, end(0, p), end(1, q), end(2, r)]);
        }
        (2, 1, 1) => {
            let (ca, cb) = (cut(a, q), cut(b, q));
            out.push([a, b, p, cb]);
            out.push([a, ca, p, cb]);
        }
        (2, 0, 2) => {
            let (low, high) = (p.min(q), p.max(q));
            let (al, ah, bl, bh) = (cut(a, low), cut(a, high), cut(b, low), cut(b, high));
            out.push([a, b, bl, bh]);
            if a < b {
                out.push([a, al, ah, bh]);
                out.push([a, al, bl, bh]);
            } else {
                out.push([a, al, ah, bl]);
                out.push([a, ah, bh, bl]);
            }
        }
        (3, 0, 1) => {
            let (ca, cb, cc) = (cut(a, p), cut(b, p), cut(c, p));
            out.push([a, b, c, cc]);
            out.push([a, b, cb, cc]);
            out.push([a, ca, cb, cc]);
        }
        _ => {}
    }
}
