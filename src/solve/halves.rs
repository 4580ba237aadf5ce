//! Two halves of an elimination tree that share nothing but its top.
//!
//! ```text
//!        top            work = top + the larger half
//!       /   \           The root of the largest subtree joins the top as long as that can pay.
//!   half     half
//! ```
//!
//! Nested dissection puts a separator of the mesh at the root, so the top is small and the halves are about even.
//!
//! Source: Geist & Ng, "Task scheduling for parallel sparse Cholesky factorization", Int. J. Parallel Programming
//! 18(4), 1989.

use std::cmp::Reverse;

/// Where a node of the tree belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// One half.
    First,
    /// The other.
    Second,
    /// Waits for both halves, or they for it.
    Top,
}

/// Places of all nodes; node `k` costs `work[k]` and has its parent behind it, roots have none. Everything is top if no
/// halves save anything.
pub fn halves(parent: &[Option<usize>], work: &[usize]) -> Vec<Place> {
    let n = work.len();
    let mut subtree = work.to_vec();
    let mut children = vec![Vec::new(); n];
    let mut roots = Vec::new();
    for k in 0..n {
        match parent[k] {
            Some(p) => {
                subtree[p] += subtree[k];
                children[p].push(k);
            }
            None => roots.push(k),
        }
    }
    let mut least = work.iter().sum();
    let mut top = 0;
    let mut place = vec![Place::Top; n];
    loop {
        roots.sort_by_key(|&k| (Reverse(subtree[k]), k));
        let (dealt, larger) = deal(&roots, &subtree);
        if top + larger < least {
            least = top + larger;
            place.fill(Place::Top);
            for (&k, half) in roots.iter().zip(dealt) {
                place[k] = half;
            }
        }
        match roots.first() {
            Some(&k) if top + work[k] < least => {
                top += work[k];
                roots.swap_remove(0);
                roots.append(&mut children[k]);
            }
            _ => break,
        }
    }
    for k in (0..n).rev() {
        if let (Place::Top, Some(p)) = (place[k], parent[k]) {
            place[k] = place[p];
        }
    }
    place
}

/// Half of each subtree, the largest first: the one with less work so far. Also the work of the larger half.
fn deal(roots: &[usize], subtree: &[usize]) -> (Vec<Place>, usize) {
    let mut sums = [0, 0];
    let put = |&k: &usize| {
        let second = sums[1] < sums[0];
        sums[usize::from(second)] += subtree[k];
        if second { Place::Second } else { Place::First }
    };
    let dealt = roots.iter().map(put).collect();
    (dealt, sums[0].max(sums[1]))
}

#[cfg(test)]
mod tests {
    use super::Place::{First, Second, Top};
    use super::halves;

    #[test]
    fn a_tree_is_cut_below_its_separator() {
        // Two chains of three under a root of two.
        let parent = [Some(1), Some(2), Some(6), Some(4), Some(5), Some(6), Some(7), None];
        let place = halves(&parent, &[4, 4, 4, 4, 4, 4, 1, 1]);
        assert_eq!(place, [First, First, First, Second, Second, Second, Top, Top]);
    }

    #[test]
    fn a_chain_and_nothing_have_no_halves() {
        assert_eq!(halves(&[Some(1), Some(2), None], &[1, 1, 1]), [Top; 3]);
        assert_eq!(halves(&[], &[]), []);
    }

    #[test]
    fn uneven_subtrees_are_dealt_evenly() {
        // Under the root a heavy child with two halves, and a light one that evens them out.
        let parent = [Some(2), Some(2), Some(4), Some(4), None];
        let place = halves(&parent, &[9, 5, 1, 4, 1]);
        assert_eq!(place, [First, Second, Top, Second, Top]);
    }
}
