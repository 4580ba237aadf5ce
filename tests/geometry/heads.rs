//! Heads made from other heads: turned, mirrored, cut, in thick slices, noisy, streaked, of other size, the jaw moved. Each
//! carries its true labels and condyles along.
#![allow(non_snake_case)]
use cutis::geometry::{Grid, Labels, Volume};
use cutis::math::{Mat3, Random, Vec3, exp_rotation};

pub const MM: f64 = 1e-3;
/// Numbers of labels.
pub const SKULL: u8 = 2;
pub const MANDIBLE: u8 = 3;
pub const SPINE: u8 = 4;
const AIR: f32 = -1024.0;

/// A scan and what is true of it.
#[derive(Clone)]
pub struct Head {
    pub volume: Volume,
    pub labels: Labels,
    /// Right and left condyle, m.
    pub condyles: [Vec3; 2],
}

/// Positions of all samples, first axis fastest.
pub fn points(grid: &Grid) -> impl Iterator<Item = Vec3> {
    let [nx, ny, nz] = grid.dims;
    let cells = (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])));
    cells.map(|c| grid.world(&Vec3::from(c.map(|n| n as f64))))
}

fn inside(grid: &Grid, p: &Vec3) -> bool {
    let c = grid.coordinates(p);
    (0..3).all(|a| c[a] >= -0.5 && c[a] <= grid.dims[a] as f64 - 0.5)
}

impl Head {
    /// The same head sampled on another grid, `from` leading from its places to this one's.
    fn resampled(&self, grid: Grid, from: impl Fn(&Vec3) -> Vec3, to: impl Fn(&Vec3) -> Vec3) -> Self {
        let here = |p: &Vec3| {
            let q = from(p);
            if inside(&self.volume.grid, &q) { self.volume.sample(&q) as f32 } else { AIR }
        };
        let samples = points(&grid).map(|p| here(&p)).collect();
        let ids = points(&grid).map(|p| self.labels.at(&from(&p))).collect();
        let condyles = self.condyles.map(|c| to(&c));
        Self { volume: Volume { grid: grid.clone(), samples }, labels: Labels { grid, ids }, condyles }
    }

    /// On cubes of edge `h`, m.
    pub fn cubes(&self, h: f64) -> Self {
        let [low, high] = self.volume.grid.bounds();
        let dims = [0, 1, 2].map(|a| ((high[a] - low[a]) / h) as usize + 1);
        let grid = Grid { dims, spacing: Vec3::repeat(h), origin: low, direction: Mat3::identity() };
        self.resampled(grid, |p| *p, |p| *p)
    }

    /// Turned by degrees about axis 0, 1 or 2 of the patient through the middle; the field is wider by 30 mm on each side.
    pub fn turned(&self, axis: usize, degrees: f64) -> Self {
        let [low, high] = self.volume.grid.bounds();
        let middle = 0.5 * (low + high);
        let R = exp_rotation(&Vec3::from_fn(|a, _| if a == axis { degrees.to_radians() } else { 0.0 }));
        let h = self.volume.grid.spacing;
        let rim = Vec3::repeat(30.0 * MM);
        let dims = [0, 1, 2].map(|a| ((high - low + 2.0 * rim)[a] / h[a]) as usize + 1);
        let grid = Grid { dims, spacing: h, origin: low - rim, direction: Mat3::identity() };
        self.resampled(grid, |p| middle + R.transpose() * (p - middle), |p| middle + R * (p - middle))
    }

    /// Left and right exchanged.
    pub fn mirrored(&self) -> Self {
        let [low, high] = self.volume.grid.bounds();
        let image = move |p: &Vec3| Vec3::new(low.x + high.x - p.x, p.y, p.z);
        let mut head = self.resampled(self.volume.grid.clone(), image, image);
        head.condyles.swap(0, 1);
        head
    }

    /// What lies between two corners.
    pub fn cut(&self, from: Vec3, to: Vec3) -> Self {
        let old = &self.volume.grid;
        let [low, high] = old.bounds();
        let (from, to) = (from.sup(&low), to.inf(&high));
        let first = ((from - low).component_div(&old.spacing)).map(f64::ceil);
        let dims = [0, 1, 2].map(|a| ((to[a] - low[a]) / old.spacing[a] - first[a] + 1.0) as usize);
        let grid = Grid { dims, origin: low + first.component_mul(&old.spacing), ..old.clone() };
        self.resampled(grid, |p| *p, |p| *p)
    }

