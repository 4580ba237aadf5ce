//! What one tissue consists of: its law, and what stands on top of it.

use std::cell::OnceCell;
use std::collections::BTreeSet;

use toml::Spanned;

use super::SceneError;
use super::build::Builder;
use super::depth::Depth;
use super::file::{DamageSpec, FibreSpec, GradeSpec, LimitSpec, TensionSpec, TissueSpec};
use crate::effect::{
    Balance, Branches, Damaged, Elements, Fibre, Graded, Law, Limits, Measure, NodalPressure, Prestress, Softening,
    Tuned, Tuning, damping_memory, nearest_on_path, stiffness_damping,
};
use crate::energy::{Energy, Lame, Linear, StrainLimit};
use crate::fem::{Material, Term};
use crate::math::Vec3;
use crate::mesh::TetMesh;

/// Volumetric stiffness that stays in the elements beside averaged nodal pressure, in units of the shear modulus.
const LEFT_IN_ELEMENTS: f64 = 0.3;
/// Stiffness of strain limits in units of Young's modulus.
const LIMIT_STIFFNESS: f64 = 10.0;

/// Fields of the mesh that some tissues ask for, found when the first does.
pub(super) struct Fields<'a> {
    pub mesh: &'a TetMesh,
    pub bones: BTreeSet<u32>,
    pub depth: OnceCell<Depth>,
}

/// Grows as tissues are added.
#[derive(Default)]
pub(super) struct Terms {
    pub terms: Vec<Box<dyn Term>>,
    pub n_history: usize,
}

