//! Fill-reducing order of the blocks: nested dissection of the mesh graph.
//!
//! Source: George, "Nested dissection of a regular finite element mesh", SIAM J. Numer. Anal. 10(2), 1973; the
//! multilevel bisection is the crate feral-metis, after Karypis & Kumar, SIAM J. Sci. Comput. 20(1), 1998.

use crate::fem::{Elimination, Pattern};

/// New-to-old order of the blocks: the `known` one if it is of this pattern, else [`nested_dissection`].
pub fn elimination(pattern: &Pattern, known: Option<&Elimination>) -> Option<Vec<u32>> {
    let n = pattern.n();
    match known {
        Some(known) if is_permutation(&known.order, n) && known.pattern == pattern.hash() => Some(known.order.clone()),
        _ => nested_dissection(pattern),
    }
}

/// New-to-old order of the blocks, or `None` where the graph cannot be ordered (too large, or the library refuses):
/// the caller then takes minimum degree.
pub fn nested_dissection(pattern: &Pattern) -> Option<Vec<u32>> {
    let n = pattern.n();
    let mut degree = vec![1i32; n];
    each_edge(pattern, |i, j| {
        degree[i] += 1;
        degree[j] += 1;
    });
    let mut start = vec![0i32; n + 1];
    for j in 0..n {
        start[j + 1] = start[j].checked_add(degree[j])?;
    }
    let mut next: Vec<i32> = start[..n].to_vec();
    let mut row = vec![0i32; start[n] as usize];
    let mut put = |j: usize, i: usize| {
        row[next[j] as usize] = i as i32;
        next[j] += 1;
    };
    // Ascending rows in every column: neighbours below, the diagonal, neighbours above.
    for j in 0..n {
        put(j, j);
        for &i in &pattern.row[pattern.start[j] as usize..pattern.start[j + 1] as usize] {
            if i as usize != j {
                put(i as usize, j);
                put(j, i as usize);
            }
        }
    }
    for j in 0..n {
        row[start[j] as usize..start[j + 1] as usize].sort_unstable();
    }
    let graph = feral_metis::CscPattern::new(n, &start, &row)?;
    let order = feral_metis::metis_order(&graph).ok()?;
    let order: Vec<u32> = order.into_iter().map(u32::try_from).collect::<Result<_, _>>().ok()?;
    is_permutation(&order, n).then_some(order)
}

fn each_edge(pattern: &Pattern, mut edge: impl FnMut(usize, usize)) {
    for j in 0..pattern.n() {
        for &i in &pattern.row[pattern.start[j] as usize..pattern.start[j + 1] as usize] {
            if i as usize != j {
                edge(i as usize, j);
            }
        }
    }
}

fn is_permutation(order: &[u32], n: usize) -> bool {
    let mut seen = vec![false; n];
    order.len() == n && order.iter().all(|&k| (k as usize) < n && !std::mem::replace(&mut seen[k as usize], true))
}
