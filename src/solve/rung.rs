//! The rungs of recovery. All are there; one can be left out to measure what it buys (`cutis torture --ablate`).

/// A means against hard cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rung {
    /// The start of a step from the factor at hand.
    Predictor,
    /// The bones' common rigid motion, taken by all nodes first.
    RigidMotion,
    /// Shortening a step until the energy falls.
    LineSearch,
    /// Element tangents without negative eigenvalues where the true stiffness is not positive definite.
    Projection,
    /// The pairs of L-BFGS.
    Memory,
    /// Pieces of load and time.
    Pieces,
    /// Pieces, too, where elements end inside out.
    Inversion,
    /// The corotational stand-in for starts that are inside out.
    StandIn,
}

impl Rung {
    /// Every rung and its name.
    pub const ALL: [(&'static str, Rung); 8] = [
        ("predictor", Rung::Predictor),
        ("rigid-motion", Rung::RigidMotion),
        ("line-search", Rung::LineSearch),
        ("projection", Rung::Projection),
        ("memory", Rung::Memory),
        ("pieces", Rung::Pieces),
        ("inversion", Rung::Inversion),
        ("stand-in", Rung::StandIn),
    ];
}
