//! An octree over a box, balanced 2:1 over all 26 neighbours: a bit for each cell that is refined, level by level.

/// What stands at a place of a level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cell {
    /// A coarser leaf is there.
    Absent,
    Leaf,
    Refined,
}

/// Bits of a box of cells, x fastest.
pub(super) struct Bits {
    dims: [usize; 3],
    words: Vec<u64>,
}

impl Bits {
    pub fn new(dims: [usize; 3]) -> Self {
        Self { dims, words: vec![0; dims.iter().product::<usize>().div_ceil(64)] }
    }

    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.dims[1] + j) * self.dims[0] + i
    }

    pub fn get(&self, c: [usize; 3]) -> bool {
        let at = self.index(c);
        self.words[at / 64] >> (at % 64) & 1 == 1
    }

    /// Sets a bit; whether it was not set before.
    pub fn set(&mut self, c: [usize; 3]) -> bool {
        let at = self.index(c);
        let new = self.words[at / 64] >> (at % 64) & 1 == 0;
        self.words[at / 64] |= 1 << (at % 64);
        new
    }
}

/// Cells by level, the coarsest first; level l has `roots << l` cells along each axis, the last has no refined ones.
pub(super) struct Octree {
    pub roots: [usize; 3],
    refined: Vec<Bits>,
    /// The refined cells of each level, sorted.
    list: Vec<Vec<[u32; 3]>>,
}

/// Every place of a box of cells.
fn places([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])))
}

impl Octree {
    /// Refines cells that `wants` names (level and place), at most `depth` times, and what balance asks for.
    pub fn new(roots: [usize; 3], depth: usize, mut wants: impl FnMut(usize, [usize; 3]) -> bool) -> Self {
        let dims = |l: usize| roots.map(|n| n << l);
        let refined = (0..depth).map(|l| Bits::new(dims(l))).collect();
        let mut tree = Self { roots, refined, list: vec![Vec::new(); depth] };
        for l in 0..depth {
            for c in tree.cells(l) {
                if wants(l, c) && tree.refined[l].set(c) {
                    tree.list[l].push(c.map(|n| n as u32));
                }
            }
        }
        for l in (1..depth).rev() {
            for c in tree.list[l].clone() {
                let range = |a: usize| {
                    let c = c[a] as usize;
                    c.saturating_sub(1) / 2..=(c + 1).min(dims(l)[a] - 1) / 2
                };
                for k in range(2) {
                    for j in range(1) {
                        for i in range(0) {
                            if tree.refined[l - 1].set([i, j, k]) {
                                tree.list[l - 1].push([i, j, k].map(|n| n as u32));
                            }
                        }
                    }
                }
            }
        }
        tree.list.iter_mut().for_each(|cells| cells.sort_unstable_by_key(|c| [c[2], c[1], c[0]]));
        tree
    }

    /// All cells of a level that exist.
    fn cells(&self, l: usize) -> Vec<[usize; 3]> {
        if l == 0 {
            return places(self.roots).collect();
        }
        let children = |c: &[u32; 3]| {
            let c = *c;
            (0..8).map(move |k| [0, 1, 2].map(|a| 2 * c[a] as usize + (k >> a & 1)))
        };
        self.list[l - 1].iter().flat_map(children).collect()
    }

    pub fn cell(&self, l: usize, c: [usize; 3]) -> Cell {
        if l > 0 && !self.refined[l - 1].get(c.map(|n| n / 2)) {
            Cell::Absent
        } else if self.refined.get(l).is_some_and(|r| r.get(c)) {
            Cell::Refined
        } else {
            Cell::Leaf
        }
    }

    /// Number of the finest level.
    pub fn finest(&self) -> usize {
        self.refined.len()
    }

    /// Every leaf with its level, the coarsest first.
    pub fn leaves(&self) -> Vec<(usize, [usize; 3])> {
        let at =
            |l: usize| self.cells(l).into_iter().filter(move |&c| self.cell(l, c) == Cell::Leaf).map(move |c| (l, c));
        (0..=self.finest()).flat_map(at).collect()
    }
}