    /// In slices of thickness `dz`, m, each the mean over itself.
    pub fn slices(&self, dz: f64) -> Self {
        let old = &self.volume.grid;
        let n = ((old.dims[2] as f64 - 1.0) * old.spacing.z / dz) as usize + 1;
        let grid = Grid {
            dims: [old.dims[0], old.dims[1], n],
            spacing: Vec3::new(old.spacing.x, old.spacing.y, dz),
            ..old.clone()
        };
        let mut head = self.resampled(grid.clone(), |p| *p, |p| *p);
        let shares = [-0.4, -0.2, 0.0, 0.2, 0.4];
        let mean =
            |p: Vec3| shares.iter().map(|s| self.volume.sample(&(p + Vec3::new(0.0, 0.0, s * dz)))).sum::<f64>() / 5.0;
        head.volume.samples = points(&grid).map(|p| mean(p) as f32).collect();
        head
    }

    /// With noise of a standard deviation in HU.
    pub fn noisy(&self, sd: f64) -> Self {
        let mut random = Random(11);
        let mut head = self.clone();
        for s in &mut head.volume.samples {
            let sum: f64 = (0..6).map(|_| random.number()).sum();
            *s = (f64::from(*s) + sd * (sum - 3.0) * std::f64::consts::SQRT_2).clamp(-1024.0, 3071.0) as f32;
        }
        head
    }

    /// All lengths times a factor.
    pub fn scaled(&self, f: f64) -> Self {
        let mut head = self.clone();
        for grid in [&mut head.volume.grid, &mut head.labels.grid] {
            grid.spacing *= f;
            grid.origin *= f;
        }
        head.condyles = head.condyles.map(|c| c * f);
        head
    }

    /// Corners of the mandible's box.
    pub fn jaw_box(&self) -> [Vec3; 2] {
        let far = Vec3::repeat(f64::INFINITY);
        let of =
            |([l, h], (p, id)): ([Vec3; 2], (Vec3, &u8))| if *id == MANDIBLE { [l.inf(&p), h.sup(&p)] } else { [l, h] };
        points(&self.labels.grid).zip(&self.labels.ids).fold([far, -far], |b, i| of((b, i)))
    }

    /// Fillings that throw streaks through their slices.
    pub fn streaked(&self, seed: u64, fillings: usize) -> Self {
        let mut head = self.clone();
        let mut random = Random(seed);
        let grid = &self.volume.grid;
        let [low, high] = self.jaw_box();
        let teeth: Vec<Vec3> = points(grid)
            .zip(&self.labels.ids)
            .zip(&self.volume.samples)
            .filter(|((p, id), hu)| {
                (**id == SKULL || **id == MANDIBLE)
                    && **hu > 1100.0
                    && (p.z - (low.z + 0.5 * (high.z - low.z))).abs() < 14.0 * MM
                    && p.y < low.y + 0.55 * (high.y - low.y)
            })
            .map(|((p, _), _)| p)
            .collect();
        assert!(!teeth.is_empty());
        for _ in 0..fillings {
            let at = teeth[(random.number() * teeth.len() as f64) as usize];
            let phase: Vec<f64> = (0..4).map(|_| std::f64::consts::TAU * random.number()).collect();
            for (p, s) in points(grid).zip(&mut head.volume.samples) {
                if (p.z - at.z).abs() > 1.6 * MM {
                    continue;
                }
                let (x, y) = ((p.x - at.x) / MM, (p.y - at.y) / MM);
                let r = x.hypot(y);
                if r < 3.0 {
                    *s = 3000.0;
                } else if *s > -300.0 {
                    let waves: f64 =
                        [6.0, 10.0, 14.0, 22.0].iter().zip(&phase).map(|(f, q)| (f * y.atan2(x) + q).cos()).sum();
                    *s = (f64::from(*s) + 900.0 * waves * (-r / 35.0).exp()).clamp(-1024.0, 3071.0) as f32;
                }
            }
        }
        head
    }

