//! Materials: which tissue each region is made of, laws and their constants, muscles.

use std::cell::OnceCell;

use super::SceneError;
use super::build::Builder;
use super::check::Text;
use super::file::{BoneSpec, MuscleSpec, SceneFile, TissueSpec, ViscousSpec};
use super::keys::find;
use super::tissue::{Fields, Terms};
use crate::effect::{self, Elements, Law, Muscle, Springs, Tuning, nearest_on_path, springs};
use crate::energy::Lame;
use crate::fem::{OnElements, Term};
use crate::math::Vec3;
use crate::mesh::TetMesh;
use crate::sim::MOST_TUNABLE;

/// Above this Poisson's ratio linear tetrahedra lock visibly.
const LOCKING_NU: f64 = 0.45;
/// What is lost of a Poisson's ratio on its way through Lame's constants.
const ROUND_OFF: f64 = 1e-9;
/// The law of a tissue that the scene says nothing of: of those in E and nu the one that bears most.
const DEFAULT_LAW: &str = "polyconvex-neo-hookean";
/// Density of tissue that the scene says nothing of, kg/m3.
const WATER: f64 = 1000.0;

/// What the materials of a scene come to.
pub(super) struct Tissue {
    pub terms: Vec<Box<dyn Term>>,
    /// By region, kg/m3.
    pub density: Vec<f64>,
    pub n_history: usize,
    /// Names and Young's moduli (Pa) of the tissues whose stiffness can be set; the inputs begin with them.
    pub tunable: Vec<(String, f64)>,
}

/// What a tissue is to small strains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SmallStrain {
    /// Young's modulus, Pa.
    pub E: f64,
    /// Poisson's ratio; that of a lattice, 1/4, for tissue made of springs.
    pub nu: f64,
    /// Density, kg/m3.
    pub density: f64,
}

/// Small-strain constants of each tissue of a scene `text`.
///
/// # Errors
/// [`SceneError`] with line and column.
pub fn small_strain(text: &str, file: &SceneFile) -> Result<Vec<SmallStrain>, SceneError> {
    let builder = Builder { text: Text(text) };
    let of = |spec: &TissueSpec| {
        let spec = &builder.with_preset(spec)?;
        let density = builder.text.number("tissue", "density", &spec.density)?.unwrap_or(WATER);
        if let Some(E) = builder.springs(spec, true)? {
            return Ok(SmallStrain { E, nu: 0.25, density });
        }
        let (law, constants) = builder.law(spec)?;
        let Lame { mu, lambda } = (law.moduli)(&constants);
        Ok(SmallStrain {
            E: mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu),
            nu: lambda / (2.0 * (lambda + mu)),
            density,
        })
    };
    file.tissue.iter().map(of).collect()
}

/// Corotational elements of unit stiffness and a Poisson's ratio of 0.3; with bones alone the stiffness does not matter.
pub(super) fn stand_in(mesh: &TetMesh, midsides: &[[u32; 6]]) -> Vec<Box<dyn Term>> {
    let law = effect::law("corotational").expect("a law of the catalogue");
    vec![(law.term)(&[vec![1.0], vec![0.3]], Elements { X: &mesh.nodes, tets: &mesh.tets, midsides })]
}

/// Nodes of the sets that the bones name; names that do not exist are another's to report.
fn attached(bones: &[BoneSpec], mesh: &TetMesh) -> std::collections::BTreeSet<u32> {
    let set = |b: &BoneSpec| mesh.node_set(b.nodes.as_ref().unwrap_or(&b.name).get_ref()).map(|s| s.nodes.clone());
    bones.iter().filter_map(set).flatten().collect()
}