impl Builder<'_> {
    /// Adds the terms of one tissue on its elements; `beta` is its stiffness damping in s, 0 for none.
    #[allow(clippy::too_many_arguments)] // a tissue is its keys, its law, its elements and what the scene says of all
    pub(super) fn add_tissue(
        &self,
        spec: &TissueSpec,
        law: &Law,
        constants: &[Vec<f64>],
        beta: f64,
        elements: Elements,
        tuning: Option<Tuning>,
        fields: &Fields,
        out: &mut Terms,
    ) -> Result<(), SceneError> {
        let factor = spec.grade.as_ref().map(|g| self.factors(g, elements, fields)).transpose()?;
        let graded = |material: Box<dyn Material>| -> Box<dyn Material> {
            match &factor {
                Some(factor) => Box::new(Graded { material, factor: factor.clone() }),
                None => material,
            }
        };
        let tuned = |material: Box<dyn Material>| -> Box<dyn Material> {
            match tuning {
                Some(tuning) => Box::new(Tuned { material, tuning }),
                None => material,
            }
        };
        let Lame { mu, lambda } = (law.moduli)(constants);
        let nodal = self.text.choice("tissue", "pressure", &spec.pressure)? == Some("nodal");
        if let (Some(at), false) = (spec.pressure.as_ref().filter(|_| nodal), elements.midsides.is_empty()) {
            let message = "`pressure` = \"nodal\" is for linear tetrahedra; quadratic ones do not lock".to_owned();
            return Err(self.text.at(at.span().start, message));
        }
        let left = (LEFT_IN_ELEMENTS * mu).min(lambda);
        let softer;
        let mut own = constants;
        if nodal && lambda > left {
            let k = |e: usize| (lambda - left) * factor.as_ref().map_or(1.0, |f| f[e]);
            let pressure = NodalPressure::new(law.volume, elements, k);
            out.terms.push(Box::new(match tuning {
                Some(tuning) => pressure.tuned(tuning),
                None => pressure,
            }));
            softer = law.with_lambda(constants, left);
            own = &softer;
        }
        if let Some(damage) = &spec.damage {
            let softening = self.softening("tissue.damage", damage)?;
            let damaged = Damaged { intact: tuned((law.material)(own)), softening, first: out.n_history };
            out.n_history += elements.n_points();
            out.terms.push(elements.of(graded(Box::new(damaged))));
        } else if factor.is_some() {
            out.terms.push(elements.of(graded(tuned((law.material)(own)))));
        } else if let Some(tuning) = tuning {
            out.terms.push((law.tuned)(own, elements, tuning));
        } else {
            out.terms.push((law.term)(own, elements));
        }
        if beta > 0.0 {
            let measure = if law.name == Linear::NAME { Measure::Small } else { Measure::Finite };
            let Lame { mu, lambda } = (law.moduli)(own);
            let damping = Lame { mu: beta * mu, lambda: beta * lambda };
            out.terms.push(elements.of(graded(tuned(stiffness_damping(damping, measure, out.n_history)))));
            out.n_history += damping_memory(&elements);
        }
        if let Some(spec) = &spec.viscous {
            let branches = Branches { series: self.series(spec)?, first: out.n_history };
            out.n_history += branches.memory(&elements);
            out.terms.push(elements.of(graded(tuned((law.viscous)(constants, branches)))));
        }
        if let Some(spec) = &spec.fibre {
            let fibre = self.fibre(spec, elements, fields)?;
            let fibre: Box<dyn Material> = match &spec.damage {
                Some(damage) => {
                    let softening = self.softening("tissue.damage", damage)?;
                    let first = out.n_history;
                    out.n_history += elements.n_points();
                    Box::new(Damaged { intact: fibre, softening, first })
                }
                None => Box::new(fibre),
            };
            out.terms.push(elements.of(graded(fibre)));
        }
        if let Some(spec) = &spec.limit {
            let E = mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu);
            let limits = self.limits(spec, E, elements, fields)?;
            out.terms.push(match tuning.filter(|_| spec.stiffness.is_none()) {
                Some(tuning) => elements.of(Tuned { material: limits, tuning }),
                None => elements.of(limits),
            });
        }
        if let Some(spec) = &spec.tension {
            let tension = elements.of(self.prestress(spec, elements, fields)?);
            out.terms.push(Box::new(Balance::of(&*tension, elements.X)));
            out.terms.push(tension);
        }
        Ok(())
    }

    /// The depth field, or an error at `at` if there is none.
    fn depth<'a>(&self, fields: &'a Fields, at: usize) -> Result<&'a Depth, SceneError> {
        if let Some(depth) = fields.depth.get() {
            return Ok(depth);
        }
        let depth = match Depth::new(fields.mesh, &fields.bones) {
            Some(Ok(depth)) => depth,
            Some(Err(e)) => return Err(self.text.at(at, format!("the depth below the skin cannot be found: {e}"))),
            None => {
                let message = "depth below the skin needs a mesh with a skin, and a bone".to_owned();
                return Err(self.text.at(at, message));
            }
        };
        Ok(fields.depth.get_or_init(|| depth))
    }

    fn factors(&self, spec: &GradeSpec, elements: Elements, fields: &Fields) -> Result<Vec<f64>, SceneError> {
        let (depth, factor) = (spec.depth.get_ref(), spec.factor.get_ref());
        self.text.all_in_range("tissue.grade", "depth", &spec.depth)?;
        self.text.all_in_range("tissue.grade", "factor", &spec.factor)?;
        if depth.is_empty() || depth.len() != factor.len() || depth.windows(2).any(|d| d[0] >= d[1]) {
            let message = format!(
                "a grade takes as many `factor` as `depth`, at least one, with `depth` rising; found {} and {}",
                factor.len(),
                depth.len()
            );
            return Err(self.text.at(spec.depth.span().start, message));
        }
        let field = self.depth(fields, spec.depth.span().start)?;
        Ok(elements.at_points(|e, L| piecewise(depth, factor, field.at(&elements.tets[e], L))))
    }

    fn softening(&self, table: &str, spec: &DamageSpec) -> Result<Softening, SceneError> {
        Ok(Softening {
            onset: self.text.checked(table, "onset", &spec.onset)?,
            scale: self.text.checked(table, "scale", &spec.scale)?,
            most: self.text.number(table, "most", &spec.most)?.unwrap_or(0.99),
        })
    }

    fn fibre(&self, spec: &FibreSpec, elements: Elements, fields: &Fields) -> Result<Fibre, SceneError> {
        let place = spec.k1.span().start;
        let mut direction = match (&spec.direction, &spec.path) {
            (Some(d), None) => vec![self.direction("tissue.fibre", d)?; elements.n_points()],
            (None, Some(path)) => {
                let path = self.path(path)?;
                elements.at_points(|e, L| nearest_on_path(&path, &place_in(elements, e, L)).0)
            }
            _ => {
                let message = "[tissue.fibre] takes exactly one of `direction` and `path`".to_owned();
                return Err(self.text.at(place, message));
            }
        };
        if spec.in_skin == Some(true) {
            let depth = self.depth(fields, place)?;
            let per_element = elements.places().len();
            for (p, d) in direction.iter_mut().enumerate() {
                *d = in_plane(d, &depth.inward(&elements.tets[p / per_element], elements.X));
            }
        }
        Ok(Fibre {
            direction,
            k1: self.text.checked("tissue.fibre", "k1", &spec.k1)?,
            k2: self.text.checked("tissue.fibre", "k2", &spec.k2)?,
            kappa: self.text.number("tissue.fibre", "dispersion", &spec.dispersion)?.unwrap_or(0.0),
            slack: self.text.number("tissue.fibre", "slack", &spec.slack)?.unwrap_or(1.0),
        })
    }

    fn limits(&self, spec: &LimitSpec, E: f64, elements: Elements, fields: &Fields) -> Result<Limits, SceneError> {
        let number = |key: &str, value: &Option<Spanned<f64>>| self.text.number("tissue.limit", key, value);
        let longest = number("longest", &spec.longest)?.unwrap_or(1.5);
        let shortest = number("shortest", &spec.shortest)?.unwrap_or(0.75);
        let band = number("band", &spec.band)?.unwrap_or(0.02);
        let at_bone =
            (number("longest_at_bone", &spec.longest_at_bone)?, number("shortest_at_bone", &spec.shortest_at_bone)?);
        let deep = (at_bone.0.unwrap_or(longest), at_bone.1.unwrap_or(shortest));
        if longest.min(deep.0) - band < 1.0 || shortest.max(deep.1) + band > 1.0 {
            let message = format!(
                "the band {band} of [tissue.limit] reaches the rest length: make it narrower than the limits {longest} \
                 and {shortest} (at the bone {} and {}) are from 1",
                deep.0, deep.1
            );
            let places = [&spec.band, &spec.longest, &spec.shortest, &spec.longest_at_bone, &spec.shortest_at_bone];
            return Err(self.text.at(places.iter().find_map(|p| p.as_ref()).map_or(0, |p| p.span().start), message));
        }
        let stiffness = number("stiffness", &spec.stiffness)?.unwrap_or(LIMIT_STIFFNESS * E);
        let limit = |t: f64| StrainLimit {
            longest: longest + t * (deep.0 - longest),
            shortest: shortest + t * (deep.1 - shortest),
            band,
            stiffness,
        };
        let Some(place) = spec.longest_at_bone.as_ref().or(spec.shortest_at_bone.as_ref()) else {
            return Ok(Limits(vec![limit(0.0); elements.n_points()]));
        };
        let depth = self.depth(fields, place.span().start)?;
        Ok(Limits(elements.at_points(|e, L| limit(depth.at(&elements.tets[e], L)))))
    }

    fn prestress(&self, spec: &TensionSpec, elements: Elements, fields: &Fields) -> Result<Prestress, SceneError> {
        let along = self.text.checked("tissue.tension", "along", &spec.along)?;
        let across = self.text.number("tissue.tension", "across", &spec.across)?.unwrap_or(along);
        let direction = match &spec.direction {
            Some(d) => self.direction("tissue.tension", d)?,
            None if across == along => Vec3::x(),
            None => {
                let message = "[tissue.tension] with `along` and `across` takes a `direction`".to_owned();
                return Err(self.text.at(spec.along.span().start, message));
            }
        };
        let depth = self.depth(fields, spec.along.span().start)?;
        Ok(Prestress {
            S0: elements.at_points(|e, _| {
                let normal = depth.inward(&elements.tets[e], elements.X);
                let a = in_plane(&direction, &normal);
                let b = normal.cross(&a);
                along * a * a.transpose() + across * b * b.transpose()
            }),
        })
    }

    fn direction(&self, table: &str, d: &Spanned<[f64; 3]>) -> Result<Vec3, SceneError> {
        let message = || self.text.at(d.span().start, "`direction` must not be zero".to_owned());
        self.text.vector(table, "direction", d)?.try_normalize(0.0).ok_or_else(message)
    }

    /// A line of at least two points.
    pub(super) fn path(&self, path: &Spanned<Vec<[f64; 3]>>) -> Result<Vec<Vec3>, SceneError> {
        let points: Vec<Vec3> = path.get_ref().iter().map(|p| Vec3::from(*p)).collect();
        let sound = points.len() >= 2
            && points.iter().all(|p| p.iter().all(|c| c.is_finite()))
            && points.windows(2).all(|s| s[0] != s[1]);
        if sound {
            return Ok(points);
        }
        let message = "`path` takes at least two finite points, each other than the one before".to_owned();
        Err(self.text.at(path.span().start, message))
    }
}

fn place_in(elements: Elements, e: usize, L: &[f64; 4]) -> Vec3 {
    elements.tets[e].iter().zip(L).map(|(&a, L)| *L * elements.X[a as usize]).sum()
}

/// The unit vector across `normal` that is nearest to `d`; any, where `d` stands upright.
fn in_plane(d: &Vec3, normal: &Vec3) -> Vec3 {
    const UPRIGHT: f64 = 1e-6;
    let least = normal.iamin();
    let axis = Vec3::from_fn(|i, _| if i == least { 1.0 } else { 0.0 });
    let flat = |v: &Vec3| v - normal.dot(v) * normal;
    flat(d).try_normalize(UPRIGHT).unwrap_or_else(|| flat(&axis).normalize())
}

/// Linear between the places, constant outside.
fn piecewise(places: &[f64], values: &[f64], at: f64) -> f64 {
    let k = places.partition_point(|p| *p <= at);
    match (k.checked_sub(1), places.get(k)) {
        (None, _) => values[0],
        (Some(i), None) => values[i],
        (Some(i), Some(next)) => values[i] + (at - places[i]) / (next - places[i]) * (values[k] - values[i]),
    }
}