    /// The mandible turned about its hinge: positive degrees open the mouth.
    pub fn opened(&self, degrees: f64) -> Self {
        let [right, left] = self.condyles;
        let (hinge, axis) = (0.5 * (right + left), (left - right).normalize());
        let R = exp_rotation(&(axis * degrees.to_radians()));
        let grid = &self.volume.grid;
        let mut head = self.clone();
        // A voxel of the bone's soft rim moves along.
        let near = |p: &Vec3| {
            let h = grid.spacing;
            self.labels.at(p) == MANDIBLE
                || (0..3).any(|a| {
                    [-h[a], h[a]]
                        .iter()
                        .any(|d| self.labels.at(&(p + Vec3::from_fn(|b, _| if a == b { *d } else { 0.0 }))) == MANDIBLE)
                })
        };
        let tissue = 40.0f32;
        for (at, p) in points(grid).enumerate() {
            if near(&p) {
                head.volume.samples[at] = tissue;
                if head.labels.ids[at] == MANDIBLE {
                    head.labels.ids[at] = 1;
                }
            }
        }
        for (at, p) in points(grid).enumerate() {
            let q = hinge + R.transpose() * (p - hinge);
            if near(&q) {
                let moved = self.volume.sample(&q) as f32;
                if moved > head.volume.samples[at] {
                    head.volume.samples[at] = moved;
                }
                if self.labels.at(&q) == MANDIBLE && ![SKULL, SPINE].contains(&head.labels.ids[at]) {
                    head.labels.ids[at] = MANDIBLE;
                }
            }
        }
        head
    }
}

/// How well labels fit the truth, over bone in the jaw's box and 12 mm about it.
#[derive(Debug, Clone, Copy)]
pub struct Score {
    /// Share of the mandible, of the other bones and of both that is right; of those on the bone's surface.
    pub mandible: f64,
    pub rest: f64,
    pub both: f64,
    pub surface: f64,
}

impl std::fmt::Display for Score {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { mandible, rest, both, surface } = self;
        write!(f, "mandible {mandible:.3}, rest {rest:.3}, bone {both:.3}, its surface {surface:.3}")
    }
}

/// The score of labels on the head's own grid.
pub fn score(found: &Labels, head: &Head, bone: f64) -> Score {
    let grid = &head.volume.grid;
    assert_eq!(found.grid.dims, grid.dims);
    let [low, high] = head.jaw_box();
    let rim = Vec3::repeat(12.0 * MM);
    let (low, high) = (low - rim, high + rim);
    let [nx, ny, nz] = grid.dims;
    let is_bone = |at: usize| f64::from(head.volume.samples[at]) >= bone;
    let mut n = [[0usize; 2]; 4];
    for (at, p) in points(grid).enumerate() {
        let (truth, label) = (head.labels.ids[at], found.ids[at]);
        let known = [SKULL, MANDIBLE, SPINE].contains(&truth);
        if !known || !is_bone(at) || (0..3).any(|a| p[a] < low[a] || p[a] > high[a]) {
            continue;
        }
        let right = (truth == MANDIBLE) == (label == MANDIBLE);
        let (i, j, k) = (at % nx, at / nx % ny, at / (nx * ny));
        let rim = i == 0 || j == 0 || k == 0 || i + 1 == nx || j + 1 == ny || k + 1 == nz;
        let surface = rim || [1, nx, nx * ny].iter().any(|s| !is_bone(at - s) || !is_bone(at + s));
        for (c, counts) in [(truth == MANDIBLE, 0), (truth != MANDIBLE, 1), (true, 2), (surface, 3)] {
            if c {
                n[counts][0] += 1;
                n[counts][1] += usize::from(right);
            }
        }
    }
    let share = |k: usize| n[k][1] as f64 / n[k][0].max(1) as f64;
    Score { mandible: share(0), rest: share(1), both: share(2), surface: share(3) }
}

/// Labels without islands of mandible below 1 mL: they are streaks that a threshold took for bone.
pub fn without_islands(head: &mut Head, bone: f64) {
    let grid = head.volume.grid.clone();
    let [nx, ny, nz] = grid.dims;
    let mut seen = vec![false; grid.len()];
    let is_jaw = |head: &Head, at: usize| head.labels.ids[at] == MANDIBLE && f64::from(head.volume.samples[at]) >= bone;
    for seed in 0..grid.len() {
        if seen[seed] || !is_jaw(head, seed) {
            continue;
        }
        let (mut piece, mut next) = (vec![seed], 0);
        seen[seed] = true;
        while next < piece.len() {
            let at = piece[next];
            next += 1;
            let c = [at % nx, at / nx % ny, at / (nx * ny)];
            for (a, s) in [1, nx, nx * ny].into_iter().enumerate() {
                let n = [nx, ny, nz][a];
                for other in [(c[a] > 0).then(|| at - s), (c[a] + 1 < n).then(|| at + s)].into_iter().flatten() {
                    if !seen[other] && is_jaw(head, other) {
                        seen[other] = true;
                        piece.push(other);
                    }
                }
            }
        }
        if piece.len() as f64 * grid.spacing.product() < 1e-6 {
            piece.into_iter().for_each(|at| head.labels.ids[at] = 9);
        }
    }
}