impl Builder<'_> {
    /// One term for each material, its overstress and damping if it has them, and the density of each region.
    pub(super) fn tissue(
        &self,
        file: &SceneFile,
        mesh: &TetMesh,
        midsides: &[[u32; 6]],
        warnings: &mut Vec<String>,
    ) -> Result<Tissue, SceneError> {
        let mut material = vec![usize::MAX; mesh.region_names.len()];
        for (k, spec) in file.tissue.iter().enumerate() {
            let Some(regions) = &spec.regions else {
                material.iter_mut().filter(|m| **m == usize::MAX).for_each(|m| *m = k);
                continue;
            };
            for name in regions {
                let r = mesh.region_names.iter().position(|r| r == name.get_ref());
                let r =
                    r.ok_or_else(|| self.text.unknown("region", name, mesh.region_names.iter().map(String::as_str)))?;
                if material[r] == usize::MAX {
                    material[r] = k;
                } else if material[r] != k && file.tissue[material[r]].regions.is_some() {
                    let message = format!("region `{}` is made of another [[tissue]] already", name.get_ref());
                    return Err(self.text.at(name.span().start, message));
                }
            }
        }
        if let Some(r) = material.iter().position(|&m| m == usize::MAX) {
            let message = format!(
                "region `{}` of the mesh has no material: name it in a [[tissue]], or give one [[tissue]] without `regions`",
                mesh.region_names[r]
            );
            return Err(self.text.at(file.mesh.span().start, message));
        }
        for k in (0..file.tissue.len()).filter(|k| !material.contains(k)) {
            let (n, of) = (k + 1, file.tissue.len());
            warnings.push(format!("[[tissue]] {n} of {of} makes no region of the mesh: those before it take them all"));
        }
        let fields = Fields { mesh, bones: attached(&file.bone, mesh), depth: OnceCell::new() };
        let mut out = Terms::default();
        // In modes damping is a number, no term.
        let inertia = file.inertia.as_ref().filter(|i| i.modes.is_none());
        let beta = inertia.and_then(|i| i.damping_stiffness.as_ref());
        let beta = beta.map_or(Ok(0.0), |b| self.text.checked("inertia", "damping_stiffness", b))?;
        let mut density = vec![0.0; mesh.region_names.len()];
        let names = self.text.names("tissue", file.tissue.iter().filter_map(|t| t.tunable.as_ref()))?;
        if names.len() > MOST_TUNABLE {
            let at =
                file.tissue.iter().filter_map(|t| t.tunable.as_ref()).nth(MOST_TUNABLE).map_or(0, |t| t.span().start);
            let message = format!("{} tissues are tunable; there are value references for {MOST_TUNABLE}", names.len());
            return Err(self.text.at(at, message));
        }
        let mut tunable = Vec::new();
        for (k, spec) in file.tissue.iter().enumerate() {
            let from_preset = spec.pressure.is_none();
            let spec = &mut self.with_preset(spec)?;
            // A preset says what linear tetrahedra need; quadratic ones do not.
            if from_preset && !midsides.is_empty() {
                spec.pressure = None;
            }
            let spec = &*spec;
            let mine = |r: u32| material[r as usize] == k;
            if let Some(E) = self.springs(spec, midsides.is_empty())? {
                if let Some(tunable) = &spec.tunable {
                    let message =
                        "`tunable` is for laws of a continuum; `mass-spring` is a fixed comparison".to_owned();
                    return Err(self.text.at(tunable.span().start, message));
                }
                let rho = self.text.number("tissue", "density", &spec.density)?.unwrap_or(WATER);
                density.iter_mut().enumerate().filter(|(r, _)| mine(*r as u32)).for_each(|(_, d)| *d = rho);
                let elements = (0..mesh.tets.len()).filter(|&e| mine(mesh.region[e])).map(|e| mesh.tets[e]);
                let tets: Vec<[u32; 4]> = elements.collect();
                out.terms.push(Box::new(OnElements(Springs(springs(E, &mesh.nodes, &tets)))) as Box<dyn Term>);
                continue;
            }
            let (law, constants) = self.law(spec)?;
            let Lame { mu, lambda } = (law.moduli)(&constants);
            let nu = lambda / (2.0 * (lambda + mu));
            let tuning = spec.tunable.as_ref().map(|name| {
                let tuning = Tuning { input: tunable.len(), E0: law.young(&constants) };
                tunable.push((name.get_ref().clone(), tuning.E0));
                tuning
            });
            let rho = self.text.number("tissue", "density", &spec.density)?.unwrap_or(WATER);
            let nodal = spec.pressure.as_ref().is_some_and(|p| p.get_ref() == "nodal");
            if nu > LOCKING_NU + ROUND_OFF && midsides.is_empty() && !nodal {
                warnings.push(format!(
                    "Poisson's ratio {nu:.4} on linear tetrahedra: above {LOCKING_NU} they lock, so motions come out too \
                     small and forces too large; pressure = \"nodal\" in its [[tissue]] (fast) or [mesh] order = 2 \
                     (accurate) does not"
                ));
            }
            density.iter_mut().enumerate().filter(|(r, _)| mine(*r as u32)).for_each(|(_, d)| *d = rho);
            let elements: Vec<usize> = (0..mesh.tets.len()).filter(|&e| mine(mesh.region[e])).collect();
            if !elements.is_empty() {
                let tets: Vec<[u32; 4]> = elements.iter().map(|&e| mesh.tets[e]).collect();
                let midsides: Vec<[u32; 6]> = elements.iter().filter_map(|&e| midsides.get(e).copied()).collect();
                let elements = Elements { X: &mesh.nodes, tets: &tets, midsides: &midsides };
                self.add_tissue(spec, law, &constants, beta, elements, tuning, &fields, &mut out)?;
            }
        }
        Ok(Tissue { terms: out.terms, density, n_history: out.n_history, tunable })
    }

    /// Pairs (g, tau) of a Prony series.
    pub(super) fn series(&self, spec: &ViscousSpec) -> Result<Vec<(f64, f64)>, SceneError> {
        self.text.all_in_range("tissue.viscous", "g", &spec.g)?;
        self.text.all_in_range("tissue.viscous", "tau", &spec.tau)?;
        let (g, tau) = (spec.g.get_ref(), spec.tau.get_ref());
        if g.is_empty() || g.len() != tau.len() {
            let message =
                format!("a Prony series takes as many `g` as `tau`, at least one; found {} and {}", g.len(), tau.len());
            return Err(self.text.at(spec.g.span().start, message));
        }
        Ok(g.iter().copied().zip(tau.iter().copied()).collect())
    }

    /// The law of a material and its constants, in the law's order.
    pub(super) fn law(&self, spec: &TissueSpec) -> Result<(&'static Law, Vec<Vec<f64>>), SceneError> {
        let name = self.text.choice("tissue", "energy", &spec.energy)?.unwrap_or(DEFAULT_LAW);
        let law = effect::law(name).expect("keys list the catalogue's laws");
        let wants = || law.keys.iter().map(|k| format!("`{k}`")).collect::<Vec<_>>().join(", ");
        let mut constants: Vec<Vec<f64>> = vec![Vec::new(); law.keys.len()];
        for (key, value) in spec.constants() {
            let Some(value) = value else { continue };
            let Some(k) = law.keys.iter().position(|wanted| *wanted == key) else {
                return Err(self
                    .text
                    .at(value.span().start, format!("`{key}` is no constant of `{name}`, which takes {}", wants())));
            };
            let values = value.get_ref().values();
            if let Some(bad) = values.iter().find(|v| !find("tissue", key).range.holds(**v)) {
                return Err(self.text.out_of_range("tissue", key, value, bad));
            }
            if values.is_empty() || (values.len() > 1 && name != "ogden") {
                return Err(self
                    .text
                    .at(value.span().start, format!("`{key}` of `{name}` is {} numbers; wanted one", values.len())));
            }
            constants[k] = values;
        }
        let place = spec.energy.as_ref().map_or(0, |e| e.span().start);
        if let Some(k) = constants.iter().position(Vec::is_empty) {
            let message = format!("`{name}` takes {}; `{}` is missing", wants(), law.keys[k]);
            return Err(self.text.at(place, message));
        }
        if name == "ogden"
            && (constants[0].len() != constants[1].len()
                || constants[1].contains(&0.0)
                || constants[0].iter().sum::<f64>() <= 0.0)
        {
            let message =
                "`ogden` takes as many `mu` as `alpha`, no `alpha` of zero, and `mu` whose sum is positive".to_owned();
            return Err(self.text.at(place, message));
        }
        Ok((law, constants))
    }

    pub(super) fn muscle(
        &self,
        spec: &MuscleSpec,
        mesh: &TetMesh,
        midsides: &[[u32; 6]],
        input: usize,
    ) -> Result<Box<dyn Term>, SceneError> {
        let path = self.path(&spec.path)?;
        let radius = self.text.checked("muscle", "radius", &spec.radius)?;
        let mut fibre = Vec::new();
        let (mut tets, mut mids) = (Vec::new(), Vec::new());
        for (e, tet) in mesh.tets.iter().enumerate() {
            let centre = tet.iter().map(|&a| mesh.nodes[a as usize]).sum::<Vec3>() / 4.0;
            let (along, distance) = nearest_on_path(&path, &centre);
            if distance <= radius {
                tets.push(*tet);
                mids.extend(midsides.get(e));
                fibre.extend(std::iter::repeat_n(along, if midsides.is_empty() { 1 } else { 4 }));
            }
        }
        if tets.is_empty() {
            let message = format!(
                "muscle `{}` holds no tetrahedron: no centre lies within {radius} m of its path; make `radius` larger or \
                 the mesh finer",
                spec.name.get_ref()
            );
            return Err(self.text.at(spec.name.span().start, message));
        }
        let muscle = Muscle {
            fibre,
            T0: self.text.number("muscle", "stress", &spec.stress)?.unwrap_or(100e3),
            width: self.text.number("muscle", "width", &spec.width)?,
            input,
        };
        Ok(Elements { X: &mesh.nodes, tets: &tets, midsides: &mids }.of(muscle))
    }
}
